//! Views of one size that are reconstructed together, on their way into a frame.

use depth_image::PinholeCamera;
use glam::{UVec2, Vec3};
use gpu::{Binding, ComputePass, DispatchSize, Frame, PooledBuffer, uniform_elements};
use wgpu::BufferUsages;

use crate::view_work::{GpuSampleCamera, GpuViewCamera, GpuViewWork, SetVariant};
use crate::{device::Device, error::ReconstructionError, pixel_list::PixelList, sample_set::SampleSet};

/// Bounds the memory of a batch: 12 bytes a pixel on the device, up to as much again on the host.
const PIXELS_A_BATCH: usize = 1 << 20;
const MAX_VIEWS_A_BATCH: usize = 256;

/// A batch of views, recorded into one frame: what every pass is handed.
pub(crate) struct Recording<'r> {
    pub device: &'r Device,
    pub set: &'r SampleSet,
    pub frame: Frame<'r>,
    pub batch: Batch,
}

/// Views of one size, and what they take on the device.
pub(crate) struct Batch {
    pub cameras: Vec<PinholeCamera>,
    pub size_px: UVec2,
    /// The bytes of one plane of all views.
    pub plane_bytes: u64,
    /// A `ViewWork` for each view.
    pub works: wgpu::Buffer,
    /// For methods that follow rays.
    pub tile_start_m: Option<PooledBuffer>,
    pub srgb8: PooledBuffer,
    pub inverse_depth_per_m: PooledBuffer,
    pub provenance: PooledBuffer,
    /// Fetches of each pixel, where they are counted.
    pub fetches: Option<PooledBuffer>,
}

impl<'r> Recording<'r> {
    /// Lends the planes; fails for views beyond the device's limits.
    pub fn begin(
        device: &'r Device,
        set: &'r SampleSet,
        cameras: &[PinholeCamera],
        count_fetches: bool,
    ) -> Result<Self, ReconstructionError> {
        let plane_bytes = 4 * (cameras[0].pixel_count() * cameras.len()) as u64;
        device.gpu.check_storage_bytes("a batch of views (bytes)", plane_bytes)?;
        let works = uniform_elements((0..).zip(cameras).map(|(number, camera)| view_work(set, camera, number)));
        let plane = |label| device.buffers.lend_storage(label, plane_bytes);
        let batch = Batch {
            cameras: cameras.to_vec(),
            size_px: cameras[0].size_px,
            plane_bytes,
            works: device.gpu.buffer_with("views", &works, BufferUsages::UNIFORM),
            tile_start_m: None,
            srgb8: plane("srgb8"),
            inverse_depth_per_m: plane("inverse depth"),
            provenance: plane("provenance"),
            fetches: count_fetches.then(|| plane("fetches")),
        };
        let mut frame = Frame::begin(&device.gpu, "reconstruct");
        if let Some(fetches) = &batch.fetches {
            frame.encoder.clear_buffer(fetches, 0, None);
        }
        Ok(Self { device, set, frame, batch })
    }

    /// The switches of passes that find surfaces.
    pub fn variant(&self) -> SetVariant {
        SetVariant { count_fetches: self.batch.fetches.is_some(), ..self.set.variant() }
    }

    /// The resources of `view_work.wgsl`.
    pub fn view_bindings(&self) -> Vec<Binding<'_>> {
        vec![Binding::buffer("work", &self.batch.works), Binding::texture("nodes", &self.set.nodes)]
    }

    /// The resources of `view_work.wgsl` and `cell.wgsl`.
    pub fn cell_bindings(&self) -> Vec<Binding<'_>> {
        let mut bindings = self.view_bindings();
        bindings.push(Binding::texture("cell_codes", &self.set.cell_codes));
        bindings
    }

    /// One dispatch a view, over its listed pixels or over all.
    pub fn dispatch_pixels(&mut self, pass: &ComputePass, bound: &wgpu::BindGroup, listed: Option<&PixelList>) {
        let [across, down] = self.batch.size_px.to_array();
        let all = DispatchSize::Invocations([across, down, 1]);
        self.dispatch(pass, bound, listed.map_or(all, |listed| DispatchSize::Indirect(&listed.lists)));
    }

    /// One dispatch a view.
    pub fn dispatch(&mut self, pass: &ComputePass, bound: &wgpu::BindGroup, size: DispatchSize<'_>) {
        pass.dispatch_each(&mut self.frame, &[bound], 0..self.batch.cameras.len() as u32, size);
    }
}

/// Runs of views of one size, bounded in pixels.
pub(crate) fn batches(cameras: &[PinholeCamera]) -> impl Iterator<Item = &[PinholeCamera]> {
    cameras.chunk_by(|a, b| a.size_px == b.size_px).flat_map(|run| {
        let views = (PIXELS_A_BATCH / run[0].pixel_count()).clamp(1, MAX_VIEWS_A_BATCH);
        run.chunks(views)
    })
}

/// The `ViewWork` of the `number`-th view, its sample cameras sorted by distance.
fn view_work(set: &SampleSet, camera: &PinholeCamera, number: u32) -> Vec<u8> {
    let mut nearest_first = set.cameras.clone();
    nearest_first.sort_by(|a, b| {
        let distance = |c: &GpuSampleCamera| Vec3::from(c.eye_in_world).distance_squared(camera.eye_in_world);
        // Images that prove nothing everywhere are no use to march in.
        let uncertain = |c: &GpuSampleCamera| set.uncertain[c.mask.trailing_zeros() as usize];
        uncertain(a).cmp(&uncertain(b)).then(distance(a).total_cmp(&distance(b)))
    });
    let work = GpuViewWork { view: GpuViewCamera::of(camera, number), volume: set.volume };
    [bytemuck::bytes_of(&work), bytemuck::cast_slice(&nearest_first)].concat()
}
