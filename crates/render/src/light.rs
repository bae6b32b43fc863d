//! The light of surfaces: rays for all pixels, or for a grid of pixels and those where light between them would be wrong.

use std::sync::Arc;

use gpu::{BufferPool, Frame, Gpu, Templates};

use crate::{
    RenderError,
    illuminate::{GRID_PX, Illuminate, IlluminateWork, Pixels},
    interpolate::{Interpolate, InterpolateVariant},
    lighting::Rate,
    pixel_list::PixelList,
    surfaces::Surfaces,
};

pub(crate) struct Light {
    gpu: Arc<Gpu>,
    illuminate: Illuminate,
    interpolate: Interpolate,
}

impl Light {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        let illuminate = Illuminate::new(gpu, templates);
        Self { gpu: gpu.clone(), illuminate, interpolate: Interpolate::new(gpu, templates) }
    }

    /// Records the passes of all cameras. The returned lists must live until the frame is done.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        pool: &BufferPool,
        work: IlluminateWork<'_>,
        rate: Rate,
        surfaces: &[Surfaces],
    ) -> Result<Vec<PixelList>, RenderError> {
        let mut lists = Vec::new();
        if rate == Rate::Full {
            self.illuminate.record(frame, work, Pixels::All, (0, surfaces))?;
            return Ok(lists);
        }
        self.illuminate.record(frame, work, Pixels::Grid, (0, surfaces))?;
        let mut step_px = GRID_PX / 2;
        while step_px > 0 {
            for (element, target) in (0..).zip(surfaces) {
                lists.push(self.refine(frame, pool, work, (element, target), step_px)?);
            }
            step_px /= 2;
        }
        Ok(lists)
    }

    /// Fills in the pixels of one camera that are `step_px` apart, and lights those that cannot be.
    fn refine(
        &self,
        frame: &mut Frame<'_>,
        pool: &BufferPool,
        work: IlluminateWork<'_>,
        (element, target): (u32, &Surfaces),
        step_px: u32,
    ) -> Result<PixelList, RenderError> {
        let list = PixelList::new(&self.gpu, pool, target);
        let sum_planes = work.variant.sums.count();
        let variant = InterpolateVariant { by_rays: work.variant.by_rays, step_px, sum_planes };
        // The rays that sums hold are as many for all parts.
        let cameras = (&work.cameras[0], element);
        self.interpolate.record(frame, &variant, cameras, (target, work.sums), &list)?;
        self.illuminate.record(frame, work, Pixels::List(&list), (element, std::slice::from_ref(target)))?;
        Ok(list)
    }
}
