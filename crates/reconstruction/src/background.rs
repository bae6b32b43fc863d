//! Draws the environment map where a view shows no surface, by the direction of each pixel.

use gpu::{Binding, ResourceTraits, ShaderVariant};
use minijinja::Value;

use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, recording::Recording};

/// The switches of `background.wgsl`.
#[derive(Debug)]
pub(crate) struct Background {
    set: SetVariant,
}

impl ShaderVariant for Background {
    const TEMPLATE: &'static str = "background.wgsl";
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        self.set.context()
    }

    fn all() -> Vec<Self> {
        SetVariant::all().into_iter().filter(|set| !set.count_fetches).map(|set| Self { set }).collect()
    }
}

/// The map is drawn after the fill: what the fill finds at no depth is background, too. Nothing is recorded for sets
/// without a map.
pub(crate) fn record(recording: &mut Recording<'_>) -> Result<(), ReconstructionError> {
    let Some(environment) = &recording.set.environment else { return Ok(()) };
    let variant = Background { set: recording.set.variant() };
    let pass = recording.device.passes.get(&variant)?;
    let mut bindings = recording.view_bindings();
    bindings.extend([
        Binding::buffer("out_srgb8", &recording.batch.srgb8),
        Binding::buffer("inverse_depth", &recording.batch.inverse_depth_per_m),
    ]);
    bindings.extend(environment.bindings());
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_pixels(&variant, &pass, &bound, None);
    Ok(())
}
