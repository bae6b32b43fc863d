//! Gives pixels that no camera knows the colour of the farther side of their gap.

use bytemuck::{Pod, Zeroable};
use depth_image::ProvenanceKind;
use gpu::{Binding, PassCache, ResourceTrait, ResourceTraits, ShaderVariant, WgslLiteral as _, uniform_elements};
use minijinja::{Value, context};
use wgpu::BufferUsages;

use crate::{
    batch::Batch,
    error::ReconstructionError,
    pixel_list::{LIST_WORKGROUP, PixelList},
    recording::Recording,
};

pub(crate) const SHADER: (&str, &str) = ("fill.wgsl", include_str!("fill.wgsl"));

/// The greatest distance of a known pixel, in steps along a row, column or diagonal.
pub(crate) const REACH_PX: i32 = 48;
/// Inverse depths whose ratio is above this are one side of the gap.
pub(crate) const SAME_SIDE: f32 = 0.95;
/// Steps towards known pixels.
pub(crate) const DIRECTIONS: [[i32; 2]; 8] = [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]];

/// `FillWork` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuFillWork {
    pub size_px: [u32; 2],
    pub first_pixel: u32,
    pub number: u32,
}

/// `fill.wgsl`, which has no switches.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Fill;

impl ShaderVariant for Fill {
    const TEMPLATE: &'static str = SHADER.0;
    const TRAITS: ResourceTraits = &[("work", ResourceTrait::DynamicOffset)];

    fn context(&self) -> Value {
        context! {
            reach_px => REACH_PX,
            same_side => SAME_SIDE.wgsl_literal(),
            directions => DIRECTIONS,
            list_workgroup => LIST_WORKGROUP,
            provenance_filled => ProvenanceKind::Filled as u32,
        }
    }

    fn all() -> Vec<Self> {
        vec![Self]
    }
}

pub(crate) fn record(
    passes: &PassCache<Fill>,
    recording: &mut Recording<'_>,
    unknown: &PixelList,
) -> Result<(), ReconstructionError> {
    let pass = passes.get(&Fill)?;
    let batch = &recording.batch;
    let works = recording.device.gpu.buffer_with("fill", &fill_works(batch), BufferUsages::UNIFORM);
    let planes = [
        Binding::buffer("work", &works),
        Binding::buffer("srgb8", &batch.srgb8),
        Binding::buffer("inverse_depth", &batch.inverse_depth_per_m),
        Binding::buffer("provenance", &batch.provenance),
    ];
    let bound = pass.bind(0, planes.into_iter().chain(unknown.bindings()))?;
    recording.dispatch_listed(&pass, &bound, unknown);
    Ok(())
}

fn fill_works(batch: &Batch) -> Vec<u8> {
    let size_px = batch.size_px.to_array();
    let work = |number| GpuFillWork { size_px, first_pixel: number * batch.size_px.element_product(), number };
    uniform_elements((0..batch.cameras.len() as u32).map(|number| bytemuck::bytes_of(&work(number)).to_vec()))
}
