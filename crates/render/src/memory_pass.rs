//! How fast a device reads what rays read: tables in textures, every texel once, with nothing done but to add.
//! Rays that met no cache and waited for nothing else could go no faster.

use gpu::{BufferPool, Frame, Gpu, PooledBuffer};

use crate::{
    RenderError,
    binding::{bind_group, texture},
};

/// As in `memory_pass.wgsl`.
const WORKGROUP: u32 = 64;
const TEXELS_A_THREAD: u32 = 16;
const BYTES_A_TEXEL: u64 = 16;

/// What one pass over tables took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemoryPass {
    /// Read, once each.
    pub bytes: u64,
    /// On the device.
    pub device_s: f64,
    /// Of all their words, modulo 2³²: that they were read.
    pub sum: u32,
}

/// A table, and where its threads leave their sums.
struct Table {
    bound: wgpu::BindGroup,
    sums: PooledBuffer,
    workgroups: [u32; 3],
}

/// Reads tables whose rows are multiples of 1,024 texels of four words. The first pass, which builds the pipeline,
/// gives the sum; the second is timed.
pub(crate) fn read(gpu: &Gpu, pool: &BufferPool, views: &[&wgpu::TextureView]) -> Result<MemoryPass, RenderError> {
    let pipeline = gpu.compute_pipeline("memory pass", include_str!("memory_pass.wgsl"), None);
    let tables: Vec<Table> = views.iter().map(|view| Table::of(gpu, pool, &pipeline, view)).collect();
    let sum = sum(pool, recorded(gpu, &pipeline, &tables), &tables)?;
    let device_s = recorded(gpu, &pipeline, &tables).submit().wait()?.device_s;
    let texels: u64 = tables.iter().map(|table| table.threads() * u64::from(TEXELS_A_THREAD)).sum();
    Ok(MemoryPass { bytes: texels * BYTES_A_TEXEL, device_s, sum })
}

impl Table {
    fn of(gpu: &Gpu, pool: &BufferPool, pipeline: &wgpu::ComputePipeline, view: &wgpu::TextureView) -> Self {
        let size = view.texture().size();
        let workgroups = [size.width / (WORKGROUP * TEXELS_A_THREAD), size.height, 1];
        let sums = pool.lend_storage("sums of a table", 4 * threads(workgroups));
        let resources = [texture(view), sums.as_entire_binding()];
        Self { bound: bind_group(gpu, &pipeline.get_bind_group_layout(0), resources), sums, workgroups }
    }

    fn threads(&self) -> u64 {
        threads(self.workgroups)
    }
}

fn threads([columns, rows, _]: [u32; 3]) -> u64 {
    u64::from(columns * WORKGROUP) * u64::from(rows)
}

fn recorded<'g>(gpu: &'g Gpu, pipeline: &wgpu::ComputePipeline, tables: &[Table]) -> Frame<'g> {
    let mut frame = Frame::begin(gpu, "memory pass");
    tables.iter().for_each(|table| frame.compute("memory pass", pipeline, &table.bound, table.workgroups));
    frame
}

fn sum(pool: &BufferPool, mut frame: Frame<'_>, tables: &[Table]) -> Result<u32, RenderError> {
    let read = |table: &Table| {
        let bytes = 4 * table.threads();
        (frame.read_back(&table.sums, 0..bytes, pool.lend_host("sums of a table", bytes)), table.threads() as usize)
    };
    let reads: Vec<_> = tables.iter().map(read).collect();
    let result = frame.submit().wait()?;
    reads.into_iter().try_fold(0u32, |sum, (read, threads)| {
        let of_table = result.with(read, |words: &[u32]| wrapping_sum(&words[..threads]))?;
        Ok(sum.wrapping_add(of_table))
    })
}

fn wrapping_sum(words: &[u32]) -> u32 {
    words.iter().fold(0, |sum, word| sum.wrapping_add(*word))
}

#[cfg(test)]
mod tests {
    use gpu::DevicePreference;

    use super::*;
    use crate::data_texture::DataTexture;

    #[test]
    fn every_texel_is_read_once() {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let words = |count: u32| (0..count).map(|i| i.wrapping_mul(0x9e37_79b9)).collect::<Vec<u32>>();
        // A whole number of rows, and one that ends within a row, which is padded with zeros.
        let tables = [words(4 * 4096 * 3), words(4 * 4096 + 20)];
        let textures = tables.each_ref().map(|table| {
            let texels = table.as_chunks::<4>().0;
            DataTexture::with(&gpu, "a table", wgpu::TextureFormat::Rgba32Uint, texels).expect("a small table")
        });
        let pass = read(&gpu, &BufferPool::new(&gpu), &textures.each_ref().map(|t| &t.view)).expect("a pass");
        let expected = wrapping_sum(&tables.concat());
        assert_eq!((pass.sum, pass.bytes), (expected, 16 * 4096 * (3 + 2)));
        assert!(pass.device_s > 0.0);
    }
}
