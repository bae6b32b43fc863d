//! Lists of rays off mirrors.

use bytemuck::{Pod, Zeroable};
use gpu::{Binding, BoundGroup, ComputePass, DispatchSize, Gpu, ShaderVariant, WorkKind};
use wgpu::{Buffer, BufferUsages};

use crate::{batch::Recording, pixel_list::LIST_WORKGROUP};

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
    pub padding: [u32; 2],
}

/// The arguments of the dispatches over the rays of one piece off one mirror.
pub(crate) struct BounceList {
    arguments: Buffer,
    /// Pixels of the piece.
    pub units: u32,
}

impl BounceList {
    /// An empty list, for a piece of so many pixels.
    pub fn new(gpu: &Gpu, units: u32) -> Self {
        // Workgroups along x, y and z, and the list's length.
        Self { arguments: arguments(gpu, "mirrored rays", [0, 1, 1, 0]), units }
    }

    /// The list of `count` points.
    pub fn of(gpu: &Gpu, count: u32) -> Self {
        let workgroups = count.div_ceil(LIST_WORKGROUP);
        Self { arguments: arguments(gpu, "listed points", [workgroups, 1, 1, count]), units: count }
    }

    pub fn binding(&self, name: &'static str) -> Binding<'_> {
        Binding::buffer(name, &self.arguments)
    }
}

fn arguments(gpu: &Gpu, label: &str, words: [u32; 4]) -> Buffer {
    gpu.buffer_with(label, &words, BufferUsages::STORAGE | BufferUsages::INDIRECT)
}

/// The rays of a piece off one mirror.
#[derive(Clone, Copy)]
pub(crate) struct Rays<'r> {
    pub bounces: &'r Buffer,
    pub list: &'r BounceList,
    /// Mirrors on the way so far; counted from [`depth_image::MAX_REFLECTIONS`] on where the first is a glossy surface.
    pub generation: u32,
}

impl Rays<'_> {
    pub fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::buffer("bounces", self.bounces), self.list.binding("list")]
    }

    /// Records a pass over them. `counts` are those of the rays of light that it traces.
    pub fn dispatch(
        &self,
        recording: &mut Recording<'_>,
        variant: &impl ShaderVariant,
        counts: [u32; 3],
        pass: &ComputePass,
        groups: &[&BoundGroup],
    ) {
        pass.dispatch(&mut recording.frame, groups, DispatchSize::Indirect(&self.list.arguments, 0));
        // Each mirror on the way leaves fewer rays.
        let kind = WorkKind::new(recording.batch.family(), &(variant.name(), counts, self.generation));
        recording.frame.cut(kind, self.list.units.into());
    }
}
