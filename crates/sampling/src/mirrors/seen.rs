//! Which places on the ways of rays an image sees.

use depth_image::Camera;
use glam::Vec3;

use super::rays::{PLACES, Triangles, Way};

/// Rays that decide, and as many others.
pub(super) struct Ways<'w> {
    pub triangles: &'w Triangles,
    pub deciding: Vec<Way>,
    pub fresh: Vec<Way>,
}

/// Cameras, and the places of the deciding ways that none of them sees.
pub(super) struct Images {
    pub cameras: Vec<Camera>,
    pub unseen: Vec<bool>,
}

/// Whether a camera sees a place: it is in the image, and the way of its pixel's ray is free. What is nearer than a single-pole
/// camera sees counts as free, as the walk along curved rays takes it.
pub(super) fn sees(camera: &Camera, place: Vec3, triangles: &Triangles) -> bool {
    if let Camera::SinglePole(bent) = camera
        && bent.reference.project(place).is_some_and(|at| at.planar_depth_m < bent.reference.near_m)
    {
        return true;
    }
    let Some(at) = camera.project(place).filter(|at| camera.reference().contains(at.pixel)) else { return false };
    let from = match camera {
        Camera::Pinhole(camera) => camera.eye_in_world,
        // Such rays do not pass the eye.
        Camera::SinglePole(bent) => bent.ray(at.pixel).at(bent.reference.near_m),
    };
    triangles.is_free(from, place)
}

/// Of each place of each way.
pub(super) fn seen_by(camera: &Camera, ways: &[Way], triangles: &Triangles) -> Vec<bool> {
    let sees = |place: Vec3| sees(camera, place, triangles);
    ways.iter().flat_map(|way| way.places().map(sees)).collect()
}

pub(super) fn strike(unseen: &mut [bool], seen: &[bool]) {
    unseen.iter_mut().zip(seen).for_each(|(unseen, seen)| *unseen &= !seen);
}

/// The share of ways of which some place is unseen.
pub(super) fn share_of_ways(unseen: &[bool]) -> f32 {
    let ways = unseen.chunks(PLACES);
    ways.clone().filter(|places| places.contains(&true)).count() as f32 / ways.len().max(1) as f32
}
