//! A linear search along each view ray, refined by bisection (Lages §4.2).

use gpu::{Binding, shader_variant};
use wgpu::BufferUsages;

use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording, surface};

/// As in the paper.
pub(super) const DEFAULT_STEPS: u32 = 100;
/// The time of a view is linear in the steps: with more, one client's view would hold the device.
pub(super) const MAX_STEPS: u32 = 1024;
pub(crate) const BISECTIONS: u32 = 8;

shader_variant!(Search(SetVariant), "light_field_search.wgsl", ONE_VIEW);

/// Gives the pixels that stay unknown.
pub(super) fn record(recording: &mut Recording<'_>, steps: u32) -> Result<PixelList, ReconstructionError> {
    let steps = recording.device.gpu.buffer_with("steps", &[steps], BufferUsages::UNIFORM);
    let search = Search(recording.set.variant());
    surface::record(recording, &search, None, &[Binding::buffer("steps", &steps)])
}
