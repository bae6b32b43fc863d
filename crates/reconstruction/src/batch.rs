//! Views of one size that are reconstructed together, and their planes on the device.

use depth_image::PinholeCamera;
use glam::{UVec2, Vec3};
use gpu::{GpuError, PooledBuffer, uniform_elements};
use wgpu::BufferUsages;

use crate::{
    device::Device,
    sample_set::SampleSet,
    view_work::{GpuSampleCamera, GpuViewCamera, GpuViewWork, tiles_of},
};

/// Bounds the memory of a batch: 12 bytes a pixel on the device, up to as much again on the host.
const PIXELS_A_BATCH: usize = 1 << 20;
const MAX_VIEWS_A_BATCH: usize = 256;

/// Views of one size, and what they take on the device.
pub(crate) struct Batch {
    pub cameras: Vec<PinholeCamera>,
    pub size_px: UVec2,
    pub tiles: UVec2,
    /// The bytes of one plane of all views.
    pub plane_bytes: u64,
    /// A `ViewWork` for each view.
    pub works: wgpu::Buffer,
    pub tile_start_m: PooledBuffer,
    pub srgb8: PooledBuffer,
    pub inverse_depth_per_m: PooledBuffer,
    pub provenance: PooledBuffer,
    /// Fetches of each pixel, where they are counted.
    pub fetches: Option<PooledBuffer>,
}

impl Batch {
    /// Lends the planes.
    ///
    /// # Errors
    /// Views beyond the device's limits.
    pub fn lend(
        device: &Device,
        set: &SampleSet,
        cameras: &[PinholeCamera],
        count_fetches: bool,
    ) -> Result<Self, GpuError> {
        let size_px = cameras[0].size_px;
        let tiles = tiles_of(size_px);
        let plane_bytes = 4 * (cameras[0].pixel_count() * cameras.len()) as u64;
        device.gpu.check_storage_bytes("a batch of views (bytes)", plane_bytes)?;
        let works = uniform_elements((0..).zip(cameras).map(|(number, camera)| view_work(set, camera, number)));
        let tile_bytes = 4 * u64::from(tiles.element_product()) * cameras.len() as u64;
        let plane = |label| device.buffers.lend_storage(label, plane_bytes);
        Ok(Self {
            cameras: cameras.to_vec(),
            size_px,
            tiles,
            plane_bytes,
            works: device.gpu.buffer_with("views", &works, BufferUsages::UNIFORM),
            tile_start_m: device.buffers.lend_storage("tile starts", tile_bytes),
            srgb8: plane("srgb8"),
            inverse_depth_per_m: plane("inverse depth"),
            provenance: plane("provenance"),
            fetches: count_fetches.then(|| plane("fetches")),
        })
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
    let mut bytes = bytemuck::bytes_of(&work).to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(&nearest_first));
    bytes
}
