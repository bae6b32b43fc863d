//! Light between pixels that have it; the pixels where it would be wrong are listed.

use gpu::{Binding, DispatchSize, ResourceTraits, ShaderVariant, WorkKind, switches};
use minijinja::{Value, context};

use crate::{
    RenderError, batch::Recording, pixel_camera::CAMERA_TRAITS, pixel_list::PixelList, sums::SumPlanes,
    surfaces::Surfaces,
};

#[derive(Debug)]
pub(crate) struct Interpolate {
    by_rays: bool,
    /// Rays around a pole.
    single_pole: bool,
    /// The distance of the pixels that are filled in.
    step_px: u32,
    /// Planes of a pixel.
    sum_planes: usize,
}

impl ShaderVariant for Interpolate {
    const TEMPLATE: &'static str = "interpolate.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        context! { by_rays => self.by_rays, single_pole => self.single_pole, step_px => self.step_px, sum_planes => self.sum_planes }
    }

    fn all() -> Vec<Self> {
        let each = |sums: SumPlanes| {
            let sum_planes = sums.count();
            // Triangles are drawn through one eye.
            let each = switches().filter(|[by_rays, _, single_pole]| *by_rays || !single_pole);
            each.map(move |[by_rays, coarse, single_pole]| Self {
                by_rays,
                single_pole,
                step_px: 1 + u32::from(coarse),
                sum_planes,
            })
        };
        SumPlanes::all().flat_map(each).collect()
    }
}

/// Records the pass of one camera: pixels `step_px` apart are filled in from those twice as far apart, or listed,
/// in a list for each piece.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    (camera, target): (usize, &Surfaces),
    step_px: u32,
    lists: &[PixelList],
) -> Result<(), RenderError> {
    let Recording { passes, batch, cameras, sums, .. } = recording;
    let by_rays = batch.by_rays;
    let single_pole = batch.is_single_pole();
    let variant = Interpolate { by_rays, single_pole, step_px, sum_planes: batch.output.sums.count() };
    let pass = passes.get(&variant)?;
    let bound = lists.iter().map(|list| {
        let own = [Binding::buffer("camera", cameras), Binding::buffer("sums", &sums.buffer)];
        pass.bind(0, own.into_iter().chain(target.bindings()).chain(list.bindings()))
    });
    let bound = bound.collect::<Result<Vec<_>, _>>()?;
    let kind = WorkKind::new(batch.family(), &variant.name());
    recording.dispatch_pieces(kind, &pass, camera, |place, piece, width_px| {
        let [columns, rows] = [width_px, piece.end_row - piece.first_row].map(|side| side.div_ceil(step_px));
        (vec![&bound[place]], DispatchSize::Invocations([columns, rows, 1]))
    });
    Ok(())
}
