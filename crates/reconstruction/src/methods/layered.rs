//! A walk along each view ray through the samples of a layered depth cube.

use gpu::{Binding, ResourceTraits, ShaderVariant};
use minijinja::{Value, context};

use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// The switches of `layered.wgsl`.
#[derive(Debug)]
pub(crate) struct Walk {
    set: SetVariant,
    listed: bool,
    /// What a ray does not meet may be a surface that the cube does not hold.
    truncated: bool,
}

impl ShaderVariant for Walk {
    const TEMPLATE: &'static str = "layered.wgsl";
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        context! { listed => self.listed, truncated => self.truncated, ..self.set.context() }
    }

    fn all() -> Vec<Self> {
        let counted = SetVariant { count_fetches: true, ..SetVariant::CUBE };
        let sets = [SetVariant::CUBE, counted].into_iter();
        let walks = sets.flat_map(|set| [false, true].map(|listed| Self { set, listed, truncated: false }));
        let truncated = Self { set: SetVariant::CUBE, listed: false, truncated: true };
        walks.chain([truncated]).collect()
    }
}

/// Gives the pixels that stay unknown.
pub(super) fn record(
    recording: &mut Recording<'_>,
    listed: Option<&PixelList>,
) -> Result<PixelList, ReconstructionError> {
    let undecided = recording.empty_list();
    let Some(cube) = recording.set.cube.clone() else { return Ok(undecided) };
    let variant = Walk { set: recording.variant(), listed: listed.is_some(), truncated: cube.truncated };
    let pass = recording.device.passes.get(&variant)?;
    let batch = &recording.batch;
    let mut bindings = recording.view_bindings();
    bindings.extend(cube.bindings());
    bindings.extend([
        Binding::buffer("out_color", &batch.color),
        Binding::buffer("out_inverse_depth", &batch.inverse_depth_per_m),
        Binding::buffer("out_provenance", &batch.provenance),
        Binding::buffer("undecided_pixels", &undecided.pixels),
        Binding::buffer("undecided", &undecided.lists),
    ]);
    bindings.extend(batch.fetches.as_ref().map(|fetches| Binding::buffer("out_fetches", fetches)));
    bindings.extend(listed.map(PixelList::bindings).into_iter().flatten());
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_pixels(&variant, &pass, &bound, listed);
    Ok(undecided)
}
