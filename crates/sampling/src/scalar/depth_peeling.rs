//! The twin of `depth_peeling.wgsl`.

use depth_image::DepthImage;

use super::candidate::{Candidate, index_of};
use crate::methods::depth_peeling::SAME_LAYER;

pub(super) fn is_in_layer(candidate: &Candidate, image: &DepthImage) -> bool {
    let camera = image.camera.reference();
    let inverse_depth = image.inverse_depth_per_m[index_of(camera, candidate.pixel)];
    inverse_depth <= 0.0 || candidate.planar_depth_m * inverse_depth <= 1.0 + SAME_LAYER
}
