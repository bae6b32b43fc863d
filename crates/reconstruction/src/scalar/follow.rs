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
use crate::bounce::{LEAST_WAY, MARCH_ROUNDS, plane_of};
use crate::methods::joint_carve::FIRST_SAMPLE;
use crate::sample_set::searched_volume;
use crate::view_work::CELL_MARGIN_PX;

/// Images of pinholes around a mirror.
pub struct PinholeImages {
    /// The nearest to the first image's eye comes first.
    cameras: Vec<SampleCamera>,
    /// Of these, the planes of flat images.
    planes: Vec<Option<Vec3>>,
    volume: Aabb,
}

impl PinholeImages {
    /// Of images within a volume; those of other models are left out.
    #[must_use]
    pub fn of(images: &[DepthImage], volume: &Aabb) -> Self {
        let pinholes = (0..).zip(images).filter(|(_, image)| matches!(image.camera, Camera::Pinhole(_)));
        let mut cameras: Vec<_> =
            pinholes.map(|(bit, image)| (SampleCamera::of(image, 1 << bit, false), plane_of(image))).collect();
        let middle = cameras.first().map_or(Vec3::ZERO, |(camera, _)| camera.eye_in_world);
        let distance = |camera: &SampleCamera| camera.eye_in_world.distance_squared(middle);
        cameras.sort_by(|(a, _), (b, _)| distance(a).total_cmp(&distance(b)));
        let (cameras, planes) = cameras.into_iter().unzip();
        Self { cameras, planes, volume: searched_volume(volume, images) }
    }

    /// The end of a ray with a direction of unit length, from `near_m` on.
    #[must_use]
    pub fn follow(&self, ray: &Ray, near_m: f32) -> RayEnd {
        let [near, far] = span_in(&self.volume, ray.origin_in_world, ray.direction_in_world, near_m);
        let (eye, direction) = (ray.origin_in_world, ray.direction_in_world);
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
            for (camera, plane) in self.cameras.iter().zip(&self.planes) {
                let [a, b] = ray.in_image_of(camera);
                if !found.crossed && found.t < ray.far && sees(camera, a + b * found.t) {
                    let onto = plane.and_then(|plane| march_flat(camera, plane, [a, b], [found.t, ray.far]));
                    found = onto.unwrap_or_else(|| march(camera, ray, found.t));
                }
            }
        }
        found
    }
}

/// Twin of `bounce/march_flat.wgsl`.
fn march_flat(camera: &SampleCamera, plane: Vec3, [a, b]: [Vec3; 2], [near, far]: [f32; 2]) -> Option<March> {
    let before = 1.0 - plane.dot(a + b * near);
    let t = near + before / plane.dot(b);
    let p = a + b * t;
    if before <= 0.0 || !t.is_finite() || t <= near || t >= far || !sees(camera, p) {
        return None;
    }
    let corners = camera.corners((p.xy() / p.z - 0.5).clamp(Vec2::ZERO, camera.cells - CELL_MARGIN_PX).as_uvec2());
    (corners.connected && corners.codes[0] >= FIRST_SAMPLE).then_some(March { t, crossed: true })
}

fn sees(camera: &SampleCamera, p: Vec3) -> bool {
    let uv = p.xy() / p.z - 0.5;
    p.z > 0.0 && uv.cmpge(Vec2::ZERO).all() && uv.cmplt(camera.cells).all()
}
