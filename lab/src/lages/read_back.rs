//! Copies from the device to the host: a step of Figure 6 of the paper.

use app_core::experiment::{Experiment, VIEW_SIZE_PX};
use depth_image::PinholeCamera;
use engine::GpuEngine;
use gpu::{BufferPool, Frame, Turn};

use crate::statistics::median_seconds;

/// Copies that are timed after one that is not.
const RUNS: usize = 9;
/// Views that are read back together, as in the calls of compositors.
const VIEWS_A_CALL: u64 = 64;
/// Bytes of a texel's depth and colour.
const TEXEL_BYTES: u64 = 8;
/// Bytes of a pixel's colour.
const PIXEL_BYTES: u64 = 4;

/// Seconds of copies, alone and warm.
#[derive(Debug, Clone, Copy)]
pub struct ReadBack {
    pub image_s: f64,
    pub view_s: f64,
}

impl ReadBack {
    /// Times copies of the images of a set, and of views, to memory that the host may keep.
    ///
    /// # Errors
    /// The device fails.
    pub fn measure(experiment: &Experiment) -> anyhow::Result<Self> {
        let samples = &experiment.setup.samples;
        let texels: usize = samples.iter().map(PinholeCamera::pixel_count).sum();
        let set_s = copy_s(&experiment.engine, texels as u64 * TEXEL_BYTES)?;
        let call_bytes = VIEWS_A_CALL * u64::from(VIEW_SIZE_PX.element_product()) * PIXEL_BYTES;
        let call_s = copy_s(&experiment.engine, call_bytes)?;
        Ok(Self { image_s: set_s / samples.len() as f64, view_s: call_s / VIEWS_A_CALL as f64 })
    }
}

fn copy_s(engine: &GpuEngine, bytes: u64) -> anyhow::Result<f64> {
    let gpu = engine.renderer.gpu();
    let pool = BufferPool::new(gpu);
    let source = pool.lend_storage("read-back source", bytes);
    median_seconds(RUNS, || {
        let mut frame = Frame::begin(gpu, "read-back", Turn::default());
        let copy = frame.read_back(&source, 0..bytes, pool.lend_host("read-back", bytes));
        Ok(frame.submit()?.wait()?.with(copy, |words: &[u32]| words.to_vec())?)
    })
}
