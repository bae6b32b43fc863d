//! Gives pixels that no camera knows the colour of the farther side of their gap.

use depth_image::VIEW_REACH_PX;
use gpu::shader_variant;

use crate::view_work::{ONE_VIEW, SetVariant};
use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// The greatest distance of a known pixel, in steps along a row, column or diagonal.
pub(crate) const REACH_PX: i32 = VIEW_REACH_PX as i32;
/// Inverse depths whose ratio is above this are one side of the gap.
pub(crate) const SAME_SIDE: f32 = 0.95;
/// Steps towards known pixels.
pub(crate) const DIRECTIONS: [[i32; 2]; 8] = [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]];

shader_variant!(Fill(SetVariant), "fill.wgsl", ONE_VIEW);

pub(crate) fn record(recording: &mut Recording<'_>, unknown: &PixelList) -> Result<(), ReconstructionError> {
    let variant = Fill(recording.set.variant());
    recording.dispatch_pixels(&variant, [], Some(unknown))
}
