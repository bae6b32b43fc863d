//! A frame: passes recorded together, submitted once, read back together.

use std::{ops::Range, sync::mpsc, time::Instant};

use wgpu::{BufferUsages, LoadOp, Operations, RenderPassColorAttachment, RenderPassDepthStencilAttachment, StoreOp};

use crate::{device::Gpu, error::GpuError, pool::PooledBuffer};

/// Work that is being recorded.
pub struct Frame<'g> {
    gpu: &'g Gpu,
    /// The commands so far, to which passes add theirs.
    pub encoder: wgpu::CommandEncoder,
    timer: Option<Timer>,
    reads: Vec<PooledBuffer>,
}

/// A place in the results of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Readback(usize);

struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    host: wgpu::Buffer,
}

/// Work that is under way.
pub struct Submitted<'g> {
    gpu: &'g Gpu,
    index: wgpu::SubmissionIndex,
    timer: Option<Timer>,
    reads: Vec<PooledBuffer>,
    mapped: mpsc::Receiver<Result<(), wgpu::BufferAsyncError>>,
    started: Instant,
}

/// Finished work.
pub struct FrameResult {
    /// Seconds on the device: by time stamps on a GPU, by wall clock around submit and wait on the
    /// software device.
    pub device_s: f64,
    reads: Vec<PooledBuffer>,
}

impl<'g> Frame<'g> {
    /// Starts recording.
    #[must_use]
    pub fn begin(gpu: &'g Gpu, label: &str) -> Self {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) });
        let timer = gpu.timestamp_period_ns.map(|_| Timer::new(gpu));
        if let Some(timer) = &timer {
            encoder.write_timestamp(&timer.queries, 0);
        }
        Self { gpu, encoder, timer, reads: Vec::new() }
    }

    /// Begins a pass that draws over cleared targets. Depth is reversed: it is cleared to infinity.
    pub fn begin_drawing(
        &mut self,
        label: &str,
        colors: &[&wgpu::TextureView],
        clear: wgpu::Color,
        reversed_depth: &wgpu::TextureView,
    ) -> wgpu::RenderPass<'_> {
        let ops = Operations { load: LoadOp::Clear(clear), store: StoreOp::Store };
        let color = |view| Some(RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops });
        let depth_ops = Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store });
        let view = reversed_depth;
        self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: &colors.iter().copied().map(color).collect::<Vec<_>>(),
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }),
            ..Default::default()
        })
    }

    /// Copies `range` (multiples of 4) of `source` to host memory that `host` lends.
    pub fn read_back(&mut self, source: &wgpu::Buffer, range: Range<u64>, host: PooledBuffer) -> Readback {
        self.encoder.copy_buffer_to_buffer(source, range.start, &host, 0, range.end - range.start);
        self.reads.push(host);
        Readback(self.reads.len() - 1)
    }

    /// Sends the work to the device.
    #[must_use]
    pub fn submit(mut self) -> Submitted<'g> {
        if let Some(timer) = &self.timer {
            timer.finish(&mut self.encoder);
        }
        let started = Instant::now();
        let index = self.gpu.queue.submit([self.encoder.finish()]);
        let (sender, mapped) = mpsc::channel();
        let timer_buffer = self.timer.iter().map(|timer| &timer.host);
        for buffer in self.reads.iter().map(|pooled| &**pooled).chain(timer_buffer) {
            let sender = sender.clone();
            buffer.map_async(wgpu::MapMode::Read, .., move |result| {
                // The receiver is gone only when the caller no longer waits.
                let _ = sender.send(result);
            });
        }
        Submitted { gpu: self.gpu, index, timer: self.timer, reads: self.reads, mapped, started }
    }
}

impl Submitted<'_> {
    /// Blocks until the device is done with this frame.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn wait(self) -> Result<FrameResult, GpuError> {
        let poll = wgpu::PollType::Wait { submission_index: Some(self.index), timeout: None };
        self.gpu.device.poll(poll).map_err(|error| GpuError::Lost(error.to_string()))?;
        let wall_s = self.started.elapsed().as_secs_f64();
        for _ in 0..self.reads.len() + usize::from(self.timer.is_some()) {
            let mapped = self.mapped.recv().map_err(|error| GpuError::Lost(error.to_string()))?;
            mapped.map_err(|error| GpuError::Lost(error.to_string()))?;
        }
        let by_timestamp =
            self.timer.zip(self.gpu.timestamp_period_ns).and_then(|(timer, period_ns)| timer.seconds(period_ns));
        Ok(FrameResult { device_s: by_timestamp.unwrap_or(wall_s), reads: self.reads })
    }
}

impl FrameResult {
    /// Reads the bytes of a read-back as elements of `T`.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn with<T: bytemuck::AnyBitPattern, R>(
        &self,
        readback: Readback,
        read: impl FnOnce(&[T]) -> R,
    ) -> Result<R, GpuError> {
        let view = self.reads[readback.0].get_mapped_range(..).map_err(|error| GpuError::Lost(error.to_string()))?;
        Ok(read(bytemuck::cast_slice(&view)))
    }
}

impl Drop for FrameResult {
    fn drop(&mut self) {
        for buffer in &self.reads {
            buffer.unmap();
        }
    }
}

impl Timer {
    fn new(gpu: &Gpu) -> Self {
        let buffer = |usage| gpu.buffer("timestamps", 16, usage);
        let descriptor = wgpu::QuerySetDescriptor { label: Some("frame"), ty: wgpu::QueryType::Timestamp, count: 2 };
        Self {
            queries: gpu.device.create_query_set(&descriptor),
            resolved: buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            host: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST),
        }
    }

    fn finish(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.write_timestamp(&self.queries, 1);
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.host, 0, 16);
    }

    fn seconds(&self, period_ns: f32) -> Option<f64> {
        let view = self.host.get_mapped_range(..).ok()?;
        let ticks: [u64; 2] = bytemuck::pod_read_unaligned(&view);
        Some(ticks[1].saturating_sub(ticks[0]) as f64 * f64::from(period_ns) * 1e-9)
    }
}
