//! The twin of `coverage.wgsl`.

use depth_image::PinholeCamera;
use glam::{UVec2, Vec3};
use render::scalar::rays::{Scene, pixel_ray};
use render::scalar::{MOST_COARSER, PLANE_FOOTPRINTS, TURNED_DEG};

use super::candidate::{Candidate, index_of, place, stretched_footprint};

/// The first surfaces that a camera sees.
pub(super) struct Surfaces {
    camera: PinholeCamera,
    /// The point and the triangle's normal towards the camera; `None` where nothing is met.
    points: Vec<Option<(Vec3, Vec3)>>,
}

impl Surfaces {
    pub fn of(scene: &Scene, camera: &PinholeCamera) -> Self {
        let pixels = (0..camera.size_px.y).flat_map(|y| (0..camera.size_px.x).map(move |x| UVec2::new(x, y)));
        let points = pixels.map(|pixel| {
            let ray = pixel_ray(camera, pixel);
            let hit = scene.closest(&ray, camera.near_m)?;
            Some((ray.origin_in_world + ray.direction_in_world * hit.t, scene.triangle_normal_in_world(&hit)))
        });
        Self { camera: *camera, points: points.collect() }
    }

    /// Whether this image knows all of a pixel of another camera, at the corners of a square that reaches a pixel to each side on
    /// the triangle's plane, and is not much coarser there.
    pub fn cover(&self, candidate: &Candidate, own: &PinholeCamera) -> bool {
        let point = candidate.point_in_world;
        let normal = candidate.triangle_normal;
        let sight = point - own.eye_in_world;
        let own_m = candidate.planar_depth_m / own.focal_px.min_element();
        let own_stretched_m = stretched_footprint(candidate.planar_depth_m, own, normal, sight);
        let column = own.world_from_camera * Vec3::X / own.focal_px.x * own.focal_px.min_element();
        let across = normal.cross(sight.normalize_or_zero() + column * 1e-3);
        let aside = across * (own_m / across.length().max(1e-15));
        let along = normal.cross(aside) * (own_stretched_m / own_m);
        let from_here = point - self.camera.eye_in_world;
        let depth_m = from_here.dot(self.camera.forward_in_world());
        stretched_footprint(depth_m, &self.camera, normal, from_here) <= MOST_COARSER * own_stretched_m
            && [-aside - along, aside - along, along - aside, aside + along]
                .into_iter()
                .all(|way| self.surround(point + way, normal, own_m))
    }

    /// Whether all four texels around a point's place lie on its surface.
    fn surround(&self, point: Vec3, normal: Vec3, own_m: f32) -> bool {
        let camera = &self.camera;
        let Some((pixel, depth_m)) = place(camera, point) else { return false };
        let low = (pixel - 0.5).floor().as_ivec2();
        if low.cmplt(glam::IVec2::ONE).any() || low.cmpge(camera.size_px.as_ivec2() - 2).any() {
            return false;
        }
        let plane_m = PLANE_FOOTPRINTS * own_m.max(depth_m / camera.focal_px.min_element());
        [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE].into_iter().all(|corner| {
            self.points[index_of(camera, low.as_uvec2() + corner)].is_some_and(|(held, held_normal)| {
                let gap = point - held;
                normal.dot(held_normal) >= TURNED_DEG.to_radians().cos()
                    && gap.dot(normal).abs() <= plane_m
                    && gap.dot(held_normal).abs() <= plane_m
            })
        })
    }
}
