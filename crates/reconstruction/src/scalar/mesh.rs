//! Twin of `mesh.wgsl`: a quad between each four neighbouring samples of one surface.

use depth_image::DepthImage;
use glam::UVec2;

use super::sample_camera::CORNERS;
use crate::{pyramid::CodedDepth, quads::Quad};

/// In the order of their upper left samples.
pub(super) fn quads(number: usize, image: &DepthImage) -> Vec<Quad> {
    let depth = CodedDepth::of(image);
    let camera = image.camera.reference();
    let width = image.size_px().x;
    let connected = (0..).zip(&depth.connected).filter(|(_, connected)| **connected);
    let quads = connected.map(|(sample, _)| {
        let texel = UVec2::new(sample % width, sample / width);
        let corners_in_world = CORNERS.map(|offset| {
            let at = texel + offset;
            let inverse_depth = (f32::from(depth.at(at.x, at.y)) - depth.offset) / depth.scale;
            camera.ray(at.as_vec2() + 0.5).at(inverse_depth.recip())
        });
        Quad { image: number, corners_in_world, samples: [sample, sample + width + 1] }
    });
    quads.collect()
}
