//! Tables in textures, four words a texel: on the software device one such load costs a tenth of four loads from a
//! storage buffer, and it can be larger.

use gpu::{Gpu, GpuError};
use wgpu::{TextureFormat, TextureUsages};

/// Columns; `texel_at` in the shaders.
const WIDTH: u32 = 4096;

/// A table whose element n is at column n mod 4096 of row n / 4096.
pub(crate) struct DataTexture {
    texture: wgpu::Texture,
    pub view: wgpu::TextureView,
    what: &'static str,
}

impl DataTexture {
    /// Elements of `T`, which is one texel of `format`.
    ///
    /// # Errors
    /// When the device allows no texture of so many rows.
    pub fn with<T: bytemuck::NoUninit>(
        gpu: &Gpu,
        what: &'static str,
        format: TextureFormat,
        elements: &[T],
    ) -> Result<Self, GpuError> {
        let bytes_a_texel = format.block_copy_size(None).expect("a format of one aspect") as usize;
        let count = size_of_val(elements) / bytes_a_texel;
        let height = count.div_ceil(WIDTH as usize).max(1);
        let limit = u64::from(gpu.device.limits().max_texture_dimension_2d);
        if height as u64 > limit {
            let row = u64::from(WIDTH);
            return Err(GpuError::Limit { what: format!("{what} (texels)"), needed: count as u64, limit: limit * row });
        }
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(what),
            size: wgpu::Extent3d { width: WIDTH, height: height as u32, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let made = Self { texture, view, what };
        made.write(gpu, elements);
        Ok(made)
    }

    /// Writes elements from the first on; no more than there were at first.
    pub fn write<T: bytemuck::NoUninit>(&self, gpu: &Gpu, elements: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(elements);
        let row = (WIDTH * self.texture.format().block_copy_size(None).expect("a format of one aspect")) as usize;
        let whole = bytes.len() / row;
        self.write_rows(gpu, 0, whole as u32, &bytes[..whole * row]);
        if whole * row < bytes.len() {
            let mut last = bytes[whole * row..].to_vec();
            last.resize(row, 0);
            self.write_rows(gpu, whole as u32, 1, &last);
        }
        tracing::trace!(what = self.what, bytes = bytes.len(), "table written");
    }

    fn write_rows(&self, gpu: &Gpu, first: u32, count: u32, bytes: &[u8]) {
        if count == 0 {
            return;
        }
        let destination = wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x: 0, y: first, z: 0 },
            ..self.texture.as_image_copy()
        };
        let bytes_per_row = Some(bytes.len() as u32 / count);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        let size = wgpu::Extent3d { width: WIDTH, height: count, depth_or_array_layers: 1 };
        gpu.queue.write_texture(destination, bytes, layout, size);
    }
}
