//! Lists of rays off mirrors.

use bytemuck::{Pod, Zeroable};
use gpu::{Binding, DispatchSize, Gpu};
use wgpu::{Buffer, BufferUsages};

use crate::batch::{BoundPass, Recording};
use crate::pixel_list::LIST_WORKGROUP;

/// `Bounce` of `reflections/bounce.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuBounce {
    pub point_in_world: [f32; 3],
    pub place: u32,
    pub direction: [f32; 3],
    pub seed: u32,
    pub throughput_linear: [f32; 3],
    pub side_m: f32,
    pub surface: [u32; 4],
    pub bias_m: f32,
    pub spread: f32,
    pub roughness: f32,
    pub curvature_per_m: f32,
    pub met: u32,
    pub near_m: f32,
    pub unmirrored: u32,
    pub padding: u32,
}

/// Rays off mirrors, or points, of one piece.
pub(crate) struct Rays {
    bounces: Buffer,
    /// Workgroups along x, y and z, and the list's length.
    arguments: Buffer,
    /// Pixels of the piece.
    pub units: u32,
    /// Mirrors on the way so far; counted from [`depth_image::MAX_REFLECTIONS`] on where the first is a glossy surface.
    pub generation: u32,
}

impl Rays {
    /// An empty list in this memory, for a piece of so many pixels.
    pub fn new(gpu: &Gpu, bounces: &Buffer, units: u32, generation: u32) -> Self {
        Self::with(gpu, bounces, [0, 1, 1, 0], units, generation)
    }

    /// The list of the first `count` points of this memory.
    pub fn of_points(gpu: &Gpu, bounces: &Buffer, count: u32, generation: u32) -> Self {
        Self::with(gpu, bounces, [count.div_ceil(LIST_WORKGROUP), 1, 1, count], count, generation)
    }

    fn with(gpu: &Gpu, bounces: &Buffer, arguments: [u32; 4], units: u32, generation: u32) -> Self {
        let arguments = gpu.buffer_with("list", &arguments, BufferUsages::STORAGE | BufferUsages::INDIRECT);
        Self { bounces: bounces.clone(), arguments, units, generation }
    }

    pub fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::buffer("bounces", &self.bounces), Binding::buffer("list", &self.arguments)]
    }

    /// The bindings of a pass that fills the list.
    pub fn next_bindings(&self) -> [Binding<'_>; 2] {
        [Binding::buffer("next_bounces", &self.bounces), Binding::buffer("next", &self.arguments)]
    }

    /// Records a pass over them, bound with their generation: each mirror on the way leaves fewer rays.
    pub fn dispatch(&self, recording: &mut Recording<'_>, bound: &BoundPass) {
        recording.dispatch_element(bound, 0, self.units, DispatchSize::Indirect(&self.arguments, 0));
    }
}
