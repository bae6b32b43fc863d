//! A linear search along each view ray, refined by bisection (Lages §4.2).

use gpu::{Binding, PassCache, ResourceTraits, ShaderVariant};
use minijinja::{Value, context};
use wgpu::BufferUsages;

use crate::{
    error::ReconstructionError,
    pixel_list::PixelList,
    recording::Recording,
    surface::{self, SurfaceVariant},
    view_work::ONE_VIEW,
};

pub(super) const SHADER: (&str, &str) = ("light_field_search.wgsl", include_str!("light_field_search.wgsl"));

/// As in the paper.
pub(super) const DEFAULT_STEPS: u32 = 100;
const MAX_STEPS: u32 = 65_536;
pub(crate) const BISECTIONS: u32 = 8;

/// The switches of `light_field_search.wgsl`.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Search(SurfaceVariant);

impl ShaderVariant for Search {
    const TEMPLATE: &'static str = SHADER.0;
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! { bisections => BISECTIONS, ..self.0.context() }
    }

    fn all() -> Vec<Self> {
        SurfaceVariant::all().into_iter().map(Self).collect()
    }
}

pub(super) fn parse_steps(text: &str) -> Option<u32> {
    text.parse().ok().filter(|steps| (1..=MAX_STEPS).contains(steps))
}

/// Half as many steps.
pub(super) fn fewer_steps(steps: u32) -> Option<u32> {
    (steps > 1).then_some(steps / 2)
}

/// Gives the pixels that stay unknown.
pub(super) fn record(
    passes: &PassCache<Search>,
    recording: &mut Recording<'_>,
    steps: u32,
) -> Result<PixelList, ReconstructionError> {
    let pass = passes.get(&Search(SurfaceVariant::of(recording)))?;
    let unknown = recording.lend_list();
    let steps = recording.device.gpu.buffer_with("steps", &[steps], BufferUsages::UNIFORM);
    let mut bindings = surface::bindings(recording, &unknown);
    bindings.push(Binding::buffer("tile_start_m", &recording.batch.tile_start_m));
    bindings.push(Binding::buffer("steps", &steps));
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_pixels(&pass, &bound);
    Ok(unknown)
}
