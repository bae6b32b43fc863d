//! Gives pixels that no camera knows the colour of the farther side of their gap.

use depth_image::VIEW_REACH_PX;
use gpu::{Binding, ResourceTraits, ShaderVariant};
use minijinja::Value;

use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// The greatest distance of a known pixel, in steps along a row, column or diagonal.
pub(crate) const REACH_PX: i32 = VIEW_REACH_PX as i32;
/// Inverse depths whose ratio is above this are one side of the gap.
pub(crate) const SAME_SIDE: f32 = 0.95;
/// Steps towards known pixels.
pub(crate) const DIRECTIONS: [[i32; 2]; 8] = [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]];

/// The switches of `fill.wgsl`.
#[derive(Debug)]
pub(crate) struct Fill(SetVariant);

impl ShaderVariant for Fill {
    const TEMPLATE: &'static str = "fill.wgsl";
    const TRAITS: ResourceTraits = ONE_VIEW;

    fn context(&self) -> Value {
        self.0.context()
    }

    fn all() -> Vec<Self> {
        SetVariant::all().into_iter().chain([SetVariant::CUBE]).map(Self).collect()
    }
}

pub(crate) fn record(recording: &mut Recording<'_>, unknown: &PixelList) -> Result<(), ReconstructionError> {
    let variant = Fill(recording.set.variant());
    let [color, inverse_depth, provenance] = recording.batch.pixel_planes();
    let mut bindings = recording.view_bindings();
    bindings.extend([
        Binding::buffer("color", color),
        Binding::buffer("inverse_depth", inverse_depth),
        Binding::buffer("provenance", provenance),
    ]);
    bindings.extend(unknown.bindings());
    let pass = recording.bind(&variant, bindings)?;
    recording.dispatch_pixels(&pass, Some(unknown));
    Ok(())
}
