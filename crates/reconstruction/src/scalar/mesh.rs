//! Twin of `mesh.wgsl`: a quad between each four neighbouring samples of one surface.

use depth_image::DepthImage;
use glam::{UVec2, Vec3};

use crate::{pyramid::CodedDepth, quads::Quad};

/// In the order of their upper left samples.
pub(super) fn quads(number: usize, image: &DepthImage) -> Vec<Quad> {
    let depth = CodedDepth::of(image);
    let camera = image.camera.reference();
    let size_px = image.size_px();
    let point = |texel: UVec2| -> Vec3 {
        let inverse_depth = (f32::from(depth.at(texel.x, texel.y)) - depth.offset) / depth.scale;
        camera.ray(texel.as_vec2() + 0.5).at(inverse_depth.recip())
    };
    let quad = |sample: usize| {
        let texel = UVec2::new(sample as u32 % size_px.x, sample as u32 / size_px.x);
        let corners_in_world = [UVec2::ZERO, UVec2::X, UVec2::Y, UVec2::ONE].map(|offset| point(texel + offset));
        Quad { image: number, corners_in_world, samples: [sample as u32, sample as u32 + size_px.x + 1] }
    };
    (0..depth.connected.len()).filter(|&sample| depth.connected[sample]).map(quad).collect()
}
