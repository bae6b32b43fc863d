//! The twin of `visibility.wgsl`.

use depth_image::{PinholeCamera, Ray};
use glam::Vec3;
use render::scalar::rays::Scene;

use super::candidate::place;
use crate::methods::non_redundant::{SAME_DEPTH, SAME_FOOTPRINTS};

/// Xie, Algorithm 2: whether the first thing on the way from a camera to a point is the point itself.
#[must_use]
pub fn is_visibility_redundant(scene: &Scene, point_in_world: Vec3, footprint_m: f32, camera: &PinholeCamera) -> bool {
    let Some((_, depth_m)) = place(camera, point_in_world) else { return false };
    let room_m = SAME_DEPTH * depth_m + SAME_FOOTPRINTS * footprint_m;
    let direction_in_world = (point_in_world - camera.eye_in_world) / depth_m;
    let ray = Ray { origin_in_world: camera.eye_in_world, direction_in_world };
    let met = scene.closest_between(&ray, camera.near_m, depth_m + room_m);
    met.is_some_and(|hit| hit.t >= depth_m - room_m)
}
