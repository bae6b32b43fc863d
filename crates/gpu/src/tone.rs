//! Exposure and tone curve as `tone.wgsl` reads them.

use bytemuck::{Pod, Zeroable};
use depth_image::ToneMapping;

/// `Tone` of `tone.wgsl`, a part of the uniforms of passes that encode colours.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct GpuTone {
    pub exposure_factor: f32,
    pub curve: u32,
    pub padding: [u32; 2],
}

impl From<ToneMapping> for GpuTone {
    fn from(ToneMapping { exposure, curve }: ToneMapping) -> Self {
        Self { exposure_factor: exposure.factor(), curve: curve as u32, padding: [0; 2] }
    }
}
