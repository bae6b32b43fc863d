//! A drawing shader that is bound by name. Depth is reversed: 1 at the near plane, 0 at infinity.

use std::ops::Deref;

use wgpu::{RenderPipeline, ShaderStages, TextureFormat};

use super::compiled::Shader;
use super::variant::{Pass, ShaderVariant};
use crate::device::Gpu;

/// A render pipeline with its layout. The shader's entry points are `vertex` and, unless it draws depth alone, `fragment`.
pub struct DrawPass {
    shader: Shader,
    pipeline: RenderPipeline,
}

/// The fixed functions of a drawing variant.
pub struct DrawState {
    /// The attributes of vertices.
    pub vertices: wgpu::VertexBufferLayout<'static>,
    /// The side of triangles that is not drawn.
    pub cull_mode: Option<wgpu::Face>,
    /// The colour targets, besides depth.
    pub color_formats: Vec<TextureFormat>,
}

/// A variant of a drawing shader.
pub trait DrawVariant: ShaderVariant {
    /// Its fixed functions.
    fn state(&self) -> DrawState;
}

impl DrawPass {
    /// The format of depth targets.
    pub const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

    /// The pipeline, to be set in a render pass.
    #[must_use]
    pub fn pipeline(&self) -> &RenderPipeline {
        &self.pipeline
    }
}

impl Deref for DrawPass {
    type Target = Shader;
    fn deref(&self) -> &Shader {
        &self.shader
    }
}

impl<V: DrawVariant> Pass<V> for DrawPass {
    fn build(gpu: &Gpu, shader: Shader, variant: &V) -> Self {
        let DrawState { vertices, cull_mode, color_formats } = variant.state();
        let targets: Vec<_> = color_formats.into_iter().map(|format| Some(format.into())).collect();
        let fragment = shader.interface.stages.contains(ShaderStages::FRAGMENT).then(|| wgpu::FragmentState {
            module: &shader.module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &targets,
        });
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(&shader.interface.shader),
            layout: Some(&shader.layout),
            vertex: wgpu::VertexState {
                module: &shader.module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[Some(vertices)],
            },
            primitive: wgpu::PrimitiveState { cull_mode, ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: Self::DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment,
            multiview_mask: None,
            cache: None,
        });
        Self { shader, pipeline }
    }
}
