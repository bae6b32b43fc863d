//! Draws a mesh into the views of a batch: depth, and the sample that is seen.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use depth_image::PinholeCamera;
use glam::{Vec3, Vec4};
use gpu::{
    Binding, DrawPass, DrawState, DrawVariant, DynamicUniforms, Frame, Gpu, GpuError, PassCache, Pool, ShaderVariant,
    Templates,
};
use gpu::{WorkKind, uniform_elements, uniform_stride};
use minijinja::{Value, context, value::merge_maps};
use wgpu::BufferUsages;

use super::mesh::{ImageQuads, Mesh, QuadVertices};
use super::targets::{QuadTargets, SAMPLE_FORMAT, TargetKind, Targets, target_bytes};
use crate::view_work::{GpuViewCamera, ONE_VIEW};
use crate::{error::ReconstructionError, recording::Recording, sample_set::SampleSet};

/// The most bytes of free targets: those of a few batches.
const MOST_FREE_BYTES: u64 = 64 << 20;
const INVERSE_DEPTH: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Float32];

/// `QuadWork` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct GpuQuadWork {
    pub clip_from_inverse_depth: [f32; 4],
    pub clip_from_column: [f32; 4],
    pub clip_from_row: [f32; 4],
    pub clip_from_corner: [f32; 4],
    pub width_px: u32,
    pub first_sample: u32,
    pub padding: [u32; 2],
}

/// Quads with their samples, or their depth alone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DrawQuads {
    vertices: QuadVertices,
    depth_only: bool,
}

impl ShaderVariant for DrawQuads {
    const TEMPLATE: &'static str = "draw.wgsl";
    const DYNAMIC_UNIFORMS: DynamicUniforms = ONE_VIEW;

    fn context(&self) -> Value {
        merge_maps([self.vertices.context(), context! { depth_only => self.depth_only }])
    }

    fn all() -> Vec<Self> {
        let all = QuadVertices::all().into_iter();
        all.flat_map(|vertices| [false, true].map(|depth_only| Self { vertices, depth_only })).collect()
    }
}

impl DrawVariant for DrawQuads {
    fn state(&self) -> DrawState {
        let vertices = wgpu::VertexBufferLayout {
            array_stride: 4,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &INVERSE_DEPTH,
        };
        // Both faces: a view may see a surface from behind its sample camera.
        let color_formats = if self.depth_only { Vec::new() } else { vec![SAMPLE_FORMAT] };
        DrawState { vertices: vec![vertices], cull_mode: None, color_formats, nearest_only: true }
    }
}

/// Drawing passes, and the targets of the last batches: most are alike.
pub(crate) struct QuadDrawing {
    gpu: Arc<Gpu>,
    passes: PassCache<DrawPass>,
    targets: Pool<TargetKind, Targets>,
}

impl QuadDrawing {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        let targets = Pool::of_device(gpu, MOST_FREE_BYTES, target_bytes);
        Self { gpu: gpu.clone(), passes: PassCache::new(gpu, templates), targets }
    }

    fn targets(&self, gpu: &Gpu, kind: TargetKind) -> Result<QuadTargets, GpuError> {
        let limits = gpu.device.limits();
        let (size_px, views) = kind;
        let side_px = size_px.max_element().into();
        GpuError::check_limit("a drawn view's side (px)", side_px, limits.max_texture_dimension_2d.into())?;
        GpuError::check_limit("views drawn together", views.into(), limits.max_texture_array_layers.into())?;
        Ok(self.targets.lend(kind, |&kind| Targets::new(gpu, kind)))
    }

    /// Records every image's quads in each view: depth, and the samples that are seen where there are targets for them.
    pub fn draw(
        &self,
        frame: &mut Frame<'_>,
        set: &SampleSet,
        mesh: &Mesh,
        cameras: &[PinholeCamera],
        samples: Option<&[wgpu::TextureView]>,
        depths: &[wgpu::TextureView],
    ) -> Result<(), ReconstructionError> {
        let quads = self.passes.get(&DrawQuads { vertices: mesh.cut.vertices, depth_only: samples.is_none() })?;
        let works = self.gpu.buffer_with("quads of views", &quad_works(set, cameras), BufferUsages::UNIFORM);
        let bound = quads.bind(0, [Binding::buffer("work", &works)])?;
        let mut offsets = (0..).step_by(uniform_stride(size_of::<GpuQuadWork>() as u32) as usize);
        let kind = WorkKind::new(family(), &format!("{:?}", mesh.cut));
        for (view, depth) in depths[..cameras.len()].iter().enumerate() {
            let colors: Vec<&wgpu::TextureView> = samples.iter().map(|samples| &samples[view]).collect();
            for (number, images) in slices(&self.gpu, mesh).enumerate() {
                let clear = (number == 0).then_some(wgpu::Color::TRANSPARENT);
                quads.announce(frame, &[&bound]);
                let mut pass = frame.begin_drawing("quads", &colors, clear, depth);
                pass.set_pipeline(quads.pipeline());
                for (image, offset) in images.iter().zip(&mut offsets) {
                    pass.set_bind_group(0, &*bound, &[offset]);
                    pass.set_vertex_buffer(0, image.inverse_depths.slice(..));
                    pass.set_index_buffer(image.indices.slice(..), wgpu::IndexFormat::Uint32);
                    pass.draw_indexed_indirect(&image.draw, 0);
                }
                drop(pass);
                frame.cut(kind, images.iter().map(vertices).sum());
            }
        }
        Ok(())
    }
}

/// Draws all images' quads into every view, in the targets of the batch.
pub(super) fn record(
    drawing: &QuadDrawing,
    recording: &mut Recording<'_>,
    mesh: &Mesh,
) -> Result<(), ReconstructionError> {
    let gpu = &recording.device.gpu;
    let views = (recording.batch.size_px, recording.batch.cameras.len() as u32);
    let targets = recording.batch.targets.take().map_or_else(|| drawing.targets(gpu, views), Ok)?;
    let cameras = &recording.batch.cameras;
    drawing.draw(
        &mut recording.frame,
        recording.set,
        mesh,
        cameras,
        Some(&targets.samples.each),
        &targets.depth.each,
    )?;
    recording.batch.targets = Some(targets);
    Ok(())
}

/// The family of drawing quads, whose units are vertices.
fn family() -> u64 {
    WorkKind::family(&"draw quads")
}

fn vertices(image: &ImageQuads) -> u64 {
    image.inverse_depths.size() / 4
}

/// The images that one pass draws. A view is cut between images: what is drawn stays in its targets.
fn slices<'m>(gpu: &Gpu, mesh: &'m Mesh) -> impl Iterator<Item = &'m [ImageQuads]> + use<'m> {
    let most = mesh.images.iter().map(vertices).max().unwrap_or(1).max(1);
    let a_slice = gpu.device_queue.slice_units(family(), most) / most;
    mesh.images.chunks(a_slice.clamp(1, mesh.images.len().max(1) as u64) as usize)
}

/// A uniform for each view and image.
fn quad_works(set: &SampleSet, cameras: &[PinholeCamera]) -> Vec<u8> {
    let mut works = Vec::new();
    for view in cameras {
        for (image, sample_camera) in set.meshes.cameras.iter().zip(&set.cameras) {
            works.push(quad_work(view, image, sample_camera.first_cell));
        }
    }
    uniform_elements(works.iter().map(bytemuck::bytes_of))
}

fn quad_work(view: &PinholeCamera, image: &PinholeCamera, first_sample: u32) -> GpuQuadWork {
    let rays = GpuViewCamera::of(image, 0);
    let [column, row, corner] = [rays.column_in_world, rays.row_in_world, rays.corner_in_world]
        .map(|direction| clip_direction(view, direction.into()).to_array());
    // As a difference of eyes: nothing is lost far from the origin.
    let eye = clip_direction(view, image.eye_in_world - view.eye_in_world) + Vec4::Z * view.near_m;
    GpuQuadWork {
        clip_from_inverse_depth: eye.to_array(),
        clip_from_column: column,
        clip_from_row: row,
        clip_from_corner: corner,
        width_px: image.size_px.x,
        first_sample,
        padding: [0; 2],
    }
}

/// The clip direction of a direction in the world. A point at distance 1 in it, times a weight, would add
/// `near · weight` to z. Reversed depth is `near / planar depth`, 1 at the near plane and 0 at infinity.
fn clip_direction(view: &PinholeCamera, direction: Vec3) -> Vec4 {
    let in_camera = view.world_from_camera.conjugate() * direction;
    let size = view.size_px.as_vec2();
    let depth = -in_camera.z;
    let column = view.focal_px.x * in_camera.x + view.principal_px.x * depth;
    let row = -view.focal_px.y * in_camera.y + view.principal_px.y * depth;
    Vec4::new(column * 2.0 / size.x - depth, depth - row * 2.0 / size.y, 0.0, depth)
}
