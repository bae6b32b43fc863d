//! The twin of `pixel.wgsl`.

use depth_image::{DepthImage, SurfaceId};
use glam::Vec3;

use super::candidate::{Candidate, index_of, place};

/// Xie, Algorithm 3. False for an image without surface ids.
#[must_use]
pub fn is_pixel_redundant(candidate: &Candidate, image: &DepthImage) -> bool {
    holds(image, candidate.point_in_world, candidate.id)
}

/// Whether an image has a sample of a triangle at the pixel that a point is seen at.
#[must_use]
pub fn holds(image: &DepthImage, point_in_world: Vec3, id: SurfaceId) -> bool {
    let camera = image.camera.reference();
    let (Some((pixel, _)), Some(ids)) = (place(camera, point_in_world), &image.surface_id) else { return false };
    let index = index_of(camera, pixel.as_uvec2());
    image.inverse_depth_per_m[index] > 0.0 && ids[index] == id
}
