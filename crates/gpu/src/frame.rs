//! A frame: passes recorded together, submitted in as few slices as the device's queue wants, read back together.

use std::{collections::VecDeque, ops::Range, sync::mpsc, time::Instant};

use wgpu::{BufferUsages, LoadOp, Operations, RenderPassColorAttachment, RenderPassDepthStencilAttachment, StoreOp};

use crate::sharing::{Slot, Turn, Work, WorkKind};
use crate::{device::Gpu, error::GpuError, pool::PooledBuffer};

/// A slice that takes longer, though a live stream is open, is logged.
const LONG_SLICE_S: f64 = 0.3;

/// Work that is being recorded.
pub struct Frame<'g> {
    pub(crate) gpu: &'g Gpu,
    label: &'static str,
    turn: Turn,
    /// The commands of the piece that is being recorded, to which passes add theirs.
    pub encoder: wgpu::CommandEncoder,
    /// The work of that piece.
    pub(crate) work: Vec<Work>,
    ended: VecDeque<Piece>,
    timer: Option<Timer>,
    reads: Vec<PooledBuffer>,
}

/// Work between two cuts.
struct Piece {
    commands: wgpu::CommandBuffer,
    work: Vec<Work>,
}

/// A place in the results of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Readback(usize);

struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    host: wgpu::Buffer,
}

/// Work whose last slice is under way. It holds the device until it is waited for or dropped: a thread that has it asks for
/// no other turn. While a live stream is open, it has ended: no work of the host lies between the device's end and others'
/// turns.
pub struct Submitted<'g> {
    gpu: &'g Gpu,
    /// The slice that is under way.
    slice: Option<Slice<'g>>,
    /// Seconds of the slices that have ended.
    earlier_s: f64,
    timer: Option<Timer>,
    reads: Vec<PooledBuffer>,
    mapped: mpsc::Receiver<Result<(), wgpu::BufferAsyncError>>,
}

/// Pieces that were submitted together.
struct Slice<'g> {
    slot: Slot<'g>,
    index: wgpu::SubmissionIndex,
    work: Vec<Work>,
    started: Instant,
}

/// Finished work.
pub struct FrameResult {
    /// Seconds on the device: by time stamps on a GPU, by wall clock around submit and wait on the software device, and where
    /// the work was cut. Waiting for turns does not count.
    pub device_s: f64,
    reads: Vec<PooledBuffer>,
}

impl<'g> Frame<'g> {
    /// Starts recording.
    #[must_use]
    pub fn begin(gpu: &'g Gpu, label: &'static str, turn: Turn) -> Self {
        let mut encoder = encoder(gpu, label);
        let timer = gpu.timestamp_period_ns.map(|_| Timer::new(gpu));
        if let Some(timer) = &timer {
            encoder.write_timestamp(&timer.queries, 0);
        }
        Self { gpu, label, turn, encoder, work: Vec::new(), ended: VecDeque::new(), timer, reads: Vec::new() }
    }

    /// Says what was recorded since the last cut: so many units of a kind. While a live stream is open, other work may go
    /// between this and what is recorded next.
    pub fn cut(&mut self, kind: WorkKind, units: u64) {
        self.work.push((kind, units));
        if self.gpu.device_queue.cuts() {
            let next = encoder(self.gpu, self.label);
            let commands = std::mem::replace(&mut self.encoder, next).finish();
            self.ended.push_back(Piece { commands, work: std::mem::take(&mut self.work) });
        }
    }

    /// Begins a pass that draws over cleared targets, or over what was drawn before. Depth is reversed: it is cleared to infinity.
    pub fn begin_drawing(
        &mut self,
        label: &str,
        colors: &[&wgpu::TextureView],
        clear: Option<wgpu::Color>,
        reversed_depth: &wgpu::TextureView,
    ) -> wgpu::RenderPass<'_> {
        let ops = Operations { load: clear.map_or(LoadOp::Load, LoadOp::Clear), store: StoreOp::Store };
        let color_attachments: Vec<_> = colors
            .iter()
            .map(|view| Some(RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }))
            .collect();
        let depth_load = if clear.is_some() { LoadOp::Clear(0.0) } else { LoadOp::Load };
        let depth_ops = Some(Operations { load: depth_load, store: StoreOp::Store });
        let view = reversed_depth;
        self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments: &color_attachments,
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

    /// Sends the work to the device, each slice in its turn, and waits for all slices but the last.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn submit(self) -> Result<Submitted<'g>, GpuError> {
        self.submit_in(None)
    }

    /// Sends the work to the device as [`Frame::submit`] does, the first slice in `slot` if that was waited for before.
    pub(crate) fn submit_in(self, slot: Option<Slot<'g>>) -> Result<Submitted<'g>, GpuError> {
        let Self { gpu, label, turn, mut encoder, work, ended: mut pieces, timer, reads } = self;
        if let Some(timer) = &timer {
            timer.finish(&mut encoder);
        }
        pieces.push_back(Piece { commands: encoder.finish(), work });
        let mut slot = slot.unwrap_or_else(|| gpu.device_queue.wait(turn, predicted_s(gpu, &pieces)));
        gpu.faults.check_injected()?;
        let mut earlier_s = 0.0;
        let last = loop {
            gpu.faults.check_lost()?;
            let slice = Slice::submit(gpu, slot, &mut pieces);
            if pieces.is_empty() {
                break slice;
            }
            let (held, slice_s) = slice.ended(gpu, label)?;
            earlier_s += slice_s;
            slot = held.next(predicted_s(gpu, &pieces));
        };
        let mapped = map(&reads, timer.as_ref());
        let mut submitted = Submitted { gpu, slice: None, earlier_s, timer, reads, mapped };
        if gpu.device_queue.cuts() {
            submitted.earlier_s += last.ended(gpu, label)?.1;
        } else {
            submitted.slice = Some(last);
        }
        Ok(submitted)
    }
}

fn encoder(gpu: &Gpu, label: &str) -> wgpu::CommandEncoder {
    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
}

fn works(pieces: &VecDeque<Piece>) -> impl ExactSizeIterator<Item = &[Work]> {
    pieces.iter().map(|piece| &*piece.work)
}

/// The seconds of the next slice.
fn predicted_s(gpu: &Gpu, pieces: &VecDeque<Piece>) -> f64 {
    let queue = &gpu.device_queue;
    queue.predicted_s(works(pieces).take(queue.merged(works(pieces))))
}

/// Asks for host memory to be filled when the device is done.
fn map(reads: &[PooledBuffer], timer: Option<&Timer>) -> mpsc::Receiver<Result<(), wgpu::BufferAsyncError>> {
    let (sender, mapped) = mpsc::channel();
    for buffer in reads.iter().map(|pooled| &**pooled).chain(timer.map(|timer| &timer.host)) {
        let sender = sender.clone();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver is gone only when the caller no longer waits.
            let _ = sender.send(result);
        });
    }
    mapped
}

fn wait(gpu: &Gpu, index: wgpu::SubmissionIndex) -> Result<(), GpuError> {
    gpu.faults.check_lost()?;
    let poll = wgpu::PollType::Wait { submission_index: Some(index), timeout: None };
    gpu.device.poll(poll).map_err(|error| GpuError::Lost(error.to_string()))?;
    gpu.faults.check_lost()
}

/// Asks the device, which then tells of its loss.
pub(crate) fn notice_loss(gpu: &Gpu) {
    let _ = gpu.device.poll(wgpu::PollType::Poll);
}

impl<'g> Slice<'g> {
    /// Sends the pieces of one slice. A live stream may have opened while they waited.
    fn submit(gpu: &Gpu, slot: Slot<'g>, pieces: &mut VecDeque<Piece>) -> Self {
        let count = gpu.device_queue.merged(works(pieces));
        let (commands, works): (Vec<_>, Vec<_>) =
            pieces.drain(..count).map(|Piece { commands, work }| (commands, work)).unzip();
        let started = Instant::now();
        let index = gpu.queue.submit(commands);
        Self { slot, index, work: works.concat(), started }
    }

    /// Waits for the device and learns from the time that it took.
    fn ended(self, gpu: &Gpu, label: &str) -> Result<(Slot<'g>, f64), GpuError> {
        let Self { slot, index, work, started } = self;
        wait(gpu, index)?;
        let slice_s = started.elapsed().as_secs_f64();
        if slice_s > LONG_SLICE_S {
            tracing::debug!(label, slice_s, "other work waited for a long slice");
        }
        gpu.device_queue.learn(&work, slice_s);
        Ok((slot, slice_s))
    }
}

impl Submitted<'_> {
    /// Blocks until the device is done with this frame.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn wait(mut self) -> Result<FrameResult, GpuError> {
        let mut device_s = self.earlier_s;
        // Where the device was done before anybody waited, the time since is the host's.
        let was_done = self.gpu.device.poll(wgpu::PollType::Poll).is_ok_and(|status| status.is_queue_empty());
        let slice = self.slice.take();
        if let Some(slice) = &slice {
            wait(self.gpu, slice.index.clone())?;
        }
        let wall_s = slice.as_ref().map_or(0.0, |slice| slice.started.elapsed().as_secs_f64());
        for _ in 0..self.reads.len() + usize::from(self.timer.is_some()) {
            let mapped = self.mapped.recv().map_err(|error| GpuError::Lost(error.to_string()))?;
            mapped.map_err(|error| GpuError::Lost(error.to_string()))?;
        }
        if let Some(slice) = slice {
            // Time stamps of several slices would count the time between them.
            let timer = self.timer.as_ref().filter(|_| self.earlier_s == 0.0);
            let by_timestamp =
                timer.zip(self.gpu.timestamp_period_ns).and_then(|(timer, period_ns)| timer.seconds(period_ns));
            if by_timestamp.is_some() || !was_done {
                self.gpu.device_queue.learn(&slice.work, by_timestamp.unwrap_or(wall_s));
            }
            device_s += by_timestamp.unwrap_or(wall_s);
        }
        Ok(FrameResult { device_s, reads: std::mem::take(&mut self.reads) })
    }
}

impl Drop for Submitted<'_> {
    /// Host memory goes back to its pool when the device is done with it.
    fn drop(&mut self) {
        if let Some(slice) = self.slice.as_ref().filter(|_| !self.reads.is_empty()) {
            let _ = wait(self.gpu, slice.index.clone());
        }
        self.reads.iter().for_each(|buffer| buffer.unmap());
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
        let descriptor = wgpu::QuerySetDescriptor { label: Some("frame"), ty: wgpu::QueryType::Timestamp, count: 2 };
        Self {
            queries: gpu.device.create_query_set(&descriptor),
            resolved: gpu.buffer("timestamps", 16, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            host: gpu.buffer("timestamps", 16, BufferUsages::MAP_READ | BufferUsages::COPY_DST),
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
