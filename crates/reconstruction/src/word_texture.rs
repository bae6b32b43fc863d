//! Words in textures: a load from a buffer brings a shader one word, a texel up to four, and on the software device
//! for less (docs/methods/specular.md).

use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::NoUninit;
use gpu::{Frame, Gpu, GpuError, Lent, Pool};
use wgpu::TextureFormat;
use wgpu::util::StagingBelt;

/// Texels in a row; the n-th lies in column `n % WIDTH`, row `n / WIDTH`.
pub(crate) const WIDTH: u32 = 4096;

/// Textures that are kept for the next set: as many as a set has at the most.
const MOST_FREE: usize = 5;
/// Larger textures are filled through memory that is not kept: there is much of it, and a device may have no buffer so large.
const MOST_KEPT_BYTES: usize = 64 << 20;
/// Of rows within a chunk.
const ROW_ALIGNMENT: wgpu::BufferSize = wgpu::BufferSize::new(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as u64).unwrap();

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

/// An empty list of texels that grows to a whole texture without being moved.
pub(crate) fn room<T: Texel>(texels: usize) -> Vec<T> {
    Vec::with_capacity(rows(texels) * WIDTH as usize)
}

/// Its format and rows.
type Shape = (TextureFormat, u32);
/// A texture on loan.
pub(crate) type WordTexture = Lent<Shape, wgpu::TextureView>;

/// Textures that come back when their sets are dropped, and the memory that they are filled through: new memory costs a
/// software device most of the time that loading a set takes.
pub(crate) struct WordTextures {
    pub(crate) gpu: Arc<Gpu>,
    textures: Pool<Shape, wgpu::TextureView>,
    staging: Mutex<Staging>,
}

/// Chunks of one size, that of the largest texture so far that was filled through it: as many as are under way at once.
struct Staging {
    belt: StagingBelt,
    chunk_bytes: u64,
}

impl WordTextures {
    /// None yet.
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Self {
        let staging = Staging { belt: StagingBelt::new(gpu.device.clone(), 0), chunk_bytes: 0 };
        Self { gpu: gpu.clone(), textures: Pool::keeping(MOST_FREE), staging: Mutex::new(staging) }
    }

    /// Checks that the device has a texture of so many texels.
    ///
    /// # Errors
    /// Names the texture, its rows and the limit.
    pub(crate) fn check(&self, label: &str, texels: usize) -> Result<(), GpuError> {
        let (needed, limit) = (rows(texels) as u64, u64::from(self.gpu.device.limits().max_texture_dimension_2d));
        if needed > limit {
            return Err(GpuError::Limit { what: format!("{label} (rows of {WIDTH})"), needed, limit });
        }
        Ok(())
    }

    /// Puts texels on the device.
    ///
    /// # Errors
    /// When the device has no texture so large, or is lost.
    pub(crate) fn upload<T: Texel>(&self, label: &str, mut texels: Vec<T>) -> Result<WordTexture, GpuError> {
        self.check(label, texels.len())?;
        let rows = rows(texels.len());
        texels.resize(rows * WIDTH as usize, T::zeroed());
        let lent = self.textures.lend((T::FORMAT, rows as u32), |&shape| texture(&self.gpu, label, shape));
        let (texture, bytes): (_, &[u8]) = (lent.texture(), bytemuck::cast_slice(&texels));
        if bytes.len() <= MOST_KEPT_BYTES {
            self.fill(texture, bytes)?;
        } else {
            let layout = row_by_row(bytes.len() / rows, 0);
            self.gpu.queue.write_texture(texture.as_image_copy(), bytes, layout, texture.size());
        }
        Ok(lent)
    }

    /// Who reads the texture's last contents was submitted before.
    fn fill(&self, texture: &wgpu::Texture, bytes: &[u8]) -> Result<(), GpuError> {
        let mut staging = self.staging.lock().unwrap_or_else(PoisonError::into_inner);
        let chunk = staging.chunk(&self.gpu, bytes.len() as u64);
        let lost = |error: wgpu::MapRangeError| GpuError::Lost(error.to_string());
        chunk.get_mapped_range_mut().map_err(lost)?.copy_from_slice(bytes);
        let layout = row_by_row(bytes.len() / texture.height() as usize, chunk.offset());
        let from = wgpu::TexelCopyBufferInfo { buffer: chunk.buffer(), layout };
        let mut frame = Frame::begin(&self.gpu, "fill a texture");
        frame.encoder.copy_buffer_to_texture(from, texture.as_image_copy(), texture.size());
        staging.belt.finish();
        // Nobody waits for it but the work on views that comes after it.
        let _ = frame.submit();
        staging.belt.recall();
        Ok(())
    }
}

impl Staging {
    fn chunk(&mut self, gpu: &Gpu, bytes: u64) -> wgpu::BufferSlice<'_> {
        if bytes > self.chunk_bytes {
            *self = Self { belt: StagingBelt::new(gpu.device.clone(), bytes), chunk_bytes: bytes };
        }
        self.belt.allocate(wgpu::BufferSize::new(bytes).unwrap_or(wgpu::BufferSize::MIN), ROW_ALIGNMENT)
    }
}

fn row_by_row(row_bytes: usize, offset: u64) -> wgpu::TexelCopyBufferLayout {
    wgpu::TexelCopyBufferLayout { offset, bytes_per_row: Some(row_bytes as u32), rows_per_image: None }
}

fn rows(texels: usize) -> usize {
    texels.div_ceil(WIDTH as usize).max(1)
}

fn texture(gpu: &Gpu, label: &str, (format, rows): Shape) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: WIDTH, height: rows, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

#[cfg(test)]
mod tests {
    use gpu::DevicePreference;

    use super::*;

    #[test]
    fn what_a_set_leaves_the_next_of_its_shape_takes() {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let textures = WordTextures::new(&gpu);
        let upload = |texels: usize| textures.upload("words", vec![[7_u32; 2]; texels]).expect("a texture");
        let (first, second) = (upload(5000), upload(5000));
        assert!(first.texture() != second.texture(), "both are in use");
        let left = first.texture().clone();
        drop(first);
        let other = upload(9000);
        assert!(*other.texture() != left, "three rows do not go into two");
        assert!(*upload(4097).texture() == left);
        drop(second);
    }
}
