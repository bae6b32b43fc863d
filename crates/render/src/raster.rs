//! Rasterising with reversed depth, infinitely far: inverse depth comes out of the depth buffer exact.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};

use bytemuck::{Pod, Zeroable};
use depth_image::{
    Camera, DepthImage, PinholeCamera, Provenance, ProvenanceKind, SurfaceId, View, ViewPlanes, rgb9e5_from_linear,
};
use glam::{Mat4, Vec4};
use gpu::{BufferPool, Frame, FrameResult, Gpu, Templates};
use minijinja::context;
use wgpu::TextureFormat;

use crate::{
    GpuScene, Lighting, RenderError,
    cluster::Frustum,
    gpu_scene::{GpuObject, Traits, UNIFORM_STRIDE},
    targets::{HostPlane, Target},
};

/// Views or samples in one submission; bounds the memory for read-back.
const CAMERAS_A_SUBMISSION: usize = 32;
const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// What to draw besides the cameras.
#[derive(Clone, Copy)]
pub struct DrawWork<'a> {
    /// From where.
    pub scene: &'a GpuScene,
    /// How it is lit.
    pub lighting: Lighting,
    /// Which moment of an animated scene.
    pub scene_time_s: f32,
}

/// Optional planes of depth images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct SamplePlanes {
    /// [`DepthImage::normal_oct16`].
    pub normal: bool,
    /// [`DepthImage::surface_id`].
    pub surface_id: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Output {
    View,
    Samples(SamplePlanes),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct PipelineKey {
    output: Output,
    lighting: Lighting,
    wind: bool,
    lights: usize,
    traits: Traits,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct RasterCamera {
    pub clip_from_world: [[f32; 4]; 4],
    pub eye_in_world: [f32; 3],
    pub scene_time_s: f32,
}

/// What all draws of a submission are bound to.
struct Groups {
    scene: wgpu::BindGroup,
    object: wgpu::BindGroup,
    textures: Vec<wgpu::BindGroup>,
}

/// Pipelines for every combination that has been asked for.
pub struct Rasterizer {
    gpu: Arc<Gpu>,
    pool: BufferPool,
    templates: Templates,
    scene_layout: wgpu::BindGroupLayout,
    object_layout: wgpu::BindGroupLayout,
    texture_layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    pipelines: Mutex<HashMap<PipelineKey, Arc<wgpu::RenderPipeline>>>,
}

impl Rasterizer {
    /// Pipelines are built when first used.
    ///
    /// # Errors
    /// When a shader template is broken.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self, RenderError> {
        Ok(Self {
            gpu: gpu.clone(),
            pool: BufferPool::new(gpu),
            templates: Templates::new(crate::SHADERS)?,
            scene_layout: uniform_layout(gpu, "scene", &[true, false]),
            object_layout: uniform_layout(gpu, "object", &[true]),
            texture_layout: texture_layout(gpu),
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
        })
    }

    /// Finished views: the method `direct`. Provenance of a surface is a hit without cameras.
    ///
    /// # Errors
    /// A camera that is not valid (all are checked first), or the device.
    pub fn draw_views(
        &self,
        work: DrawWork<'_>,
        cameras: &[PinholeCamera],
        planes: ViewPlanes,
    ) -> Result<Vec<View>, RenderError> {
        self.check(cameras.iter())?;
        let mut views = Vec::with_capacity(cameras.len());
        for batch in cameras.chunks(CAMERAS_A_SUBMISSION) {
            let formats = [TextureFormat::Rgba8UnormSrgb];
            let with_depth = planes.inverse_depth || planes.provenance;
            let (result, drawn) = self.draw(work, batch, Output::View, &formats, with_depth)?;
            for (camera, planes_drawn) in batch.iter().zip(drawn) {
                views.push(view(camera, &result, &planes_drawn, planes)?);
            }
        }
        Ok(views)
    }

    /// Conventional depth images, in as few submissions as memory allows.
    ///
    /// # Errors
    /// A camera that is not valid, or the device (surface ids need its primitive index).
    pub fn draw_depth_images(
        &self,
        work: DrawWork<'_>,
        cameras: &[Camera],
        planes: SamplePlanes,
    ) -> Result<Vec<DepthImage>, RenderError> {
        let pinholes: Vec<PinholeCamera> = cameras.iter().map(|Camera::Pinhole(camera)| *camera).collect();
        self.check(pinholes.iter())?;
        let mut formats = vec![TextureFormat::R32Uint];
        formats.extend(planes.normal.then_some(TextureFormat::R32Uint));
        formats.extend(planes.surface_id.then_some(TextureFormat::Rg32Uint));
        let mut images = Vec::with_capacity(cameras.len());
        for batch in pinholes.chunks(CAMERAS_A_SUBMISSION) {
            let (result, drawn) = self.draw(work, batch, Output::Samples(planes), &formats, true)?;
            for (camera, host) in batch.iter().zip(drawn) {
                images.push(depth_image(camera, &result, &host, planes)?);
            }
        }
        Ok(images)
    }

    fn check<'c>(&self, cameras: impl Iterator<Item = &'c PinholeCamera>) -> Result<(), RenderError> {
        let limit = u64::from(self.gpu.device.limits().max_texture_dimension_2d);
        for (index, camera) in cameras.enumerate() {
            camera.validate().map_err(|source| RenderError::Camera { index, source })?;
            let needed = u64::from(camera.size_px.max_element());
            if needed > limit {
                return Err(gpu::GpuError::Limit { what: format!("camera {index}'s image side"), needed, limit }.into());
            }
        }
        Ok(())
    }

    /// One submission: every camera into the same targets, one after another. Planes come in the order
    /// of `formats`, then depth.
    fn draw(
        &self,
        work: DrawWork<'_>,
        cameras: &[PinholeCamera],
        output: Output,
        formats: &[TextureFormat],
        copy_depth: bool,
    ) -> Result<(FrameResult, Vec<Vec<HostPlane>>), RenderError> {
        let groups = Groups {
            scene: self.bind_scene(work, cameras),
            object: self.bind_object(work),
            textures: work.scene.textures.iter().map(|view| self.bind_texture(view)).collect(),
        };
        let mut frame = Frame::begin(&self.gpu, "raster");
        let mut host_planes = Vec::with_capacity(cameras.len());
        let mut targets: Vec<Target> = Vec::new();
        for (index, camera) in cameras.iter().enumerate() {
            if index == 0 || cameras[index - 1].size_px != camera.size_px {
                targets = formats
                    .iter()
                    .chain([&DEPTH_FORMAT])
                    .map(|&format| Target::new(&self.gpu, camera.size_px, format))
                    .collect();
            }
            self.record(&mut frame, work, (index, camera), output, &targets, &groups)?;
            let copied = if copy_depth { &targets[..] } else { &targets[..formats.len()] };
            host_planes.push(copied.iter().map(|target| target.copy_out(&mut frame, &self.pool)).collect());
        }
        Ok((frame.submit().wait()?, host_planes))
    }

    fn record(
        &self,
        frame: &mut Frame<'_>,
        work: DrawWork<'_>,
        (number, camera): (usize, &PinholeCamera),
        output: Output,
        targets: &[Target],
        groups: &Groups,
    ) -> Result<(), RenderError> {
        let scene = work.scene;
        let (depth, colors) = targets.split_last().expect("depth is always there");
        let clear = clear_colors(scene, output);
        let attachments: Vec<_> =
            colors.iter().zip(clear).map(|(target, color)| Some(attachment(target, color))).collect();
        let mut pass = frame.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("raster"),
            color_attachments: &attachments,
            depth_stencil_attachment: Some(depth_attachment(depth)),
            ..Default::default()
        });
        pass.set_vertex_buffer(0, scene.vertices.slice(..));
        pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.set_bind_group(0, &groups.scene, &[number as u32 * UNIFORM_STRIDE as u32]);
        let (mut traits, mut texture, mut object) = (None, None, None);
        for run in visible_runs(scene, &Frustum::of(camera)) {
            let draw = &scene.draws[run.draw];
            if traits.replace(draw.traits) != Some(draw.traits) {
                pass.set_pipeline(&*self.pipeline(work, output, draw.traits)?);
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

    fn bind_object(&self, work: DrawWork<'_>) -> wgpu::BindGroup {
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

    fn bind_scene(&self, work: DrawWork<'_>, cameras: &[PinholeCamera]) -> wgpu::BindGroup {
        let mut bytes = vec![0; cameras.len() * UNIFORM_STRIDE as usize];
        for (slot, camera) in bytes.chunks_mut(UNIFORM_STRIDE as usize).zip(cameras) {
            let raster_camera = RasterCamera {
                clip_from_world: clip_from_world(camera).to_cols_array_2d(),
                eye_in_world: camera.eye_in_world.to_array(),
                scene_time_s: work.scene_time_s,
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

    fn bind_texture(&self, view: &wgpu::TextureView) -> wgpu::BindGroup {
        let entries = [
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(view) },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&self.sampler) },
        ];
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("texture"),
            layout: &self.texture_layout,
            entries: &entries,
        })
    }

    fn pipeline(
        &self,
        work: DrawWork<'_>,
        output: Output,
        traits: Traits,
    ) -> Result<Arc<wgpu::RenderPipeline>, RenderError> {
        let key = PipelineKey {
            output,
            lighting: work.lighting,
            wind: work.scene.is_animated(),
            lights: work.scene.light_count,
            traits,
        };
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
        let layouts = [Some(&self.scene_layout), Some(&self.object_layout), Some(&self.texture_layout)];
        let layout = self.gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("raster"),
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let targets: Vec<_> = color_formats(key.output).into_iter().map(|format| Some(format.into())).collect();
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
                format: DEPTH_FORMAT,
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
                targets: &targets,
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

fn color_formats(output: Output) -> Vec<TextureFormat> {
    match output {
        Output::View => vec![TextureFormat::Rgba8UnormSrgb],
        Output::Samples(planes) => {
            let optional =
                [planes.normal.then_some(TextureFormat::R32Uint), planes.surface_id.then_some(TextureFormat::Rg32Uint)];
            std::iter::once(TextureFormat::R32Uint).chain(optional.into_iter().flatten()).collect()
        }
    }
}

fn shader_context(key: PipelineKey) -> minijinja::Value {
    let planes = match key.output {
        Output::View => None,
        Output::Samples(planes) => Some(planes),
    };
    let SamplePlanes { normal, surface_id } = planes.unwrap_or_default();
    let Traits { double_sided, alpha_tested, textured, unlit, specular } = key.traits;
    context! {
        wind => key.wind, lights => key.lights, lit => key.lighting != Lighting::Unlit && !unlit, samples => planes.is_some(),
        double_sided, alpha_tested, textured, specular,
        normal, surface_id, normal_location => 1, id_location => 1 + u32::from(normal),
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

fn attachment(target: &Target, clear: wgpu::Color) -> wgpu::RenderPassColorAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(clear), store: wgpu::StoreOp::Store };
    wgpu::RenderPassColorAttachment { view: &target.view, depth_slice: None, resolve_target: None, ops }
}

fn depth_attachment(target: &Target) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store };
    wgpu::RenderPassDepthStencilAttachment { view: &target.view, depth_ops: Some(ops), stencil_ops: None }
}

/// Background colour first; the other planes mean nothing there.
fn clear_colors(scene: &GpuScene, output: Output) -> impl Iterator<Item = wgpu::Color> {
    let background = scene.background_linear.as_dvec3();
    let first = match output {
        Output::View => wgpu::Color { r: background.x, g: background.y, b: background.z, a: 1.0 },
        Output::Samples(_) => {
            wgpu::Color { r: f64::from(rgb9e5_from_linear(scene.background_linear)), ..wgpu::Color::TRANSPARENT }
        }
    };
    std::iter::once(first).chain(std::iter::repeat(wgpu::Color::TRANSPARENT))
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
    let entries = [entry(0, texture), entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering))];
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("texture"), entries: &entries })
}

fn view(
    camera: &PinholeCamera,
    result: &FrameResult,
    host: &[HostPlane],
    planes: ViewPlanes,
) -> Result<View, RenderError> {
    let scale = camera.near_m.recip();
    let inverse_depth = match host.get(1) {
        Some(depth) => Some(depth.collect(result, |depth: f32| depth * scale)?),
        None => None,
    };
    let hit = |&inverse: &f32| if inverse > 0.0 { Provenance::new(ProvenanceKind::Hit, 0) } else { Provenance::EMPTY };
    Ok(View {
        size_px: camera.size_px,
        srgb8: host[0].collect_rgb(result)?,
        provenance: inverse_depth.as_ref().filter(|_| planes.provenance).map(|plane| plane.iter().map(hit).collect()),
        inverse_depth_per_m: inverse_depth.filter(|_| planes.inverse_depth),
    })
}

fn depth_image(
    camera: &PinholeCamera,
    result: &FrameResult,
    host: &[HostPlane],
    planes: SamplePlanes,
) -> Result<DepthImage, RenderError> {
    let scale = camera.near_m.recip();
    let (depth, colors) = host.split_last().expect("depth is always copied");
    let id_plane = 1 + usize::from(planes.normal);
    Ok(DepthImage {
        camera: Camera::Pinhole(*camera),
        inverse_depth_per_m: depth.collect(result, |depth: f32| depth * scale)?,
        color_rgb9e5: colors[0].collect(result, |color: u32| color)?,
        normal_oct16: planes.normal.then(|| colors[1].collect(result, |n: u32| n)).transpose()?,
        surface_id: planes.surface_id.then(|| colors[id_plane].collect(result, |id: SurfaceId| id)).transpose()?,
    })
}
