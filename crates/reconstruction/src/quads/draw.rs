//! Draws a mesh into the views of a batch: depth, and the sample that is seen.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use depth_image::PinholeCamera;
use glam::{UVec2, Vec3, Vec4};
use gpu::{
    Binding, DrawPass, DrawState, DrawVariant, Frame, Gpu, GpuError, PassCache, ResourceTrait, ResourceTraits,
    ShaderVariant, Templates, uniform_elements, uniform_stride,
};
use minijinja::{Value, context};
use parking_lot::Mutex;
use wgpu::{BufferUsages, TextureFormat, TextureView, TextureViewDimension};

use super::mesh::{Mesh, QuadVertices};
use crate::{error::ReconstructionError, recording::Recording, view_work::GpuViewCamera};

pub(super) const SHADER: (&str, &str) = ("draw.wgsl", include_str!("draw.wgsl"));

const SAMPLE_FORMAT: TextureFormat = TextureFormat::R32Uint;
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

/// The switch of `draw.wgsl`.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct DrawQuads(QuadVertices);

impl ShaderVariant for DrawQuads {
    const TEMPLATE: &'static str = SHADER.0;
    const TRAITS: ResourceTraits = &[("work", ResourceTrait::DynamicOffset)];

    fn context(&self) -> Value {
        context! { at_texel_corners => self.0.are_at_texel_corners() }
    }

    fn all() -> Vec<Self> {
        QuadVertices::ALL.map(Self).to_vec()
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
        DrawState { vertices, cull_mode: None, color_formats: vec![SAMPLE_FORMAT] }
    }
}

/// Drawing passes, and the targets of the last batch.
pub(crate) struct QuadDrawing {
    passes: PassCache<DrawQuads, DrawPass>,
    /// Batches follow one another on the device, and most are alike.
    targets: Mutex<Option<Arc<Targets>>>,
}

/// The textures that views are drawn into, a layer each.
pub(crate) struct Targets {
    size_px: UVec2,
    depth: Layers,
    samples: Layers,
}

struct Layers {
    all: TextureView,
    each: Vec<TextureView>,
}

impl Layers {
    fn new(device: &wgpu::Device, label: &str, format: TextureFormat, size_px: UVec2, count: usize) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: size_px.x, height: size_px.y, depth_or_array_layers: count as u32 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let view = |dimension, base_array_layer, count| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(dimension),
                base_array_layer,
                array_layer_count: Some(count),
                ..Default::default()
            })
        };
        Self {
            all: view(TextureViewDimension::D2Array, 0, count as u32),
            each: (0..count as u32).map(|layer| view(TextureViewDimension::D2, layer, 1)).collect(),
        }
    }
}

impl Targets {
    fn new(device: &wgpu::Device, size_px: UVec2, count: usize) -> Self {
        let layers = |label, format| Layers::new(device, label, format, size_px, count);
        let depth = layers("drawn depth", DrawPass::DEPTH_FORMAT);
        Self { size_px, depth, samples: layers("drawn samples", SAMPLE_FORMAT) }
    }

    fn holds(&self, size_px: UVec2, count: usize) -> bool {
        self.size_px == size_px && self.depth.each.len() >= count
    }

    /// As `resolve.wgsl` reads them.
    pub fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::texture("drawn_depth", &self.depth.all), Binding::texture("drawn_sample", &self.samples.all)]
    }
}

impl QuadDrawing {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self { passes: PassCache::new(gpu, templates), targets: Mutex::default() }
    }

    /// Targets for `count` views: those of the last batch, where they fit.
    fn targets(&self, gpu: &Gpu, size_px: UVec2, count: usize) -> Result<Arc<Targets>, GpuError> {
        let limits = gpu.device.limits();
        let (side_px, layers) = (limits.max_texture_dimension_2d, limits.max_texture_array_layers);
        GpuError::check_limit("a drawn view's side (px)", size_px.max_element().into(), side_px.into())?;
        GpuError::check_limit("views drawn together", count as u64, layers.into())?;
        let mut kept = self.targets.lock();
        let reused = kept.take().filter(|targets| targets.holds(size_px, count));
        Ok(kept.insert(reused.unwrap_or_else(|| Arc::new(Targets::new(&gpu.device, size_px, count)))).clone())
    }
}

/// Draws all images' quads into every view.
pub(super) fn record(
    drawing: &QuadDrawing,
    recording: &mut Recording<'_>,
    mesh: &Mesh,
) -> Result<Arc<Targets>, ReconstructionError> {
    let gpu = &recording.device.gpu;
    let pass = drawing.passes.get(&DrawQuads(mesh.cut.vertices))?;
    let targets = drawing.targets(gpu, recording.batch.size_px, recording.batch.cameras.len())?;
    let works = gpu.buffer_with("quads of views", &quad_works(recording), BufferUsages::UNIFORM);
    let bound = pass.bind(0, [Binding::buffer("work", &works)])?;
    for view in 0..recording.batch.cameras.len() {
        draw_view(&mut recording.frame, &pass, &bound, mesh, (&targets, view));
    }
    Ok(targets)
}

fn draw_view(
    frame: &mut Frame<'_>,
    pipeline: &DrawPass,
    bound: &wgpu::BindGroup,
    mesh: &Mesh,
    (targets, view): (&Targets, usize),
) {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
    let depth_ops = wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store };
    let samples = wgpu::RenderPassColorAttachment {
        view: &targets.samples.each[view],
        depth_slice: None,
        resolve_target: None,
        ops,
    };
    let mut pass = frame.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("quads"),
        color_attachments: &[Some(samples)],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &targets.depth.each[view],
            depth_ops: Some(depth_ops),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    pass.set_pipeline(pipeline.pipeline());
    let first_work = view * mesh.images.len();
    for (work, image) in (first_work as u32..).zip(&mesh.images) {
        pass.set_bind_group(0, bound, &[work * uniform_stride(size_of::<GpuQuadWork>() as u32)]);
        pass.set_vertex_buffer(0, image.inverse_depths.slice(..));
        pass.set_index_buffer(image.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed_indirect(&image.draw, 0);
    }
}

/// A uniform for each view and image.
fn quad_works(recording: &Recording<'_>) -> Vec<u8> {
    let set = recording.set;
    let images = || set.meshes.cameras.iter().zip(&set.cameras);
    let pairs = recording.batch.cameras.iter().flat_map(|view| images().map(move |image| (view, image)));
    uniform_elements(pairs.map(|(view, (image, sample_camera))| {
        let work = GpuQuadWork { first_sample: sample_camera.first_cell, ..quad_work(view, image) };
        bytemuck::bytes_of(&work).to_vec()
    }))
}

/// Without the place of the image's samples.
fn quad_work(view: &PinholeCamera, image: &PinholeCamera) -> GpuQuadWork {
    let rays = GpuViewCamera::of(image, 0);
    let clip_of = |direction: Vec3| clip_direction(view, direction).to_array();
    // As a difference of eyes: nothing is lost far from the origin.
    let eye = clip_direction(view, image.eye_in_world - view.eye_in_world) + Vec4::Z * view.near_m;
    GpuQuadWork {
        clip_from_inverse_depth: eye.to_array(),
        clip_from_column: clip_of(rays.column_in_world.into()),
        clip_from_row: clip_of(rays.row_in_world.into()),
        clip_from_corner: clip_of(rays.corner_in_world.into()),
        width_px: image.size_px.x,
        first_sample: 0,
        padding: [0; 2],
    }
}

/// The clip direction of a direction in the world. A point at distance 1 in it, times a weight, would add
/// `near · weight` to z. Reversed depth is `near / planar depth`, 1 at the near plane and 0 at infinity.
fn clip_direction(view: &PinholeCamera, direction: Vec3) -> Vec4 {
    let in_camera = view.world_from_camera.conjugate() * direction;
    let (size, depth) = (view.size_px.as_vec2(), -in_camera.z);
    let column = view.focal_px.x * in_camera.x + view.principal_px.x * depth;
    let row = -view.focal_px.y * in_camera.y + view.principal_px.y * depth;
    Vec4::new(column * 2.0 / size.x - depth, depth - row * 2.0 / size.y, 0.0, depth)
}
