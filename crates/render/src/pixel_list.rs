//! Pixels that one pass leaves to the next, and the arguments of the indirect dispatch over them.

use gpu::{Binding, BufferPool, DispatchSize, Gpu, PooledBuffer};
use wgpu::BufferUsages;

/// Invocations of a workgroup over listed pixels.
pub(crate) const LIST_WORKGROUP: u32 = 64;

/// Places of pixels; the buffer on loan must live until the frame is done.
pub(crate) struct PixelList {
    pixels: PooledBuffer,
    arguments: wgpu::Buffer,
}

impl PixelList {
    /// An empty list with room for so many pixels.
    pub fn new(gpu: &Gpu, pool: &BufferPool, pixels: u32) -> Self {
        let bytes = 4 * u64::from(pixels);
        Self {
            pixels: pool.lend_storage("listed pixels", bytes),
            // Workgroups along x, y and z, and the numbers of pixels from the list's beginning and from its end.
            arguments: gpu.buffer_with("list", &[0u32, 1, 1, 0, 0], BufferUsages::STORAGE | BufferUsages::INDIRECT),
        }
    }

    pub fn size(&self) -> DispatchSize<'_> {
        DispatchSize::Indirect(&self.arguments, 0)
    }

    pub fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::buffer("listed_pixels", &self.pixels), Binding::buffer("list", &self.arguments)]
    }

    /// The bindings of a pass over this list that fills another.
    pub fn asked_bindings(&self) -> [Binding<'_>; 2] {
        [Binding::buffer("asked_pixels", &self.pixels), Binding::buffer("asked", &self.arguments)]
    }
}
