//! Images of single-pole occlusion cameras on the device: `single_pole.wgsl`.

use bytemuck::{Pod, Zeroable};
use depth_image::{Camera, DepthImage};

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

/// The poles of all images; none of pinholes. `Err` has the first image of another model than the first's.
pub(crate) fn poles(images: &[DepthImage]) -> Result<Vec<GpuPole>, usize> {
    let pole = |image: &DepthImage| match image.camera {
        Camera::Pinhole(_) => None,
        Camera::SinglePole(camera) => Some(GpuPole {
            pole_px: camera.pole_px.to_array(),
            bend_px_m: camera.bend_px_m(),
            nearest_per_m: camera.reference.near_m.recip(),
            farthest_per_m: camera.farthest_m.recip(),
            ..GpuPole::zeroed()
        }),
    };
    let poles: Vec<GpuPole> = images.iter().filter_map(pole).collect();
    match images.iter().position(|image| !image.camera.is_of_model(&images[0].camera)) {
        Some(other) => Err(other),
        None => Ok(poles),
    }
}
