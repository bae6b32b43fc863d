//! The twin of `visibility.wgsl`.

use depth_image::{PinholeCamera, Ray};
use glam::{UVec2, Vec3};
use render::scalar::{
    MOST_LAYERS,
    rays::{Scene, pixel_ray},
};

use super::candidate::{Candidate, place};
use crate::methods::non_redundant::{SAME_DEPTH, SAME_FOOTPRINTS};

/// Xie, Algorithm 2: whether the first thing on the way from a camera to a point is the point itself.
#[must_use]
pub fn is_visibility_redundant(scene: &Scene, point_in_world: Vec3, footprint_m: f32, camera: &PinholeCamera) -> bool {
    let Some((_, depth_m)) = place(camera, point_in_world) else { return false };
    let room_m = SAME_DEPTH * depth_m + SAME_FOOTPRINTS * footprint_m;
    let direction_in_world = (point_in_world - camera.eye_in_world) / depth_m;
    let ray = Ray { origin_in_world: camera.eye_in_world, direction_in_world };
    let met = scene.closest_between(&ray, camera.near_m, depth_m + room_m).0;
    met.is_some_and(|hit| hit.t >= depth_m - room_m)
}

/// The number of rays that sampling by visibility sends for the images after the first: through pixels, and from earlier
/// viewpoints.
#[must_use]
pub fn rays_of_visibility(scene: &Scene, cameras: &[PinholeCamera]) -> usize {
    let of_image = |(number, camera): (usize, &PinholeCamera)| -> usize {
        let pixels = (0..camera.size_px.y).flat_map(|y| (0..camera.size_px.x).map(move |x| UVec2::new(x, y)));
        pixels.map(|pixel| rays_of_pixel(scene, camera, pixel, &cameras[..number])).sum()
    };
    cameras.iter().enumerate().skip(1).map(of_image).sum()
}

fn rays_of_pixel(scene: &Scene, camera: &PinholeCamera, pixel: UVec2, earlier: &[PinholeCamera]) -> usize {
    let ray = pixel_ray(camera, pixel);
    let (mut near, mut rays) = (camera.near_m, 0);
    for _ in 0..MOST_LAYERS {
        rays += 1;
        let Some(hit) = scene.closest(&ray, near).0 else { break };
        let candidate = Candidate::of(scene, camera, pixel, &ray, &hit);
        let seeing: Vec<_> = earlier.iter().filter(|other| place(other, candidate.point_in_world).is_some()).collect();
        let seen = |other: &PinholeCamera| {
            is_visibility_redundant(scene, candidate.point_in_world, candidate.footprint_m, other)
        };
        // Asked one after the other, until one sees it.
        let Some(place) = seeing.iter().position(|other| seen(other)) else {
            rays += seeing.len();
            break;
        };
        rays += place + 1;
        near = hit.t;
    }
    rays
}
