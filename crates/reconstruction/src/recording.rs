//! A batch on its way into a frame: what every pass is handed.

use depth_image::PinholeCamera;
use gpu::{Binding, ComputePass, DispatchSize, Frame};

use crate::{batch::Batch, device::Device, error::ReconstructionError, pixel_list::PixelList, sample_set::SampleSet};

/// A batch of views, recorded into one frame.
pub(crate) struct Recording<'r> {
    pub device: &'r Device,
    pub set: &'r SampleSet,
    pub frame: Frame<'r>,
    pub batch: Batch,
}

impl<'r> Recording<'r> {
    pub fn begin(
        device: &'r Device,
        set: &'r SampleSet,
        cameras: &[PinholeCamera],
        count_fetches: bool,
    ) -> Result<Self, ReconstructionError> {
        let batch = Batch::lend(device, set, cameras, count_fetches)?;
        let mut frame = Frame::begin(&device.gpu, "reconstruct");
        if let Some(fetches) = &batch.fetches {
            frame.encoder.clear_buffer(fetches, 0, None);
        }
        Ok(Self { device, set, frame, batch })
    }

    /// The resources of `view_work.wgsl`.
    pub fn view_bindings(&self) -> [Binding<'_>; 2] {
        [Binding::buffer("work", &self.batch.works), Binding::texture("nodes", &self.set.nodes)]
    }

    /// The resources of `view_work.wgsl` and `cell.wgsl`.
    pub fn cell_bindings(&self) -> Vec<Binding<'_>> {
        let cells = Binding::texture("cell_codes", &self.set.cell_codes);
        self.view_bindings().into_iter().chain([cells]).collect()
    }

    pub fn lend_list(&self) -> PixelList {
        PixelList::lend(self.device, self.batch.cameras.len(), self.batch.plane_bytes)
    }

    /// One dispatch a view, over all of its pixels.
    pub fn dispatch_pixels(&mut self, pass: &ComputePass, bound: &wgpu::BindGroup) {
        let [across, down] = self.batch.size_px.to_array();
        self.dispatch(pass, bound, DispatchSize::Invocations([across, down, 1]));
    }

    /// One dispatch a view, over its listed pixels.
    pub fn dispatch_listed(&mut self, pass: &ComputePass, bound: &wgpu::BindGroup, listed: &PixelList) {
        self.dispatch(pass, bound, DispatchSize::Indirect(&listed.lists));
    }

    /// One dispatch a view.
    pub fn dispatch(&mut self, pass: &ComputePass, bound: &wgpu::BindGroup, size: DispatchSize<'_>) {
        pass.dispatch_each(&mut self.frame, &[bound], 0..self.batch.cameras.len() as u32, size);
    }
}
