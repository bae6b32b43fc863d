//! An image on its way to quads: `cut.wgsl`, the common part of passes that cut, merge and list.

use bytemuck::{Pod, Zeroable};
use glam::UVec2;
use gpu::{Binding, DispatchSize, Frame, Gpu, GpuError, PooledBuffer, ShaderVariant, WorkKind};
use wgpu::BufferUsages;

use super::mesh::{Cut, INDICES_A_QUAD, ImageQuads};
use crate::view_work::{GpuSampleCamera, GpuViewCamera};
use crate::{device::Device, error::ReconstructionError, sample_set::SampleSet};

/// Samples that one thread counts and lists.
pub(crate) const CHUNK: u32 = 64;
const BYTES_OF_DRAW: u64 = 20;
/// Bits of the greatest error, and quads before merging.
const BYTES_OF_REPORT: u64 = 8;

/// `CutWork` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuCutWork {
    pub column_in_world: [f32; 3],
    pub focal_px: f32,
    pub row_in_world: [f32; 3],
    pub code_scale: f32,
    pub corner_in_world: [f32; 3],
    pub code_offset: f32,
    pub size_px: [u32; 2],
    pub first_sample: u32,
    pub first_corner: u32,
    pub axis: u32,
    pub bound_px: f32,
    pub chunks: u32,
    pub segment: u32,
}

/// A buffer of zeros, which may be read back.
fn storage(gpu: &Gpu, label: &str, bytes: u64, usage: BufferUsages) -> Result<wgpu::Buffer, GpuError> {
    gpu.check_storage_bytes(label, bytes)?;
    Ok(gpu.buffer(label, bytes, usage | BufferUsages::STORAGE | BufferUsages::COPY_SRC))
}

/// An image on its way to quads.
pub(crate) struct ImageCut<'s> {
    pub device: &'s Device,
    pub set: &'s SampleSet,
    pub number: usize,
    pub size_px: UVec2,
    pub quads: ImageQuads,
    /// See `extent_of` in the shaders.
    extents: PooledBuffer,
    /// The quads of each chunk; later the places where they begin.
    counts: PooledBuffer,
    pub report: wgpu::Buffer,
}

impl<'s> ImageCut<'s> {
    pub fn new(device: &'s Device, set: &'s SampleSet, number: usize, cut: Cut) -> Result<Self, GpuError> {
        let size_px = set.meshes.cameras[number].size_px;
        let samples = u64::from(size_px.element_product());
        let vertices = u64::from(cut.vertices.per_sample()) * samples;
        let indices = u64::from(INDICES_A_QUAD) * samples;
        let quads = ImageQuads {
            inverse_depths: storage(&device.gpu, "corners of quads", 4 * vertices, BufferUsages::VERTEX)?,
            indices: storage(&device.gpu, "indices of quads (bytes)", 4 * indices, BufferUsages::INDEX)?,
            draw: storage(&device.gpu, "quads to draw", BYTES_OF_DRAW, BufferUsages::INDIRECT)?,
        };
        // New buffers are zero, as the report's sums need.
        let report = storage(&device.gpu, "mesh report", BYTES_OF_REPORT, BufferUsages::empty())?;
        let extents = device.buffers.lend_storage("extents of quads", 4 * samples);
        let chunks = u64::from(size_px.element_product().div_ceil(CHUNK));
        let counts = device.buffers.lend_storage("quads of chunks", 4 * chunks);
        Ok(Self { device, set, number, size_px, quads, extents, counts, report })
    }

    pub fn chunks(&self) -> u32 {
        self.size_px.element_product().div_ceil(CHUNK)
    }

    pub fn work(&self) -> GpuCutWork {
        let camera: &GpuSampleCamera = &self.set.cameras[self.number];
        let rays = GpuViewCamera::of(&self.set.meshes.cameras[self.number], 0);
        let planes = self.set.meshes.planes.as_ref();
        GpuCutWork {
            column_in_world: rays.column_in_world,
            focal_px: camera.focal_px,
            row_in_world: rays.row_in_world,
            code_scale: camera.code_scale,
            corner_in_world: rays.corner_in_world,
            code_offset: camera.code_offset,
            size_px: self.size_px.to_array(),
            first_sample: camera.first_cell,
            first_corner: planes.map_or(0, |planes| planes.first_corners[self.number]),
            chunks: self.chunks(),
            ..GpuCutWork::zeroed()
        }
    }

    /// The resources of all passes that cut, merge and list: each shader declares some of them.
    fn bindings(&self) -> Vec<Binding<'_>> {
        let mut bindings = vec![
            Binding::buffer("inverse_depths", &self.quads.inverse_depths),
            Binding::buffer("extents", &self.extents),
            Binding::buffer("counts", &self.counts),
            Binding::buffer("report", &self.report),
            Binding::buffer("draw", &self.quads.draw),
            Binding::buffer("indices", &self.quads.indices),
            Binding::texture("cell_codes", &self.set.cell_codes),
        ];
        let planes = self.set.meshes.planes.as_ref().ok();
        bindings.extend(planes.map(|planes| Binding::texture("planes", &planes.texels)));
        bindings
    }

    /// Records one dispatch of a shader that includes `cut.wgsl`.
    pub fn dispatch(
        &self,
        frame: &mut Frame<'_>,
        variant: &impl ShaderVariant,
        work: GpuCutWork,
        [x, y]: [u32; 2],
    ) -> Result<(), ReconstructionError> {
        let pass = self.device.passes.get(variant)?;
        let work = self.device.gpu.buffer_with("cut", &[work], BufferUsages::UNIFORM);
        let bound = pass.bind(0, self.bindings().into_iter().chain([Binding::buffer("work", &work)]))?;
        pass.dispatch(frame, &[&bound], DispatchSize::Invocations([x, y, 1]));
        let kind = WorkKind::new(WorkKind::family(&"cut meshes"), &variant.name());
        frame.cut(kind, self.size_px.element_product().into());
        Ok(())
    }
}
