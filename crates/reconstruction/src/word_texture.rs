//! Words in textures: a load from a buffer brings a shader one word, a texel up to four, and on the software device
//! for less (docs/methods/specular.md).

use std::collections::VecDeque;
use std::ops::Deref;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use bytemuck::NoUninit;
use gpu::{Frame, Gpu, GpuError};
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

type Shape = (TextureFormat, u32);
type Free = Mutex<VecDeque<(Shape, wgpu::Texture)>>;

/// Textures that come back when their sets are dropped, and the memory that they are filled through. New memory costs a
/// software device a page fault for every 4 KiB, which together took four times as long as all else that loading a set does.
pub(crate) struct WordTextures {
    gpu: Arc<Gpu>,
    free: Arc<Free>,
    staging: Mutex<Staging>,
}

/// Chunks of one size, that of the largest texture so far that was filled through it: as many as are under way at once.
struct Staging {
    belt: StagingBelt,
    chunk_bytes: u64,
}

/// A texture on loan.
pub(crate) struct WordTexture {
    view: wgpu::TextureView,
    shape: Shape,
    home: Weak<Free>,
}

impl WordTextures {
    /// None yet.
    pub(crate) fn new(gpu: &Arc<Gpu>) -> Self {
        let staging = Staging { belt: StagingBelt::new(gpu.device.clone(), 0), chunk_bytes: 0 };
        Self { gpu: gpu.clone(), free: Arc::default(), staging: Mutex::new(staging) }
    }

    /// Puts texels on the device.
    ///
    /// # Errors
    /// When the device has no texture so large, or is lost.
    pub(crate) fn upload<T: Texel>(&self, label: &str, mut texels: Vec<T>) -> Result<WordTexture, GpuError> {
        check(&self.gpu, label, texels.len())?;
        let rows = rows(texels.len());
        texels.resize(rows * WIDTH as usize, T::zeroed());
        let texture = self.lend(label, (T::FORMAT, rows as u32));
        let bytes: &[u8] = bytemuck::cast_slice(&texels);
        if bytes.len() <= MOST_KEPT_BYTES {
            self.fill(texture.view.texture(), bytes)?;
        } else {
            let (texture, layout) = (texture.view.texture(), row_by_row(bytes.len() / rows, 0));
            self.gpu.queue.write_texture(texture.as_image_copy(), bytes, layout, texture.size());
        }
        Ok(texture)
    }

    fn lend(&self, label: &str, shape: Shape) -> WordTexture {
        let mut free = locked(&self.free);
        let kept = free.iter().position(|(other, _)| *other == shape).and_then(|at| free.remove(at));
        let texture = kept.map_or_else(|| texture(&self.gpu, label, shape), |(_, texture)| texture);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        WordTexture { view, shape, home: Arc::downgrade(&self.free) }
    }

    /// Who reads the texture's last contents was submitted before.
    fn fill(&self, texture: &wgpu::Texture, bytes: &[u8]) -> Result<(), GpuError> {
        let mut staging = locked(&self.staging);
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

impl Deref for WordTexture {
    type Target = wgpu::TextureView;
    fn deref(&self) -> &wgpu::TextureView {
        &self.view
    }
}

impl Drop for WordTexture {
    fn drop(&mut self) {
        let Some(home) = self.home.upgrade() else { return };
        let mut free = locked(&home);
        free.push_back((self.shape, self.view.texture().clone()));
        while free.len() > MOST_FREE {
            free.pop_front();
        }
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn row_by_row(row_bytes: usize, offset: u64) -> wgpu::TexelCopyBufferLayout {
    wgpu::TexelCopyBufferLayout { offset, bytes_per_row: Some(row_bytes as u32), rows_per_image: None }
}

fn rows(texels: usize) -> usize {
    texels.div_ceil(WIDTH as usize).max(1)
}

fn texture(gpu: &Gpu, label: &str, (format, rows): Shape) -> wgpu::Texture {
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
        let many: Vec<_> = (0..2 * MOST_FREE).map(|_| upload(1)).collect();
        drop(many);
        assert_eq!(locked(&textures.free).len(), MOST_FREE);
        drop(textures);
        assert_eq!(second.texture().height(), 2, "a texture may outlive where it came from");
    }
}
