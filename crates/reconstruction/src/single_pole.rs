//! Images of single-pole occlusion cameras on the device: `single_pole.wgsl`.

use bytemuck::{Pod, Zeroable};
use depth_image::{Camera, DepthImage};

use crate::error::ReconstructionError;

/// `Pole` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuPole {
    pub pole_px: [f32; 2],
    pub bend_px_m: f32,
    pub nearest_per_m: f32,
    pub farthest_per_m: f32,
    pub padding_0: f32,
    pub padding_1: f32,
    pub padding_2: f32,
}

/// The poles of all images; none of pinholes. Fails for images of several models, and for a pole outside of its image.
pub(crate) fn poles(images: &[DepthImage]) -> Result<Vec<GpuPole>, ReconstructionError> {
    let mut poles = Vec::new();
    for (index, image) in images.iter().enumerate() {
        if !image.camera.is_of_model(&images[0].camera) {
            let reason = format!("a {} image, the first is of another model", image.camera.model_name());
            return Err(ReconstructionError::sample(index, reason));
        }
        let Camera::SinglePole(camera) = image.camera else { continue };
        if !camera.reference.contains(camera.pole_px) {
            return Err(ReconstructionError::sample(index, "the pole lies outside of the image"));
        }
        poles.push(GpuPole {
            pole_px: camera.pole_px.to_array(),
            bend_px_m: camera.bend_px_m(),
            nearest_per_m: camera.reference.near_m.recip(),
            farthest_per_m: camera.farthest_m.recip(),
            ..GpuPole::zeroed()
        });
    }
    Ok(poles)
}
