//! The textures that one camera is drawn into, and the way from there to host memory.

use glam::UVec2;
use gpu::{BufferPool, Frame, FrameResult, Gpu, GpuError, Readback};

/// Copies from textures to buffers need rows of a multiple of this.
const ROW_ALIGNMENT: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;

/// A texture that is drawn into and copied out.
pub(crate) struct Target {
    texture: wgpu::Texture,
    pub view: wgpu::TextureView,
    bytes_a_texel: u32,
    size_px: UVec2,
}

/// A copied target in host memory, its rows still padded.
#[derive(Clone, Copy)]
pub(crate) struct HostPlane {
    readback: Readback,
    size_px: UVec2,
    bytes_a_texel: u32,
}

impl Target {
    pub fn new(gpu: &Gpu, size_px: UVec2, format: wgpu::TextureFormat) -> Self {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("target"),
            size: extent(size_px),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let bytes_a_texel = if format == wgpu::TextureFormat::Rg32Uint { 8 } else { 4 };
        Self { texture, view, bytes_a_texel, size_px }
    }

    /// Records the copy to host memory.
    pub fn copy_out(&self, frame: &mut Frame<'_>, pool: &BufferPool) -> HostPlane {
        let row_bytes = padded_row_bytes(self.size_px.x, self.bytes_a_texel);
        let host = pool.lend_host("target read-back", u64::from(row_bytes) * u64::from(self.size_px.y));
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row_bytes), rows_per_image: None };
        let destination = wgpu::TexelCopyBufferInfo { buffer: &host, layout };
        frame.encoder.copy_texture_to_buffer(self.texture.as_image_copy(), destination, extent(self.size_px));
        HostPlane { readback: frame.read_host(host), size_px: self.size_px, bytes_a_texel: self.bytes_a_texel }
    }
}

impl HostPlane {
    /// The plane without row padding, each element made by `convert` from an element of the target.
    pub fn collect<T: bytemuck::AnyBitPattern, U>(
        &self,
        result: &FrameResult,
        convert: impl Fn(T) -> U,
    ) -> Result<Vec<U>, GpuError> {
        let (row, padded) = (
            self.size_px.x as usize,
            (padded_row_bytes(self.size_px.x, self.bytes_a_texel) / self.bytes_a_texel) as usize,
        );
        result.with(self.readback, |texels: &[T]| {
            let rows = texels.chunks(padded).take(self.size_px.y as usize);
            rows.flat_map(|texels| texels[..row].iter().copied().map(&convert)).collect()
        })
    }

    /// RGB bytes of an RGBA target.
    pub fn collect_rgb(&self, result: &FrameResult) -> Result<Vec<u8>, GpuError> {
        let texels = self.collect(result, |rgba: [u8; 4]| [rgba[0], rgba[1], rgba[2]])?;
        Ok(texels.into_flattened())
    }
}

fn padded_row_bytes(width_px: u32, bytes_a_texel: u32) -> u32 {
    (width_px * bytes_a_texel).next_multiple_of(ROW_ALIGNMENT)
}

fn extent(size_px: UVec2) -> wgpu::Extent3d {
    wgpu::Extent3d { width: size_px.x, height: size_px.y, depth_or_array_layers: 1 }
}
