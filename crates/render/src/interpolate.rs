//! Light between pixels that have it; the pixels where it would be wrong are listed.

use gpu::{Binding, ResourceTraits, ShaderVariant, switches};
use minijinja::{Value, context};

use crate::{
    RenderError, batch::Recording, pixel_camera::CAMERA_TRAITS, pixel_list::PixelList, sums::SumPlanes,
    surfaces::Surfaces,
};

#[derive(Debug)]
pub(crate) struct Interpolate {
    by_rays: bool,
    /// The distance of the pixels that are filled in.
    step_px: u32,
    /// Planes of a pixel.
    sum_planes: usize,
}

impl ShaderVariant for Interpolate {
    const TEMPLATE: &'static str = "interpolate.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        context! { by_rays => self.by_rays, step_px => self.step_px, sum_planes => self.sum_planes }
    }

    fn all() -> Vec<Self> {
        let each = |sums: SumPlanes| {
            let sum_planes = sums.count();
            switches().map(move |[by_rays, coarse]| Self { by_rays, step_px: 1 + u32::from(coarse), sum_planes })
        };
        SumPlanes::all().flat_map(each).collect()
    }
}

/// Records the pass of one camera: pixels `step_px` apart are filled in from those twice as far apart, or listed.
pub(crate) fn record(
    recording: &mut Recording<'_>,
    (element, target): (u32, &Surfaces),
    step_px: u32,
    list: &PixelList,
) -> Result<(), RenderError> {
    let Recording { passes, batch, cameras, sums, frame, .. } = recording;
    let sum_planes = batch.output.sums.count();
    let pass = passes.get(&Interpolate { by_rays: batch.by_rays, step_px, sum_planes })?;
    let own = [Binding::buffer("camera", cameras), Binding::buffer("sums", &sums.buffer)];
    let bound = pass.bind(0, own.into_iter().chain(target.bindings()).chain(list.bindings()))?;
    pass.dispatch_each(frame, &[&bound], element..element + 1, target.invocations(step_px));
    Ok(())
}
