//! Adds the light that depends on the viewer to pixels that show a surface.

use gpu::{DynamicUniforms, ShaderVariant};
use minijinja::{Value, context};

use crate::bounce::{Bounces, RayLists};
use crate::reflectors::{LobeLight, Reflection};
use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, lobes::GlossyList, pixel_list::PixelList, recording::Recording};

/// The switches of `specular.wgsl`.
#[derive(Debug)]
pub(crate) struct Specular {
    set: SetVariant,
    /// Only listed pixels are lit.
    listed: bool,
    reflection: Reflection,
}

impl ShaderVariant for Specular {
    const TEMPLATE: &'static str = "specular.wgsl";
    const DYNAMIC_UNIFORMS: DynamicUniforms = ONE_VIEW;

    fn context(&self) -> Value {
        context! { single_pole => false, listed => self.listed, ..self.reflection.context(self.set) }
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for set in SetVariant::all() {
            for lit in Reflection::all().into_iter().filter(|lit| lit.highlight.is_some()) {
                for reflection in lit.with_lobes(&[LobeLight::sent(lit.mirror_cells.is_some())]) {
                    all.extend([false, true].map(|listed| Self { set, listed, reflection }));
                }
            }
        }
        all
    }
}

/// Highlights are added after the fill, which would spread them. Mirrors list their rays, where they are to be followed, and rough
/// surfaces are listed, where their lobes are sent rays.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    listed: Option<&PixelList>,
    mirrored: Option<(&Bounces<'_>, &RayLists)>,
    glossy: Option<&GlossyList<'_>>,
) -> Result<(), ReconstructionError> {
    let set = recording.set;
    if set.reflectors.is_none() {
        return Ok(());
    }
    let mirror_cells = mirrored.map(|(bounces, _)| bounces.cells.len());
    let lobe = glossy.map(|_| LobeLight::sent(mirror_cells.is_some()));
    let reflection = Reflection::of(set.reflectors.as_ref(), mirror_cells, lobe, set.environment.is_some());
    let variant = Specular { set: set.variant(), listed: listed.is_some(), reflection };
    let spawned = mirrored.into_iter().flat_map(|(bounces, next)| bounces.spawn_bindings(next));
    recording.dispatch_pixels(&variant, spawned.chain(glossy.into_iter().flat_map(GlossyList::bindings)), listed)
}
