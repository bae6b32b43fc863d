//! Twin of `bounce/march.wgsl` and of what it leaves to the carve: rays off mirrors in images of pinholes.

use depth_image::{Aabb, Camera, DepthImage, ProvenanceKind, Ray};
use glam::{Vec2, Vec3, Vec3Swizzles};

use super::joint_carve::carve;
use super::march::{March, march};
use super::pixel::Pixel;
use super::sample_camera::SampleCamera;
use super::surface::blend_two_best;
use super::view_ray::{ViewRay, span_in};
use crate::RayEnd;
use crate::bounce::{LEAST_WAY, MARCH_ROUNDS};
use crate::sample_set::searched_volume;

/// Images of pinholes around a mirror.
pub struct PinholeImages {
    /// The nearest to the first image's eye comes first.
    cameras: Vec<SampleCamera>,
    volume: Aabb,
}

impl PinholeImages {
    /// Of images within a volume; those of other models are left out.
    #[must_use]
    pub fn of(images: &[DepthImage], volume: &Aabb) -> Self {
        let pinholes = (0..).zip(images).filter(|(_, image)| matches!(image.camera, Camera::Pinhole(_)));
        let mut cameras: Vec<_> = pinholes.map(|(bit, image)| SampleCamera::of(image, 1 << bit, false)).collect();
        let middle = cameras.first().map_or(Vec3::ZERO, |camera| camera.eye_in_world);
        cameras.sort_by(|a, b| {
            a.eye_in_world.distance_squared(middle).total_cmp(&b.eye_in_world.distance_squared(middle))
        });
        Self { cameras, volume: searched_volume(volume, images) }
    }

    /// The end of a ray with a direction of unit length, from `near_m` on.
    #[must_use]
    pub fn follow(&self, ray: &Ray, near_m: f32) -> RayEnd {
        let [near, far] = span_in(&self.volume, ray.origin_in_world, ray.direction_in_world, near_m);
        let eye = ray.origin_in_world;
        let direction = ray.direction_in_world;
        let ray = ViewRay { eye, direction, near, far, is_mirrored: true };
        let found = self.marched(&ray);
        let blend = blend_two_best(&self.cameras, &ray, found.t);
        let pixel = if found.crossed && blend.occupied {
            blend.pixel_at(found.t)
        } else if !found.crossed && far - found.t <= LEAST_WAY * far.abs() {
            Pixel::without_surface(ProvenanceKind::Empty)
        } else {
            carve(&self.cameras, &ray, found.t, 0)
        };
        RayEnd {
            kind: pixel.provenance.kind(),
            way_m: pixel.inverse_depth_per_m.recip(),
            color_linear: pixel.color_linear,
            steps: 0,
        }
    }

    /// From image to image, as long as one sees where the ray is.
    fn marched(&self, ray: &ViewRay) -> March {
        let mut found = March { t: ray.near, crossed: false };
        for _ in 0..MARCH_ROUNDS {
            for camera in &self.cameras {
                let [a, b] = ray.in_image_of(camera);
                if !found.crossed && found.t < ray.far && sees(camera, a + b * found.t) {
                    found = march(camera, ray, found.t);
                }
            }
        }
        found
    }
}

fn sees(camera: &SampleCamera, p: Vec3) -> bool {
    let uv = p.xy() / p.z - 0.5;
    p.z > 0.0 && uv.cmpge(Vec2::ZERO).all() && uv.cmplt(camera.cells).all()
}
