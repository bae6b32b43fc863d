//! Tables in textures: a load from a buffer brings a shader one word, a texel up to four, and on the software device for a
//! tenth of the time (docs/methods/specular.md). A texture may be larger than a storage buffer, too.

use std::{ops::Deref, sync::Arc};

use bytemuck::NoUninit;
use parking_lot::Mutex;
use wgpu::{TextureFormat, TextureUsages, util::StagingBelt};

use crate::pool::{Lent, Pool};
use crate::sharing::{Turn, WorkKind};
use crate::{device::Gpu, error::GpuError, frame::Frame};

/// The n-th texel lies in column `n % TABLE_WIDTH` of row `n / TABLE_WIDTH` (`texel_at` in table.wgsl).
pub const TABLE_WIDTH: u32 = 1 << TABLE_WIDTH_LOG2;
pub(crate) const TABLE_WIDTH_LOG2: u32 = 12;

/// Larger tables are filled through memory that is not kept: there is much of it, and a device may have no buffer of that
/// size.
const MOST_STAGED_BYTES: usize = 64 << 20;
/// The most bytes of free textures: about a sample set's.
const MOST_FREE_BYTES: u64 = 64 << 20;
/// The alignment of rows within a chunk.
const ROW_ALIGNMENT: wgpu::BufferSize = wgpu::BufferSize::new(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as u64).unwrap();

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Shape {
    format: TextureFormat,
    rows: u32,
}

/// A table on the device. Texels after its elements are 0.
pub struct Table(Lent<Shape, wgpu::TextureView>);

/// Lends tables, and keeps the memory that they are filled through: new memory costs a software device most of the time
/// that filling takes.
pub struct TablePool {
    /// The device of its tables.
    pub gpu: Arc<Gpu>,
    textures: Pool<Shape, wgpu::TextureView>,
    staging: Mutex<Staging>,
}

/// Chunks of one size, that of the largest table so far that was filled through it: as many as are under way at once.
struct Staging {
    belt: StagingBelt,
    chunk_bytes: u64,
}

impl Table {
    /// A table that no pool keeps. The elements take whole texels of `format`.
    ///
    /// # Errors
    /// When the device has no texture of that size.
    pub fn new<T: NoUninit>(gpu: &Gpu, label: &str, format: TextureFormat, elements: &[T]) -> Result<Self, GpuError> {
        let shape = Shape::of(gpu, label, format, elements)?;
        let table = Self(Lent::unpooled(shape, texture(gpu, label, shape)));
        table.write(gpu, bytemuck::cast_slice(elements));
        Ok(table)
    }

    fn write(&self, gpu: &Gpu, bytes: &[u8]) {
        let row_bytes = self.0.kind().row_bytes();
        let (whole, part) = bytes.split_at(bytes.len() / row_bytes * row_bytes);
        let mut last = part.to_vec();
        last.resize(part.len().next_multiple_of(row_bytes), 0);
        for (begin, rows) in [(0, whole), (whole.len(), &*last)].into_iter().filter(|(_, rows)| !rows.is_empty()) {
            let [first, height] = [begin, rows.len()].map(|bytes| (bytes / row_bytes) as u32);
            let origin = wgpu::Origin3d { x: 0, y: first, z: 0 };
            let destination = wgpu::TexelCopyTextureInfo { origin, ..self.texture().as_image_copy() };
            let size = wgpu::Extent3d { width: TABLE_WIDTH, height, depth_or_array_layers: 1 };
            gpu.queue.write_texture(destination, rows, row_by_row(row_bytes, 0), size);
        }
    }
}

impl Deref for Table {
    type Target = wgpu::TextureView;
    fn deref(&self) -> &wgpu::TextureView {
        &self.0
    }
}

impl TablePool {
    /// A pool that keeps textures for tables to come.
    #[must_use]
    pub fn new(gpu: &Arc<Gpu>) -> Self {
        let staging = Staging { belt: StagingBelt::new(gpu.device.clone(), 0), chunk_bytes: 0 };
        Self {
            gpu: gpu.clone(),
            textures: Pool::of_device(gpu, MOST_FREE_BYTES, Shape::bytes),
            staging: Mutex::new(staging),
        }
    }

    /// A table of elements, which take whole texels of `format`.
    ///
    /// # Errors
    /// When the device has no texture of that size, or is lost.
    pub fn upload<T: NoUninit>(
        &self,
        label: &str,
        format: TextureFormat,
        elements: &[T],
        turn: Turn,
    ) -> Result<Table, GpuError> {
        let shape = Shape::of(&self.gpu, label, format, elements)?;
        let table = Table(self.textures.lend(shape, |&shape| texture(&self.gpu, label, shape)));
        let bytes = bytemuck::cast_slice(elements);
        if bytes.len() <= MOST_STAGED_BYTES {
            self.fill(&table, bytes, turn)?;
        } else {
            table.write(&self.gpu, bytes);
        }
        Ok(table)
    }

    /// Work that reads the texture's last contents was submitted before.
    fn fill(&self, table: &Table, bytes: &[u8], turn: Turn) -> Result<(), GpuError> {
        let texture = table.texture();
        let row_bytes = table.0.kind().row_bytes();
        let work = (WorkKind::new(WorkKind::family(&"fill a table"), &row_bytes), bytes.len() as u64);
        // Before the staging memory: whoever holds that waits for nobody.
        let queue = &self.gpu.device_queue;
        let slot = queue.wait(turn, queue.predicted_s([&[work][..]].into_iter()));
        let mut staging = self.staging.lock();
        let chunk = staging.chunk(&self.gpu, row_bytes as u64 * u64::from(texture.height()));
        let mut mapped = chunk.get_mapped_range_mut().map_err(|error| GpuError::Lost(error.to_string()))?;
        mapped.slice(..bytes.len()).copy_from_slice(bytes);
        mapped.slice(bytes.len()..).fill(0);
        drop(mapped);
        let from = wgpu::TexelCopyBufferInfo { buffer: chunk.buffer(), layout: row_by_row(row_bytes, chunk.offset()) };
        let mut frame = Frame::begin(&self.gpu, "fill a table", turn);
        frame.encoder.copy_buffer_to_texture(from, texture.as_image_copy(), texture.size());
        frame.work.push(work);
        staging.belt.finish();
        let filled = frame.submit_in(Some(slot));
        staging.belt.recall();
        // Nobody waits for it but the work on views that comes after it, unless that is to be short.
        if queue.cuts() { filled?.wait().map(drop) } else { filled.map(drop) }
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

impl Gpu {
    /// Checks that the device can hold a table of this size, before its texels are gathered.
    ///
    /// # Errors
    /// Names the table, its texels and the limit.
    pub fn check_table(&self, label: &str, texels: usize) -> Result<(), GpuError> {
        GpuError::check_limit(&format!("{label} (texels)"), texels as u64, self.most_table_texels())
    }

    /// The texels of the largest table.
    #[must_use]
    pub fn most_table_texels(&self) -> u64 {
        u64::from(self.device.limits().max_texture_dimension_2d) * u64::from(TABLE_WIDTH)
    }
}

impl Shape {
    fn of<T: NoUninit>(gpu: &Gpu, label: &str, format: TextureFormat, elements: &[T]) -> Result<Self, GpuError> {
        let texels = size_of_val(elements) / texel_bytes(format);
        gpu.check_table(label, texels)?;
        Ok(Self { format, rows: texels.div_ceil(TABLE_WIDTH as usize).max(1) as u32 })
    }

    fn bytes(&self) -> u64 {
        self.row_bytes() as u64 * u64::from(self.rows)
    }

    fn row_bytes(&self) -> usize {
        TABLE_WIDTH as usize * texel_bytes(self.format)
    }
}

/// The bytes of a texture's texels, on all levels and layers.
#[must_use]
pub fn texture_bytes(texture: &wgpu::Texture) -> u64 {
    let size = texture.size();
    let texel = texture.format().block_copy_size(None).unwrap_or(4);
    let levels = (0..texture.mip_level_count()).map(|level| size.mip_level_size(level, texture.dimension()));
    let texels =
        levels.map(|level| u64::from(level.width) * u64::from(level.height) * u64::from(level.depth_or_array_layers));
    u64::from(texel) * texels.sum::<u64>()
}

fn texel_bytes(format: TextureFormat) -> usize {
    format.block_copy_size(None).expect("a format of one aspect") as usize
}

fn row_by_row(row_bytes: usize, offset: u64) -> wgpu::TexelCopyBufferLayout {
    wgpu::TexelCopyBufferLayout { offset, bytes_per_row: Some(row_bytes as u32), rows_per_image: None }
}

fn texture(gpu: &Gpu, label: &str, Shape { format, rows }: Shape) -> wgpu::TextureView {
    let usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
    gpu.texture(label, [TABLE_WIDTH, rows, 1], format, usage).create_view(&Default::default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::DevicePreference;

    #[test]
    fn a_dropped_tables_texture_is_lent_to_the_next_of_its_shape() {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let pool = TablePool::new(&gpu);
        let upload = |texels: usize| {
            pool.upload("words", TextureFormat::Rg32Uint, &vec![[7_u32; 2]; texels], Turn::default()).expect("a table")
        };
        let first = upload(5000);
        let second = upload(5000);
        assert!(first.texture() != second.texture(), "both are in use");
        let left = first.texture().clone();
        drop(first);
        let other = upload(9000);
        assert!(*other.texture() != left, "three rows do not go into two");
        assert!(*upload(4097).texture() == left);
        drop(second);
    }

    #[test]
    fn a_table_beyond_the_device_is_refused() {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let most = gpu.device.limits().max_texture_dimension_2d as usize * TABLE_WIDTH as usize;
        assert!(gpu.check_table("words", most).is_ok());
        assert!(matches!(gpu.check_table("words", most + 1), Err(GpuError::Limit { .. })));
    }
}
