//! The vote of all cameras on a point: `surface.wgsl`, the common part of passes that find surfaces.

use gpu::{Binding, ShaderVariant};

use crate::{error::ReconstructionError, pixel_list::PixelList, recording::Recording};

/// The surface's thickness, in texel footprints: the best of a sweep (docs/methods/joint_carve.md).
pub(crate) const THICKNESS_FOOTPRINTS: f32 = 2.0;
/// The weight of a sample behind a redundant surface that its image omits, beside a sample with nothing omitted before it.
pub(crate) const HIDDEN_WEIGHT: f32 = 0.02;
/// Added to the squared angle between two lines of sight, so that no camera's weight is unbounded.
pub(crate) const ANGLE_FLOOR: f32 = 1e-2;
/// A camera counts where more than this share of the texels around a point lies on the point's own surface.
pub(crate) const LEAST_SHARE: f32 = 0.05;
/// A camera carves a point where more than this share of the texels around shows what is beyond it.
pub(crate) const CARVING_SHARE: f32 = 0.999;
/// Weight falls towards the border of an image from this distance on.
pub(crate) const BORDER_PX: f32 = 8.0;
/// Depth is known to half a code; a ray that reached a plane's very depth is still before it.
pub(crate) const HALF_CODE: f32 = 0.5;

/// A sample whose texels all lie on one surface has more than this share of them there.
pub(crate) const WHOLE: f32 = 0.999;
/// Where provenance says how two cameras share a colour.
pub(crate) const SPLIT_SHIFT: u32 = 24;

/// Records a pass that finds the surfaces of listed pixels or of all, with its own resources. Gives the pixels that it leaves
/// undecided.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    variant: &impl ShaderVariant,
    listed: Option<&PixelList>,
    own: &[Binding<'_>],
) -> Result<PixelList, ReconstructionError> {
    let undecided = recording.empty_list();
    recording.dispatch_pixels(variant, undecided.written_bindings().into_iter().chain(own.iter().cloned()), listed)?;
    Ok(undecided)
}
