//! The colour that a pixel shows: the mean over its positions in linear light, as sRGB.

use gpu::{DynamicUniforms, ShaderVariant, switches};
use minijinja::{Value, context};

use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// What `antialias.wgsl` does with the sums over positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sums {
    /// There is one position, and none are needed.
    None,
    /// The first position begins them.
    Begun,
    /// Another position is added.
    Continued,
    /// All positions are there.
    Read,
}

/// The switches of `antialias.wgsl`.
#[derive(Debug)]
pub(crate) struct Shown {
    set: SetVariant,
    sums: Sums,
    /// Only listed pixels are added.
    listed: bool,
    environment_map: bool,
}

impl ShaderVariant for Shown {
    const TEMPLATE: &'static str = "antialias.wgsl";
    const DYNAMIC_UNIFORMS: DynamicUniforms = ONE_VIEW;

    fn context(&self) -> Value {
        let sums = format!("{:?}", self.sums);
        context! { sums, listed => self.listed, environment_map => self.environment_map, ..self.set.context() }
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for set in SetVariant::all().into_iter().filter(|set| !set.holes).chain([SetVariant::CUBE]) {
            for [listed, environment_map] in switches() {
                let sums = [Sums::None, Sums::Begun, Sums::Continued, Sums::Read];
                all.extend(sums.map(|sums| Self { set, sums, listed, environment_map }));
            }
        }
        all
    }
}

/// Adds a finished position to the sums, of listed pixels or of all, or writes the colours that the view shows.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    sums: Sums,
    listed: Option<&PixelList>,
) -> Result<(), ReconstructionError> {
    // Holes do not matter here.
    let set = SetVariant { holes: false, ..recording.set.variant() };
    let environment_map = recording.set.environment.is_some();
    let variant = Shown { set, sums, listed: listed.is_some(), environment_map };
    recording.dispatch_pixels(&variant, [], listed)
}
