//! Gives pixels that no camera knows the colour of the farther side of their gap.

use bytemuck::{Pod, Zeroable};
use gpu::{Binding, shader_variant, uniform_elements};
use wgpu::BufferUsages;

use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording, view_work::ONE_VIEW};

/// The greatest distance of a known pixel, in steps along a row, column or diagonal.
pub(crate) const REACH_PX: i32 = 48;
/// Inverse depths whose ratio is above this are one side of the gap.
pub(crate) const SAME_SIDE: f32 = 0.95;
/// Steps towards known pixels.
pub(crate) const DIRECTIONS: [[i32; 2]; 8] = [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]];

/// `FillWork` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuFillWork {
    pub size_px: [u32; 2],
    pub first_pixel: u32,
    pub number: u32,
}

shader_variant!(Fill, "fill.wgsl", ONE_VIEW);

pub(crate) fn record(recording: &mut Recording<'_>, unknown: &PixelList) -> Result<(), ReconstructionError> {
    let pass = recording.device.passes.get(&Fill)?;
    let batch = &recording.batch;
    let (size_px, pixels) = (batch.size_px.to_array(), batch.size_px.element_product());
    let works =
        (0..batch.cameras.len() as u32).map(|number| GpuFillWork { size_px, first_pixel: number * pixels, number });
    let works = uniform_elements(works.map(|work| bytemuck::bytes_of(&work).to_vec()));
    let works = recording.device.gpu.buffer_with("fill", &works, BufferUsages::UNIFORM);
    let planes = [
        Binding::buffer("work", &works),
        Binding::buffer("srgb8", &batch.srgb8),
        Binding::buffer("inverse_depth", &batch.inverse_depth_per_m),
        Binding::buffer("provenance", &batch.provenance),
    ];
    let bound = pass.bind(0, planes.into_iter().chain(unknown.bindings()))?;
    recording.dispatch_pixels(&pass, &bound, Some(unknown));
    Ok(())
}
