//! Rasterising with reversed depth, infinitely far: inverse depth comes out of the depth buffer exact.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use bytemuck::{Pod, Zeroable};
use depth_image::PinholeCamera;
use glam::{Mat4, Vec4};
use gpu::{Frame, Gpu, Templates};
use minijinja::context;
use wgpu::TextureFormat;

use crate::{
    GpuScene, RenderError,
    binding::layout_seen_by,
    cluster::Frustum,
    form::Shading,
    gpu_scene::{GpuObject, Traits, UNIFORM_STRIDE},
    known::{KNOWN_SLOTS, Known, LeaveOut},
    surfaces::Surfaces,
};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct PipelineKey {
    shading: Shading,
    surface_id: bool,
    depth_only: bool,
    wind: bool,
    traits: Traits,
    leave_out: Option<LeaveOut>,
    earlier: usize,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct RasterCamera {
    pub clip_from_world: [[f32; 4]; 4],
    pub eye_in_world: [f32; 3],
    pub scene_time_s: f32,
    pub near_m: f32,
    pub footprint: f32,
    pub padding_0: u32,
    pub padding_1: u32,
}

/// What to draw, besides from where.
#[derive(Clone, Copy)]
pub(crate) struct RasterWork<'a> {
    pub scene: &'a GpuScene,
    pub shading: Shading,
    pub scene_time_s: f32,
    pub surface_id: bool,
    /// What is not drawn; of a single camera.
    pub leave_out: Option<(LeaveOut, &'a Known)>,
    /// The first camera's place among the known ones.
    pub earlier: usize,
}

/// What all draws of a submission are bound to.
struct Groups {
    scene: wgpu::BindGroup,
    object: wgpu::BindGroup,
    textures: Vec<wgpu::BindGroup>,
    known: Option<wgpu::BindGroup>,
}

/// Pipelines for every combination that has been asked for.
pub(crate) struct Rasterizer {
    gpu: Arc<Gpu>,
    templates: Arc<Templates>,
    scene_layout: wgpu::BindGroupLayout,
    object_layout: wgpu::BindGroupLayout,
    texture_layout: wgpu::BindGroupLayout,
    known_layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    pipelines: Mutex<HashMap<PipelineKey, Arc<wgpu::RenderPipeline>>>,
}

impl Rasterizer {
    pub fn new(gpu: &Arc<Gpu>, templates: &Arc<Templates>) -> Self {
        Self {
            gpu: gpu.clone(),
            templates: templates.clone(),
            scene_layout: uniform_layout(gpu, "scene", &[true, false]),
            object_layout: uniform_layout(gpu, "object", &[true]),
            texture_layout: texture_layout(gpu),
            known_layout: layout_seen_by(gpu, "known samples", &KNOWN_SLOTS, wgpu::ShaderStages::FRAGMENT),
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                address_mode_u: wgpu::AddressMode::Repeat,
                address_mode_v: wgpu::AddressMode::Repeat,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                anisotropy_clamp: 4,
                ..Default::default()
            }),
            pipelines: Mutex::default(),
        }
    }

    /// Records one pass a camera, and one before it for what is in front where something is left out: a test that
    /// noted what it leaves out would write memory, and no fragment could be spared it by its depth.
    pub fn record(
        &self,
        frame: &mut Frame<'_>,
        work: RasterWork<'_>,
        cameras: &[PinholeCamera],
        surfaces: &[Surfaces],
    ) -> Result<(), RenderError> {
        let groups = Groups {
            scene: self.bind_scene(work, cameras),
            object: self.bind_object(work),
            textures: work.scene.textures.iter().map(|views| self.bind_textures(views)).collect(),
            known: work
                .leave_out
                .map(|(_, known)| known.bind(&self.gpu, &self.known_layout, &cameras[0], work.earlier)),
        };
        for (number, (camera, target)) in cameras.iter().zip(surfaces).enumerate() {
            if work.leave_out.is_some() {
                self.record_one(
                    frame,
                    RasterWork { leave_out: None, ..work },
                    (number, camera),
                    (target, true),
                    &groups,
                )?;
            }
            self.record_one(frame, work, (number, camera), (target, false), &groups)?;
        }
        Ok(())
    }

    fn record_one(
        &self,
        frame: &mut Frame<'_>,
        work: RasterWork<'_>,
        (number, camera): (usize, &PinholeCamera),
        (target, depth_only): (&Surfaces, bool),
        groups: &Groups,
    ) -> Result<(), RenderError> {
        let scene = work.scene;
        let colors = [Some(attachment(&target.surface)), target.ids().map(attachment)];
        let color_count = if depth_only { 0 } else { 1 + usize::from(work.surface_id) };
        let mut pass = frame.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("raster"),
            color_attachments: &colors[..color_count],
            depth_stencil_attachment: Some(depth_attachment(if depth_only { target.front() } else { &target.depth })),
            ..Default::default()
        });
        // Layers of a set are as large as its largest image.
        let size = camera.size_px.as_vec2();
        pass.set_viewport(0.0, 0.0, size.x, size.y, 0.0, 1.0);
        pass.set_vertex_buffer(0, scene.vertices.slice(..));
        pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.set_bind_group(0, &groups.scene, &[number as u32 * UNIFORM_STRIDE as u32]);
        if let Some(known) = groups.known.as_ref().filter(|_| work.leave_out.is_some()) {
            pass.set_bind_group(3, known, &[]);
        }
        let (mut traits, mut texture, mut object) = (None, None, None);
        for run in visible_runs(scene, &Frustum::of(camera)) {
            let draw = &scene.draws[run.draw];
            if traits.replace(draw.traits) != Some(draw.traits) {
                pass.set_pipeline(&*self.pipeline(work, draw.traits, depth_only)?);
            }
            if object.replace(draw.object) != Some(draw.object) {
                pass.set_bind_group(1, &groups.object, &[draw.object * UNIFORM_STRIDE as u32]);
            }
            if texture.replace(draw.texture) != Some(draw.texture) {
                pass.set_bind_group(2, &groups.textures[draw.texture as usize], &[]);
            }
            let first_primitive = run.first_index / 3;
            pass.draw_indexed(run.first_index..run.end_index, draw.base_vertex, first_primitive..first_primitive + 1);
        }
        Ok(())
    }

    fn bind_object(&self, work: RasterWork<'_>) -> wgpu::BindGroup {
        let size = std::num::NonZeroU64::new(size_of::<GpuObject>() as u64);
        let object = wgpu::BufferBinding { buffer: &work.scene.objects, offset: 0, size };
        let entries = [wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(object) }];
        let layout = &self.object_layout;
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("object"),
            layout,
            entries: &entries,
        })
    }

    fn bind_scene(&self, work: RasterWork<'_>, cameras: &[PinholeCamera]) -> wgpu::BindGroup {
        let mut bytes = vec![0; cameras.len() * UNIFORM_STRIDE as usize];
        for (slot, camera) in bytes.chunks_mut(UNIFORM_STRIDE as usize).zip(cameras) {
            let raster_camera = RasterCamera {
                clip_from_world: clip_from_world(camera).to_cols_array_2d(),
                eye_in_world: camera.eye_in_world.to_array(),
                scene_time_s: work.scene_time_s,
                near_m: camera.near_m,
                footprint: camera.focal_px.min_element().recip(),
                padding_0: 0,
                padding_1: 0,
            };
            slot[..size_of::<RasterCamera>()].copy_from_slice(bytemuck::bytes_of(&raster_camera));
        }
        let uniform = self.gpu.buffer_with("raster cameras", &bytes, wgpu::BufferUsages::UNIFORM);
        let scene = work.scene;
        let camera = wgpu::BufferBinding {
            buffer: &uniform,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<RasterCamera>() as u64),
        };
        let entries = [
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(camera) },
            wgpu::BindGroupEntry { binding: 1, resource: scene.surroundings.as_entire_binding() },
        ];
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene"),
            layout: &self.scene_layout,
            entries: &entries,
        })
    }

    fn bind_textures(&self, [base_color, metallic_roughness]: &[wgpu::TextureView; 2]) -> wgpu::BindGroup {
        let entries = [
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(base_color) },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(metallic_roughness) },
            wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(&self.sampler) },
        ];
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("textures"),
            layout: &self.texture_layout,
            entries: &entries,
        })
    }

    fn pipeline(
        &self,
        work: RasterWork<'_>,
        traits: Traits,
        depth_only: bool,
    ) -> Result<Arc<wgpu::RenderPipeline>, RenderError> {
        let RasterWork { shading, surface_id, .. } = work;
        let leave_out = work.leave_out.map(|(test, _)| test);
        let earlier = work.leave_out.map_or(0, |_| work.earlier);
        let key =
            PipelineKey { shading, surface_id, depth_only, wind: work.scene.is_animated(), traits, leave_out, earlier };
        let mut pipelines = self.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pipeline) = pipelines.get(&key) {
            return Ok(pipeline.clone());
        }
        let pipeline = Arc::new(self.build(key)?);
        pipelines.insert(key, pipeline.clone());
        Ok(pipeline)
    }

    fn build(&self, key: PipelineKey) -> Result<wgpu::RenderPipeline, RenderError> {
        let module = self.gpu.shader("raster", &self.templates.render("raster.wgsl", shader_context(key))?);
        let layouts = [&self.scene_layout, &self.object_layout, &self.texture_layout, &self.known_layout].map(Some);
        let layout = self.gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("raster"),
            bind_group_layouts: &layouts[..3 + usize::from(key.leave_out.is_some())],
            immediate_size: 0,
        });
        let color_count = if key.depth_only { 0 } else { 1 + usize::from(key.surface_id) };
        let formats = [Some(TextureFormat::Rgba32Uint.into()), Some(TextureFormat::Rg32Uint.into())];
        Ok(self.gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("raster"),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[Some(vertex_layout())],
            },
            primitive: wgpu::PrimitiveState {
                cull_mode: (!key.traits.double_sided).then_some(wgpu::Face::Back),
                ..Default::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: (!key.depth_only || key.traits.alpha_tested).then(|| wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &formats[..color_count],
            }),
            multiview_mask: None,
            cache: None,
        }))
    }
}

/// Neighbouring clusters drawn in one call, and the first of them.
struct Run {
    draw: usize,
    first_index: u32,
    end_index: u32,
}

fn visible_runs(scene: &GpuScene, frustum: &Frustum) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let visible = scene.draws.iter().enumerate().filter(|(_, draw)| frustum.may_see(&draw.bounds_in_world));
    for (number, draw) in visible {
        match runs.last_mut() {
            Some(run) if scene.draws[run.draw].joins(run.end_index, draw) => run.end_index += draw.index_count,
            _ => runs.push(Run {
                draw: number,
                first_index: draw.first_index,
                end_index: draw.first_index + draw.index_count,
            }),
        }
    }
    runs
}

/// Reversed depth: `near / planar depth`, 1 at the near plane and 0 at infinity.
fn clip_from_world(camera: &PinholeCamera) -> Mat4 {
    let [u, v, w] = camera.homogeneous_pixel_from_world();
    let size = camera.size_px.as_vec2();
    let rows = [u * (2.0 / size.x) - w, w - v * (2.0 / size.y), Vec4::W * camera.near_m, w];
    Mat4::from_cols_array_2d(&rows.map(|row| row.to_array())).transpose()
}

fn shader_context(key: PipelineKey) -> minijinja::Value {
    let Traits { double_sided, alpha_tested, textured, coat_textured, unlit, specular } = key.traits;
    context! {
        wind => key.wind, shading => key.shading.name(), surface_id => key.surface_id,
        depth_only => key.depth_only,
        double_sided, alpha_tested, textured, unlit, specular,
        coat_textured => coat_textured && key.shading == Shading::Ggx,
        leave_out => key.leave_out.map(|test| test.shader),
        test_traces_rays => false,
        settled => key.leave_out.is_some_and(|test| test.settled),
        earlier => key.earlier,
        known_group => 3,
    }
}

fn vertex_layout() -> wgpu::VertexBufferLayout<'static> {
    const ATTRIBUTES: [wgpu::VertexAttribute; 5] =
        wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2, 3 => Unorm8x4, 4 => Float32];
    wgpu::VertexBufferLayout {
        array_stride: size_of::<scene::Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &ATTRIBUTES,
    }
}

/// All bits of a word: no instance has this number.
const NOTHING: wgpu::Color = {
    let word = u32::MAX as f64;
    wgpu::Color { r: word, g: word, b: word, a: word }
};

fn attachment(view: &wgpu::TextureView) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(NOTHING), store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}

fn depth_attachment(view: &wgpu::TextureView) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store };
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops: Some(ops), stencil_ops: None }
}

/// Uniforms, each at a dynamic offset or not.
fn uniform_layout(gpu: &Gpu, label: &str, dynamic: &[bool]) -> wgpu::BindGroupLayout {
    let entry = |(binding, &has_dynamic_offset): (u32, &bool)| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset,
            min_binding_size: None,
        },
        count: None,
    };
    let entries: Vec<_> = (0..).zip(dynamic).map(entry).collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

fn texture_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let entry =
        |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let entries = [entry(0, texture), entry(1, texture), entry(2, sampler)];
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("textures"), entries: &entries })
}
