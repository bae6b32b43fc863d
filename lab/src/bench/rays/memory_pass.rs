//! The speed at which a device reads the tables that rays read: every texel once, with nothing done but to add. It bounds the
//! speed of rays whose loads miss the cache.

use gpu::{
    Binding, BoundGroup, BufferPool, ComputePass, DispatchSize, Frame, Gpu, PooledBuffer, Shader, Templates,
    wgsl_constants,
};
use minijinja::context;

const WORKGROUP: u32 = 64;
const TEXELS_A_THREAD: u32 = 16;
const BYTES_A_TEXEL: u64 = 16;

/// One pass over tables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MemoryPass {
    /// Read, once each.
    pub(super) bytes: u64,
    /// On the device.
    pub(super) device_s: f64,
    /// The sum of all words, modulo 2³²: they were read.
    pub(super) sum: u32,
}

/// A table, and where its threads leave their sums.
struct Table {
    bound: BoundGroup,
    sums: PooledBuffer,
    threads: [u32; 2],
}

/// Reads tables whose rows are multiples of 1,024 texels of four words. The first pass, which builds the pipeline,
/// gives the sum; the second is timed.
pub(super) fn read(gpu: &Gpu, pool: &BufferPool, views: &[&wgpu::TextureView]) -> anyhow::Result<MemoryPass> {
    let templates = Templates::new(&[("memory_pass.wgsl", include_str!("memory_pass.wgsl"))])?;
    let wgsl = templates
        .with_constants(wgsl_constants![WORKGROUP, TEXELS_A_THREAD])
        .render("memory_pass.wgsl", context! {})?;
    let pass = ComputePass::new(gpu, Shader::new(gpu, "memory pass", &wgsl, &[])?);
    let tables = views.iter().map(|view| Table::of(pool, &pass, view)).collect::<anyhow::Result<Vec<_>>>()?;
    let sum = sum(pool, recorded(gpu, &pass, &tables), &tables)?;
    let device_s = recorded(gpu, &pass, &tables).submit()?.wait()?.device_s;
    let texels: u64 = tables.iter().map(|table| table.count() * u64::from(TEXELS_A_THREAD)).sum();
    Ok(MemoryPass { bytes: texels * BYTES_A_TEXEL, device_s, sum })
}

impl Table {
    fn of(pool: &BufferPool, pass: &ComputePass, view: &wgpu::TextureView) -> anyhow::Result<Self> {
        let size = view.texture().size();
        let threads = [size.width / TEXELS_A_THREAD, size.height];
        let sums = pool.lend_storage("sums of a table", 4 * count(threads));
        let bound = pass.bind(0, [Binding::texture("table", view), Binding::buffer("sums", &sums)])?;
        Ok(Self { bound, sums, threads })
    }

    fn count(&self) -> u64 {
        count(self.threads)
    }
}

fn count([columns, rows]: [u32; 2]) -> u64 {
    u64::from(columns) * u64::from(rows)
}

fn recorded<'g>(gpu: &'g Gpu, pass: &ComputePass, tables: &[Table]) -> Frame<'g> {
    let mut frame = Frame::begin(gpu, "memory pass", gpu::Turn::default());
    for Table { bound, threads: [columns, rows], .. } in tables {
        pass.dispatch(&mut frame, &[bound], DispatchSize::Invocations([*columns, *rows, 1]));
    }
    frame
}

fn sum(pool: &BufferPool, mut frame: Frame<'_>, tables: &[Table]) -> anyhow::Result<u32> {
    let read = |table: &Table| {
        let bytes = 4 * table.count();
        (frame.read_back(&table.sums, 0..bytes, pool.lend_host("sums of a table", bytes)), table.count() as usize)
    };
    let reads: Vec<_> = tables.iter().map(read).collect();
    let result = frame.submit()?.wait()?;
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

    #[test]
    fn every_texel_is_read_once() {
        let gpu = Gpu::open(DevicePreference::Software).expect("a software device");
        let words = |count: u32| (0..count).map(|i| i.wrapping_mul(0x9e37_79b9)).collect::<Vec<u32>>();
        // A whole number of rows, and one that ends within a row, which is padded with zeros.
        let tables = [words(4 * 4096 * 3), words(4 * 4096 + 20)];
        let textures = tables.each_ref().map(|table| {
            let texels = table.as_chunks::<4>().0;
            gpu::Table::new(&gpu, "a table", wgpu::TextureFormat::Rgba32Uint, texels).expect("a small table")
        });
        let pass = read(&gpu, &BufferPool::new(&gpu), &textures.each_ref().map(|t| &**t)).expect("a pass");
        let expected = wrapping_sum(&tables.concat());
        assert_eq!((pass.sum, pass.bytes), (expected, 16 * 4096 * (3 + 2)));
        assert!(pass.device_s > 0.0);
    }
}
