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
        let sums = format!("{:?}", self.sums);
        context! { sums, listed => self.listed, environment_map => self.environment_map, ..self.set.context() }
    }

    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for set in SetVariant::all().into_iter().filter(|set| !set.holes).chain([SetVariant::CUBE]) {
            for environment_map in [false, true] {
                let whole = [Sums::None, Sums::Begun, Sums::Continued, Sums::Read];
                all.extend(whole.map(|sums| Self { set, sums, listed: false, environment_map }));
                all.push(Self { set, sums: Sums::Continued, listed: true, environment_map });
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
    let batch = &recording.batch;
    let mut bindings = recording.view_bindings();
    bindings.extend(recording.set.background_bindings());
    bindings.push(Binding::buffer("color", &batch.color));
    bindings.push(Binding::buffer("inverse_depth", &batch.inverse_depth_per_m));
    bindings.extend(batch.sums.as_ref().filter(|_| sums != Sums::None).map(|sums| Binding::buffer("sums", sums)));
    bindings.extend(listed.into_iter().flat_map(PixelList::bindings));
    let pass = recording.bind(&variant, bindings)?;
    recording.dispatch_pixels(&pass, listed);
    Ok(())
}
