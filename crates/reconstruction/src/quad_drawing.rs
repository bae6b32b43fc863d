//! Draws a set's quads into the views of a batch: depth, and which sample is seen.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use depth_image::PinholeCamera;
use glam::{UVec2, Vec3, Vec4};
use gpu::{Frame, GpuError};
use wgpu::{BindingResource, BufferUsages, TextureFormat, TextureView, TextureViewDimension};

use crate::{
    ReconstructionError, ReconstructionMethod, Reconstructor, SampleSet, ShaderKey,
    layout::{GpuQuadWork, GpuViewCamera},
    quads::Mesh,
    shader_text,
};

/// Uniform offsets must be multiples of this on every device.
const STRIDE: u32 = 256;
const DEPTH: TextureFormat = TextureFormat::Depth32Float;
const SAMPLE: TextureFormat = TextureFormat::R32Uint;

/// Pipelines, for quads of samples and between samples, and what was drawn into last.
#[derive(Default)]
pub(crate) struct QuadDrawing {
    pipelines: Mutex<HashMap<bool, Arc<wgpu::RenderPipeline>>>,
    /// Batches follow one another on the device, and most are alike.
    targets: Mutex<Option<Arc<Targets>>>,
}

/// What views are drawn into, a layer each.
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
        Self { size_px, depth: layers("drawn depth", DEPTH), samples: layers("drawn samples", SAMPLE) }
    }

    fn holds(&self, size_px: UVec2, count: usize) -> bool {
        self.size_px == size_px && self.depth.each.len() >= count
    }

    /// As `resolve.wgsl` binds them.
    pub fn drawn(&self) -> [BindingResource<'_>; 2] {
        [&self.depth.all, &self.samples.all].map(BindingResource::TextureView)
    }
}

impl Reconstructor {
    /// All images' quads into every view; `None` of methods that draw none. Cuts the set when it is the first to ask.
    pub(crate) fn draw_mesh(
        &self,
        frame: &mut Frame<'_>,
        set: &SampleSet,
        cameras: &[PinholeCamera],
        method: ReconstructionMethod,
    ) -> Result<Option<Arc<Targets>>, ReconstructionError> {
        let Some(mesh) = self.mesh(set, method)? else { return Ok(None) };
        let pipeline = self.quad_pipeline(mesh.cut.is_hybrid())?;
        let targets = self.targets(cameras[0].size_px, cameras.len())?;
        let bound = self.bind_works(&pipeline, set, cameras);
        for number in 0..cameras.len() {
            let first_work = number * mesh.images.len();
            draw_view(frame, &pipeline, &bound, &mesh, (&targets, number), first_work as u32);
        }
        Ok(Some(targets))
    }

    fn targets(&self, size_px: UVec2, count: usize) -> Result<Arc<Targets>, GpuError> {
        let limits = self.gpu.device.limits();
        check_limit("a drawn view's side (px)", size_px.max_element(), limits.max_texture_dimension_2d)?;
        check_limit("views drawn together", count as u32, limits.max_texture_array_layers)?;
        let mut kept = self.drawing.targets.lock().unwrap_or_else(PoisonError::into_inner);
        let reused = kept.take().filter(|targets| targets.holds(size_px, count));
        Ok(kept.insert(reused.unwrap_or_else(|| Arc::new(Targets::new(&self.gpu.device, size_px, count)))).clone())
    }

    /// A uniform for each view and image.
    fn bind_works(
        &self,
        pipeline: &wgpu::RenderPipeline,
        set: &SampleSet,
        cameras: &[PinholeCamera],
    ) -> wgpu::BindGroup {
        let images = || set.meshes.cameras.iter().zip(&set.cameras);
        let pairs = cameras.iter().flat_map(|view| images().map(move |image| (view, image)));
        let mut bytes = Vec::with_capacity(cameras.len() * set.cameras.len() * STRIDE as usize);
        for (view, (image, sample_camera)) in pairs {
            let work = GpuQuadWork { first_sample: sample_camera.first_cell, ..quad_work(view, image) };
            bytes.extend_from_slice(bytemuck::bytes_of(&work));
            bytes.resize(bytes.len().next_multiple_of(STRIDE as usize), 0);
        }
        let works = self.gpu.buffer_with("quads of views", &bytes, BufferUsages::UNIFORM);
        let size = std::num::NonZeroU64::new(size_of::<GpuQuadWork>() as u64);
        let resource = BindingResource::Buffer(wgpu::BufferBinding { buffer: &works, offset: 0, size });
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("quads of views"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource }],
        })
    }

    fn quad_pipeline(&self, hybrid: bool) -> Result<Arc<wgpu::RenderPipeline>, ReconstructionError> {
        let mut pipelines = self.drawing.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = pipelines.get(&hybrid) {
            return Ok(pipeline.clone());
        }
        let key = ShaderKey { name: "quads.wgsl", hybrid, ..ShaderKey::default() };
        let pipeline = Arc::new(build(&self.gpu, &shader_text(&self.templates, key)?));
        pipelines.insert(hybrid, pipeline.clone());
        Ok(pipeline)
    }
}

fn check_limit(what: &str, needed: u32, limit: u32) -> Result<(), GpuError> {
    if needed > limit {
        return Err(GpuError::Limit { what: what.to_owned(), needed: needed.into(), limit: limit.into() });
    }
    Ok(())
}

fn draw_view(
    frame: &mut Frame<'_>,
    pipeline: &wgpu::RenderPipeline,
    bound: &wgpu::BindGroup,
    mesh: &Mesh,
    (targets, layer): (&Targets, usize),
    first_work: u32,
) {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store };
    let depth_ops = wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store };
    let samples = wgpu::RenderPassColorAttachment {
        view: &targets.samples.each[layer],
        depth_slice: None,
        resolve_target: None,
        ops,
    };
    let mut pass = frame.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("quads"),
        color_attachments: &[Some(samples)],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &targets.depth.each[layer],
            depth_ops: Some(depth_ops),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    pass.set_pipeline(pipeline);
    for (work, image) in (first_work..).zip(&mesh.images) {
        pass.set_bind_group(0, bound, &[work * STRIDE]);
        pass.set_vertex_buffer(0, image.inverse_depths.slice(..));
        pass.set_index_buffer(image.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed_indirect(&image.draw, 0);
    }
}

/// But for where the image's samples begin.
fn quad_work(view: &PinholeCamera, image: &PinholeCamera) -> GpuQuadWork {
    let rays = GpuViewCamera::of(image, 0, UVec2::ONE, 0);
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

/// Of a direction in the world; a point at distance 1 in it, times a weight, would add `near · weight` to z: reversed
/// depth is `near / planar depth`, 1 at the near plane and 0 at infinity.
fn clip_direction(view: &PinholeCamera, direction: Vec3) -> Vec4 {
    let in_camera = view.world_from_camera.conjugate() * direction;
    let (size, depth) = (view.size_px.as_vec2(), -in_camera.z);
    let column = view.focal_px.x * in_camera.x + view.principal_px.x * depth;
    let row = -view.focal_px.y * in_camera.y + view.principal_px.y * depth;
    Vec4::new(column * 2.0 / size.x - depth, depth - row * 2.0 / size.y, 0.0, depth)
}

fn build(gpu: &gpu::Gpu, wgsl: &str) -> wgpu::RenderPipeline {
    let module = gpu.shader("quads", wgsl);
    let layout = layout(gpu);
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("quads"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: 4,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32],
            })],
        },
        // Both faces: a view may see a surface from behind its sample camera.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(SAMPLE.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// One uniform at a dynamic offset.
fn layout(gpu: &gpu::Gpu) -> wgpu::PipelineLayout {
    let entry = wgpu::BindGroupLayoutEntry {
        binding: 0,
        visibility: wgpu::ShaderStages::VERTEX,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: None,
        },
        count: None,
    };
    let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("quads"), entries: &[entry] };
    let group = gpu.device.create_bind_group_layout(&descriptor);
    gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("quads"),
        bind_group_layouts: &[Some(&group)],
        immediate_size: 0,
    })
}
