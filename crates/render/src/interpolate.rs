//! Light between pixels that have it; the pixels where it would be wrong are listed.

use std::sync::Arc;

use gpu::{Binding, Frame, Gpu, PassCache, ResourceTraits, ShaderVariant, Templates, switches};
use minijinja::{Value, context};

use crate::{RenderError, pixel_camera::CAMERA_TRAITS, pixel_list::PixelList, sums::SumPlanes, surfaces::Surfaces};

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct InterpolateVariant {
    pub by_rays: bool,
    /// The distance of the pixels that are filled in.
    pub step_px: u32,
    /// Planes of a pixel.
    pub sum_planes: usize,
}

impl ShaderVariant for InterpolateVariant {
    const TEMPLATE: &'static str = "interpolate.wgsl";
    const TRAITS: ResourceTraits = CAMERA_TRAITS;

    fn context(&self) -> Value {
        context! { by_rays => self.by_rays, step_px => self.step_px, sum_planes => self.sum_planes }
    }

    fn all() -> Vec<Self> {
        let each = |sums: SumPlanes| {
            switches().map(move |[by_rays, coarse]| Self {
                by_rays,
                step_px: if coarse { 2 } else { 1 },
                sum_planes: sums.count(),
            })
        };
        SumPlanes::all().flat_map(each).collect()
    }
}

pub(crate) struct Interpolate(PassCache);

impl Interpolate {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self(PassCache::new(gpu, templates))
    }

    /// Records the pass of one camera: pixels `step_px` apart are filled in from those twice as far apart, or listed.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        variant: &InterpolateVariant,
        (cameras, element): (&wgpu::Buffer, u32),
        (target, sums): (&Surfaces, &wgpu::Buffer),
        list: &PixelList,
    ) -> Result<(), RenderError> {
        let pass = self.0.get(variant)?;
        let own = [Binding::buffer("camera", cameras), Binding::buffer("sums", sums)];
        let bound = pass.bind(0, own.into_iter().chain(target.bindings()).chain(list.bindings()))?;
        pass.dispatch_each(frame, &[&bound], element..element + 1, target.invocations(variant.step_px));
        Ok(())
    }
}
