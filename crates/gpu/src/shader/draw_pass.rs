//! A drawing shader that is bound by name. Depth is reversed: 1 at the near plane, 0 at infinity.

use std::ops::Deref;

use wgpu::{BufferUsages, CompareFunction, RenderPipeline, ShaderStages, TextureFormat, TextureUsages};

use super::bound_group::BoundGroup;
use super::compiled::Shader;
use super::variant::{Pass, ShaderVariant};
use super::warming::FirstUses;
use crate::sharing::Turn;
use crate::{device::Gpu, error::GpuError, frame::Frame};

/// A render pipeline with its layout. The shader's entry points are `vertex` and, unless it draws depth alone, `fragment`.
pub struct DrawPass {
    shader: Shader,
    pipeline: RenderPipeline,
    state: DrawState,
    first_uses: FirstUses,
}

/// The fixed functions of a drawing variant.
#[derive(Clone)]
pub struct DrawState {
    /// The attributes of vertices, one layout for each vertex buffer.
    pub vertices: Vec<wgpu::VertexBufferLayout<'static>>,
    /// The side of triangles that is not drawn.
    pub cull_mode: Option<wgpu::Face>,
    /// The colour targets, besides depth.
    pub color_formats: Vec<TextureFormat>,
    /// Only what is nearest is drawn; else everything is, and depth stays as it was.
    pub nearest_only: bool,
}

/// A variant of a drawing shader.
pub trait DrawVariant: ShaderVariant {
    /// Its fixed functions.
    fn state(&self) -> DrawState;
}

impl DrawPass {
    /// The format of depth targets.
    pub const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

    fn new(gpu: &Gpu, shader: Shader, state: DrawState) -> Self {
        let targets: Vec<_> = state.color_formats.iter().map(|&format| Some(format.into())).collect();
        let fragment = shader.interface.stages.contains(ShaderStages::FRAGMENT).then(|| wgpu::FragmentState {
            module: &shader.module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &targets,
        });
        let depth_compare = if state.nearest_only { CompareFunction::Greater } else { CompareFunction::Always };
        let buffers: Vec<_> = state.vertices.iter().cloned().map(Some).collect();
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(&shader.interface.shader),
            layout: Some(&shader.layout),
            vertex: wgpu::VertexState {
                module: &shader.module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &buffers,
            },
            primitive: wgpu::PrimitiveState { cull_mode: state.cull_mode, ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: Self::DEPTH_FORMAT,
                depth_write_enabled: Some(state.nearest_only),
                depth_compare: Some(depth_compare),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment,
            multiview_mask: None,
            cache: None,
        });
        Self { shader, pipeline, state, first_uses: FirstUses::default() }
    }

    /// Says that a pass of the frame will draw with this pipeline and these groups: all, from 0. It has to be said before the
    /// pass begins.
    pub fn announce(&self, frame: &mut Frame<'_>, groups: &[&BoundGroup]) {
        self.first_uses.make_ready(frame, &self.shader, groups, |gpu, shader, groups| {
            Self::new(gpu, shader, self.state.clone()).draw_nothing(gpu, groups)
        });
    }

    /// Draws one triangle of no extent, for which the device compiles the shader.
    fn draw_nothing(&self, gpu: &Gpu, groups: &[BoundGroup]) -> Result<(), GpuError> {
        let colors: Vec<_> = self.state.color_formats.iter().map(|&format| small_target(gpu, format)).collect();
        let corners = gpu.buffer("nothing", 1024, BufferUsages::VERTEX | BufferUsages::INDEX);
        let mut frame = Frame::begin(gpu, "compile", Turn::default());
        let colors: Vec<_> = colors.iter().collect();
        let depth = small_target(gpu, Self::DEPTH_FORMAT);
        let mut pass = frame.begin_drawing("compile", &colors, Some(wgpu::Color::TRANSPARENT), &depth);
        pass.set_pipeline(&self.pipeline);
        (0..self.state.vertices.len() as u32).for_each(|slot| pass.set_vertex_buffer(slot, corners.slice(..)));
        pass.set_index_buffer(corners.slice(..), wgpu::IndexFormat::Uint32);
        for (number, bound) in groups.iter().enumerate() {
            let offsets: Vec<u32> = self.shader.interface.strides(number).map(|_| 0).collect();
            pass.set_bind_group(number as u32, &**bound, &offsets);
        }
        pass.draw_indexed(0..3, 0, 0..1);
        drop(pass);
        frame.submit()?.wait().map(drop)
    }

    /// The pipeline, to be set in a render pass.
    #[must_use]
    pub fn pipeline(&self) -> &RenderPipeline {
        &self.pipeline
    }
}

fn small_target(gpu: &Gpu, format: TextureFormat) -> wgpu::TextureView {
    let texture = gpu.texture("nothing", [4, 4, 1], format, TextureUsages::RENDER_ATTACHMENT);
    texture.create_view(&Default::default())
}

impl Deref for DrawPass {
    type Target = Shader;
    fn deref(&self) -> &Shader {
        &self.shader
    }
}

impl<V: DrawVariant> Pass<V> for DrawPass {
    fn build(gpu: &Gpu, shader: Shader, variant: &V) -> Self {
        Self::new(gpu, shader, variant.state())
    }
}
