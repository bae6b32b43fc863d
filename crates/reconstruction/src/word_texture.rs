//! Words in textures: a load from a buffer brings a shader one word, a texel up to four, and on the software device
//! for less (docs/methods/specular.md).

use bytemuck::NoUninit;
use gpu::{Gpu, GpuError};
use wgpu::TextureFormat;

/// Texels in a row; the n-th lies in column `n % WIDTH`, row `n / WIDTH`.
pub(crate) const WIDTH: u32 = 4096;

/// What one load brings.
pub(crate) trait Texel: NoUninit + bytemuck::Zeroable {
    const FORMAT: TextureFormat;
}

impl Texel for [u32; 2] {
    const FORMAT: TextureFormat = TextureFormat::Rg32Uint;
}

impl Texel for [u32; 4] {
    const FORMAT: TextureFormat = TextureFormat::Rgba32Uint;
}

/// Checks that the device has a texture of so many texels.
///
/// # Errors
/// Names the texture, its rows and the limit.
pub(crate) fn check(gpu: &Gpu, label: &str, texels: usize) -> Result<(), GpuError> {
    let (needed, limit) = (rows(texels) as u64, u64::from(gpu.device.limits().max_texture_dimension_2d));
    if needed > limit {
        return Err(GpuError::Limit { what: format!("{label} (rows of {WIDTH})"), needed, limit });
    }
    Ok(())
}

/// An empty list of texels that grows to a whole texture without being moved.
pub(crate) fn room<T: Texel>(texels: usize) -> Vec<T> {
    Vec::with_capacity(rows(texels) * WIDTH as usize)
}

/// Puts texels on the device.
///
/// # Errors
/// When the device has no texture so large.
pub(crate) fn upload<T: Texel>(gpu: &Gpu, label: &str, mut texels: Vec<T>) -> Result<wgpu::TextureView, GpuError> {
    check(gpu, label, texels.len())?;
    let rows = rows(texels.len());
    texels.resize(rows * WIDTH as usize, T::zeroed());
    let texture = texture(gpu, label, T::FORMAT, rows as u32);
    let bytes_per_row = Some(WIDTH * size_of::<T>() as u32);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
    gpu.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&texels), layout, texture.size());
    Ok(texture.create_view(&wgpu::TextureViewDescriptor::default()))
}

fn rows(texels: usize) -> usize {
    texels.div_ceil(WIDTH as usize).max(1)
}

fn texture(gpu: &Gpu, label: &str, format: TextureFormat, rows: u32) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: WIDTH, height: rows, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}
