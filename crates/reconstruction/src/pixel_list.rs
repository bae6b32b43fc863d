//! Pixels that one pass leaves to the next: `pixel_list.wgsl`.

use bytemuck::{Pod, Zeroable};
use gpu::{Binding, Gpu};
use wgpu::BufferUsages;

/// The workgroup size of passes over lists of pixels.
pub(crate) const LIST_WORKGROUP: u32 = 64;

/// For each piece of a view of a batch, pixels that a pass left undecided.
pub(crate) struct PixelList {
    /// Memory of the batch, which several lists use in turn.
    pub pixels: wgpu::Buffer,
    /// A [`GpuPixelList`] for each piece: arguments of indirect dispatches.
    pub lists: wgpu::Buffer,
}

/// `PixelList` of `pixel_list.wgsl`: arguments of an indirect dispatch, and the length of the list.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuPixelList {
    pub workgroups: [u32; 3],
    pub count: u32,
}

/// The arguments of dispatches over lists of which nothing is listed yet.
pub(crate) fn empty_lists(gpu: &Gpu, label: &str, count: usize) -> wgpu::Buffer {
    let empty = GpuPixelList { workgroups: [0, 1, 1], count: 0 };
    gpu.buffer_with(label, &vec![empty; count], BufferUsages::STORAGE | BufferUsages::INDIRECT)
}

impl PixelList {
    /// Empty lists for `pieces` pieces of views, with four bytes for each of their pixels.
    pub fn empty(gpu: &Gpu, pixels: wgpu::Buffer, pieces: usize) -> Self {
        Self { pixels, lists: empty_lists(gpu, "lists of undecided pixels", pieces) }
    }

    /// The list for passes that write it: `found.wgsl`.
    pub fn written_bindings(&self) -> [Binding<'_>; 2] {
        [Binding::buffer("undecided_pixels", &self.pixels), Binding::buffer("undecided", &self.lists)]
    }

    /// As the next pass reads it.
    pub fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::buffer("listed_pixels", &self.pixels), Binding::buffer("lists", &self.lists)]
    }
}
