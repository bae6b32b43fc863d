//! Light of lamps and the environment, summed over rays.

use std::sync::Arc;

use gpu::{BufferPool, Frame, Gpu, PooledBuffer};
use wgpu::{BindingResource, BufferUsages};

use crate::{
    RenderError,
    binding::{bind_group, texture, window},
    form::{ComputePipelines, Domain, Form, GRID_PX, Pass},
    pixel_camera::{PIXEL_CAMERA_BYTES, PIXEL_CAMERA_STRIDE},
    rays::Traced,
    surfaces::Surfaces,
};

/// What is lit.
#[derive(Clone, Copy)]
pub(crate) struct IlluminateWork<'a> {
    /// Of the pass; its domain is set here.
    pub form: Form,
    /// Needed where the form traces rays.
    pub traced: Option<&'a Traced>,
    pub illumination: &'a wgpu::Buffer,
    /// One uniform of all cameras for each part of the rays.
    pub cameras: &'a [wgpu::Buffer],
    pub sums: &'a wgpu::Buffer,
    /// Whether pixels that lie between others may take their light.
    pub adaptive: bool,
}

/// Pixels that a pass leaves to the next: their places, and the arguments of an indirect dispatch.
struct List {
    pixels: PooledBuffer,
    arguments: wgpu::Buffer,
}

pub(crate) struct Illuminator<'a> {
    pub gpu: &'a Arc<Gpu>,
    pub pool: &'a BufferPool,
    pub pipelines: &'a ComputePipelines,
}

impl Illuminator<'_> {
    /// Records the passes of all cameras. What is returned must live until the frame is done.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        work: IlluminateWork<'_>,
        surfaces: &[Surfaces],
    ) -> Result<Vec<PooledBuffer>, RenderError> {
        if !work.adaptive {
            self.light(frame, work, Domain::All, surfaces, None)?;
            return Ok(Vec::new());
        }
        self.light(frame, work, Domain::Grid, surfaces, None)?;
        let mut lent = Vec::new();
        let mut step_px = GRID_PX / 2;
        while step_px > 0 {
            for (number, target) in (0..).zip(surfaces) {
                let list = self.interpolate(frame, work, (number, target), step_px)?;
                self.light(frame, work, Domain::List, std::slice::from_ref(target), Some((number, &list)))?;
                lent.push(list.pixels);
            }
            step_px /= 2;
        }
        Ok(lent)
    }

    /// One dispatch a camera and part of the rays; or, with a list, of the one camera that it is of.
    fn light(
        &self,
        frame: &mut Frame<'_>,
        work: IlluminateWork<'_>,
        domain: Domain,
        surfaces: &[Surfaces],
        list: Option<(u32, &List)>,
    ) -> Result<(), RenderError> {
        for (part, cameras) in work.cameras.iter().enumerate() {
            let form = Form { domain, continued: work.form.continued || part > 0, ..work.form };
            self.light_part(frame, IlluminateWork { form, ..work }, cameras, surfaces, list)?;
        }
        Ok(())
    }

    fn light_part(
        &self,
        frame: &mut Frame<'_>,
        work: IlluminateWork<'_>,
        cameras: &wgpu::Buffer,
        surfaces: &[Surfaces],
        list: Option<(u32, &List)>,
    ) -> Result<(), RenderError> {
        let domain = work.form.domain;
        let pipeline = self.pipelines.get(work.form)?;
        let rays = work
            .traced
            .map(|traced| bind_group(self.gpu, &pipeline.get_bind_group_layout(1), traced.views().map(texture)));
        let first = list.map_or(0, |(number, _)| number);
        for (number, target) in (first..).zip(surfaces) {
            let mut resources = self.resources(work, cameras, target);
            resources.insert(1, work.illumination.as_entire_binding());
            resources.extend(list.iter().flat_map(|(_, list)| list.resources()));
            let own = bind_group(self.gpu, &pipeline.get_bind_group_layout(0), resources);
            let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &own, &[number * PIXEL_CAMERA_STRIDE]);
            if let Some(rays) = &rays {
                pass.set_bind_group(1, rays, &[]);
            }
            match list {
                Some((_, list)) => pass.dispatch_workgroups_indirect(&list.arguments, 0),
                None => {
                    let apart = if domain == Domain::Grid { GRID_PX } else { 1 };
                    let groups = target.size_px().map(|side| side.div_ceil(apart).div_ceil(8));
                    pass.dispatch_workgroups(groups.x, groups.y, 1);
                }
            }
        }
        Ok(())
    }

    /// Fills in pixels `step_px` apart from those twice as far apart, and lists the others.
    fn interpolate(
        &self,
        frame: &mut Frame<'_>,
        work: IlluminateWork<'_>,
        (number, target): (u32, &Surfaces),
        step_px: u32,
    ) -> Result<List, RenderError> {
        let Form { by_rays, visibility, light_count, .. } = work.form;
        let form = Form { pass: Pass::Interpolate, by_rays, visibility, light_count, step_px, ..Form::default() };
        let pipeline = self.pipelines.get(form)?;
        let list = self.list(target);
        // How many rays the sums hold is the same for all parts.
        let mut resources = self.resources(work, &work.cameras[0], target);
        resources.extend(list.resources());
        let own = bind_group(self.gpu, &pipeline.get_bind_group_layout(0), resources);
        let groups = target.size_px().map(|side| side.div_ceil(step_px).div_ceil(8));
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &own, &[number * PIXEL_CAMERA_STRIDE]);
        pass.dispatch_workgroups(groups.x, groups.y, 1);
        drop(pass);
        Ok(list)
    }

    fn resources<'r>(
        &self,
        work: IlluminateWork<'r>,
        cameras: &'r wgpu::Buffer,
        target: &'r Surfaces,
    ) -> Vec<BindingResource<'r>> {
        vec![
            window(cameras, PIXEL_CAMERA_BYTES),
            texture(&target.surface),
            texture(&target.depth),
            work.sums.as_entire_binding(),
        ]
    }

    fn list(&self, target: &Surfaces) -> List {
        let bytes = 4 * u64::from(target.size_px().element_product());
        List {
            pixels: self.pool.lend_storage("pixels to be lit", bytes),
            // Workgroups along x, y and z, and the list's length.
            arguments: self.gpu.buffer_with("list", &[0u32, 1, 1, 0], BufferUsages::STORAGE | BufferUsages::INDIRECT),
        }
    }
}

impl List {
    fn resources(&self) -> [BindingResource<'_>; 2] {
        [self.pixels.as_entire_binding(), self.arguments.as_entire_binding()]
    }
}
