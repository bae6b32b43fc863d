//! Surfaces by one ray a pixel.

use std::sync::Arc;

use depth_image::PinholeCamera;
use gpu::{Frame, Gpu};

use super::Traced;
use crate::{
    RenderError,
    binding::{bind_group, texture, window},
    form::{ComputePipelines, Form, Pass, Shading},
    known::{Known, LeaveOut},
    pixel_camera::{PIXEL_CAMERA_BYTES, PIXEL_CAMERA_STRIDE},
    surfaces::Surfaces,
};

/// What is looked for.
#[derive(Clone, Copy)]
pub(crate) struct PrimaryWork<'a> {
    pub traced: &'a Traced,
    pub shading: Shading,
    pub surface_id: bool,
    /// The place of the first of the surfaces' cameras.
    pub first: u32,
    /// Receives node visits and triangle tests of each pixel, of a single camera.
    pub counts: Option<&'a wgpu::Buffer>,
    /// What is not shown; of a single camera.
    pub leave_out: Option<(LeaveOut, &'a Known, &'a PinholeCamera)>,
    /// The first camera's place among the known ones.
    pub earlier: usize,
}

/// Records one dispatch a camera into its own textures.
pub(crate) fn record(
    gpu: &Arc<Gpu>,
    pipelines: &ComputePipelines,
    frame: &mut Frame<'_>,
    work: PrimaryWork<'_>,
    cameras: &wgpu::Buffer,
    surfaces: &[Surfaces],
) -> Result<(), RenderError> {
    let form = Form {
        pass: Pass::Primary,
        shading: work.shading,
        surface_id: work.surface_id,
        count_visits: work.counts.is_some(),
        leave_out: work.leave_out.map(|(test, ..)| test),
        earlier: work.leave_out.map_or(0, |_| work.earlier),
        ..Form::traced(work.traced)
    };
    let pipeline = pipelines.get(form)?;
    let rays = bind_group(gpu, &pipeline.get_bind_group_layout(1), work.traced.views().map(texture));
    let known = work
        .leave_out
        .map(|(_, known, camera)| known.bind(gpu, &pipeline.get_bind_group_layout(2), camera, work.earlier));
    for (number, target) in (work.first..).zip(surfaces) {
        let mut resources = vec![window(cameras, PIXEL_CAMERA_BYTES), texture(&target.surface), texture(&target.depth)];
        resources.extend(target.ids().filter(|_| work.surface_id).map(texture));
        resources.extend(known.as_ref().map(|_| texture(target.front())));
        resources.extend(work.counts.map(wgpu::Buffer::as_entire_binding));
        let own = bind_group(gpu, &pipeline.get_bind_group_layout(0), resources);
        let size = target.size_px();
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &own, &[number * PIXEL_CAMERA_STRIDE]);
        pass.set_bind_group(1, &rays, &[]);
        if let Some(known) = &known {
            pass.set_bind_group(2, known, &[]);
        }
        pass.dispatch_workgroups(size.x.div_ceil(8), size.y.div_ceil(8), 1);
    }
    Ok(())
}
