//! The memory for rough surfaces that send rays into their lobes.

use bytemuck::{Pod, Zeroable};
use gpu::PooledBuffer;

use crate::{device::Device, error::ReconstructionError};

/// `GlossySurface` of `bounce/glossy.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuGlossySurface {
    pub point_in_world: [f32; 3],
    pub pixel: u32,
    pub towards_eye: [f32; 3],
    pub normal_oct16: u32,
    pub throughput_linear: [f32; 3],
    pub roughness: f32,
    pub open: f32,
    pub is_mirrored: u32,
    pub padding: [u32; 2],
}

/// For as many pixels: surfaces, and the light that their rays bring.
pub(super) fn lend(device: &Device, pixels: usize) -> Result<[PooledBuffer; 2], ReconstructionError> {
    let surfaces = device.lend("glossy surfaces", size_of::<GpuGlossySurface>() * pixels)?;
    Ok([surfaces, device.lend("light of lobes", 12 * pixels)?])
}
