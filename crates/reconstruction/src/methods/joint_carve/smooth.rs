//! The light of all positions within pixels that show one smooth surface or only background, from the first position.

use depth_image::Antialias;
use glam::Vec2;
use gpu::{DynamicUniforms, ShaderVariant};
use minijinja::{Value, context};

use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// A surface is smooth where its depth lies this close to the middle of its neighbours' on both sides, in the pixel's
/// footprints.
pub(crate) const SMOOTH_FOOTPRINTS: f32 = 0.5;
/// A tile's start over the depth of a smooth surface in it, at least.
pub(crate) const OPEN_SHARE: f32 = 0.5;
/// Linear light. A highlight up to here may be the same at all positions.
pub(crate) const FAINT_HIGHLIGHT: f32 = 0.02;

/// The switches of `smooth.wgsl`.
#[derive(Debug)]
pub(crate) struct Smooth {
    set: SetVariant,
    antialias: Antialias,
    /// Samples have a light that depends on the viewer.
    highlights: bool,
    environment_map: bool,
}

impl ShaderVariant for Smooth {
    const TEMPLATE: &'static str = "joint_carve/smooth.wgsl";
    const DYNAMIC_UNIFORMS: DynamicUniforms = ONE_VIEW;

    fn context(&self) -> Value {
        let offsets: Vec<[f32; 2]> = from_first_px(self.antialias).map(|offset| offset.to_array()).collect();
        let Self { highlights, environment_map, .. } = *self;
        context! { offsets, highlights, environment_map, ..self.set.context() }
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for antialias in [2, 4, 8, 16].into_iter().filter_map(Antialias::of) {
            for [highlights, environment_map] in gpu::switches() {
                let sets = SetVariant::all().into_iter();
                all.extend(sets.map(|set| Self { set, antialias, highlights, environment_map }));
            }
        }
        all
    }
}

/// Where the further positions are, from the first.
pub(crate) fn from_first_px(antialias: Antialias) -> impl Iterator<Item = Vec2> {
    let first = antialias.offsets_px().next().unwrap_or_default();
    antialias.offsets_px().skip(1).map(move |offset| offset - first)
}

/// Begins the sums over positions; gives the pixels whose further positions are to be found.
pub(crate) fn record(recording: &mut Recording<'_>) -> Result<PixelList, ReconstructionError> {
    let set = recording.set;
    let variant = Smooth {
        set: set.variant(),
        antialias: recording.batch.planes.antialias,
        highlights: set.reflectors.is_some(),
        environment_map: set.environment.is_some(),
    };
    let rough = recording.rough_list();
    recording.dispatch_pixels(&variant, rough.written_bindings(), None)?;
    Ok(rough)
}
