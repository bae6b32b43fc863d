//! The vote of all cameras on a point: `surface.wgsl`, the common part of passes that find surfaces.

use gpu::{Binding, ShaderVariant};
use wgpu::Buffer;

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

/// The pixels that a pass finds surfaces for, and where their rays begin.
#[derive(Clone, Copy)]
pub(crate) enum Rays<'l> {
    /// All, from where their tiles start.
    All,
    /// Some, from where their tiles start.
    Listed(&'l PixelList),
    /// What the pass before left, from where it got.
    Left(&'l PixelList),
}

impl<'l> Rays<'l> {
    pub fn list(self) -> Option<&'l PixelList> {
        match self {
            Self::All => None,
            Self::Listed(list) | Self::Left(list) => Some(list),
        }
    }
}

/// Records a pass that finds surfaces, with its own resources. Gives the pixels that it leaves undecided.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    variant: &impl ShaderVariant,
    rays: Rays<'_>,
    own: &[Binding<'_>],
) -> Result<PixelList, ReconstructionError> {
    let undecided = recording.empty_list();
    let batch = &recording.batch;
    let mut bindings = bindings(recording, &undecided);
    let starts = batch.tile_start_m.as_ref().filter(|_| !matches!(rays, Rays::Left(_)));
    bindings.extend(starts.map(|starts| Binding::buffer("tile_start_m", starts)));
    bindings.extend(batch.targets.iter().flat_map(|drawn| drawn.bindings()));
    bindings.extend(rays.list().into_iter().flat_map(PixelList::bindings));
    bindings.extend(own.iter().cloned());
    let pass = recording.bind(variant, bindings)?;
    recording.dispatch_pixels(&pass, rays.list());
    Ok(undecided)
}

/// The resources of `surface.wgsl`.
pub(crate) fn bindings<'b>(recording: &'b Recording<'_>, undecided: &'b PixelList) -> Vec<Binding<'b>> {
    let mut bindings = recording.cell_bindings();
    bindings.push(Binding::texture("cell_colors", &recording.set.cell_colors));
    bindings.extend(found_bindings(recording.batch.pixel_planes(), undecided));
    bindings
}

/// The resources of `found.wgsl`: colours, inverse depths and provenance of what is found, and what stays undecided.
pub(crate) fn found_bindings<'b>(planes: [&'b Buffer; 3], undecided: &'b PixelList) -> [Binding<'b>; 5] {
    let [color, inverse_depth, provenance] = planes;
    [
        Binding::buffer("out_color", color),
        Binding::buffer("out_inverse_depth", inverse_depth),
        Binding::buffer("out_provenance", provenance),
        Binding::buffer("undecided_pixels", &undecided.pixels),
        Binding::buffer("undecided", &undecided.lists),
    ]
}
