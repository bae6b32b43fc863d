//! A linear search along each view ray, refined by bisection (Lages §4.2).

use gpu::{Binding, DynamicUniforms, ShaderVariant};
use minijinja::{Value, context};
use wgpu::BufferUsages;

use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording, surface};

/// As in the paper.
pub(super) const DEFAULT_STEPS: u32 = 100;
/// The time of a view is linear in the steps: with more, one client's view would hold the device.
pub(super) const MAX_STEPS: u32 = 1024;
pub(crate) const BISECTIONS: u32 = 8;

/// The switches of `light_field_search.wgsl`.
#[derive(Debug)]
pub(crate) struct Search {
    set: SetVariant,
    /// Only the rays of listed pixels are searched.
    listed: bool,
}

impl ShaderVariant for Search {
    const TEMPLATE: &'static str = "light_field_search.wgsl";
    const DYNAMIC_UNIFORMS: DynamicUniforms = ONE_VIEW;

    fn context(&self) -> Value {
        context! { listed => self.listed, ..self.set.context() }
    }

    fn all() -> Vec<Self> {
        SetVariant::all().into_iter().flat_map(|set| [false, true].map(|listed| Self { set, listed })).collect()
    }
}

/// Gives the pixels that stay unknown.
pub(super) fn record(
    recording: &mut Recording<'_>,
    steps: u32,
    listed: Option<&PixelList>,
) -> Result<PixelList, ReconstructionError> {
    let steps = recording.device.gpu.buffer_with("steps", &[steps], BufferUsages::UNIFORM);
    let search = Search { set: recording.set.variant(), listed: listed.is_some() };
    surface::record(recording, &search, listed, &[Binding::buffer("steps", &steps)])
}
