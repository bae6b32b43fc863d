//! The colour that a pixel shows: the mean over its positions in linear light, as sRGB.

use gpu::{Binding, ResourceTraits, ShaderVariant};
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
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        let sums = match self.sums {
            Sums::None => "none",
            Sums::Begun => "begun",
            Sums::Continued => "continued",
            Sums::Read => "read",
        };
        context! { sums, listed => self.listed, environment_map => self.environment_map, ..self.set.context() }
    }

    fn all() -> Vec<Self> {
        let whole = [Sums::None, Sums::Begun, Sums::Continued, Sums::Read].map(|sums| (sums, false));
        let sums = whole.into_iter().chain([(Sums::Continued, true)]);
        let sets = SetVariant::all().into_iter().filter(|set| !set.holes).chain([SetVariant::CUBE]);
        let each = |set| {
            sums.clone().flat_map(move |(sums, listed)| {
                [false, true].map(|environment_map| Self { set, sums, listed, environment_map })
            })
        };
        sets.flat_map(each).collect()
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
    let pass = recording.device.passes.get(&variant)?;
    let batch = &recording.batch;
    let mut bindings = recording.view_bindings();
    bindings.extend(recording.set.background_bindings());
    bindings.push(Binding::buffer("color", &batch.color));
    bindings.push(Binding::buffer("inverse_depth", &batch.inverse_depth_per_m));
    bindings.extend(batch.sums.as_ref().filter(|_| sums != Sums::None).map(|sums| Binding::buffer("sums", sums)));
    bindings.extend(listed.map(PixelList::bindings).into_iter().flatten());
    let bound = pass.bind(0, bindings)?;
    recording.dispatch_pixels(&variant, &pass, &bound, listed);
    Ok(())
}
