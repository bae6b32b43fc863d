//! Bind groups from lists of what is bound.

use std::num::NonZeroU64;

use gpu::Gpu;
use wgpu::{BindingResource, BindingType, BufferBindingType, StorageTextureAccess, TextureFormat, TextureSampleType};

/// What a compute shader has at one binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Slot {
    /// One camera of many, by an offset.
    DynamicUniform,
    Uniform,
    Read,
    Written,
    WordTexture,
    WordTextureArray,
    FloatTexture,
    DepthTexture,
    WrittenTexture(TextureFormat),
}

impl Slot {
    fn binding_type(self) -> BindingType {
        let buffer = |ty, has_dynamic_offset| BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None };
        let texture_of =
            |sample_type, view_dimension| BindingType::Texture { sample_type, view_dimension, multisampled: false };
        let texture = |sample_type| texture_of(sample_type, wgpu::TextureViewDimension::D2);
        match self {
            Self::DynamicUniform => buffer(BufferBindingType::Uniform, true),
            Self::Uniform => buffer(BufferBindingType::Uniform, false),
            Self::Read => buffer(BufferBindingType::Storage { read_only: true }, false),
            Self::Written => buffer(BufferBindingType::Storage { read_only: false }, false),
            Self::WordTexture => texture(TextureSampleType::Uint),
            Self::WordTextureArray => texture_of(TextureSampleType::Uint, wgpu::TextureViewDimension::D2Array),
            Self::FloatTexture => texture(TextureSampleType::Float { filterable: false }),
            Self::DepthTexture => texture(TextureSampleType::Depth),
            Self::WrittenTexture(format) => BindingType::StorageTexture {
                access: StorageTextureAccess::WriteOnly,
                format,
                view_dimension: wgpu::TextureViewDimension::D2,
            },
        }
    }
}

pub(crate) fn group_layout(gpu: &Gpu, label: &str, slots: &[Slot]) -> wgpu::BindGroupLayout {
    layout_seen_by(gpu, label, slots, wgpu::ShaderStages::COMPUTE)
}

pub(crate) fn layout_seen_by(
    gpu: &Gpu,
    label: &str,
    slots: &[Slot],
    visibility: wgpu::ShaderStages,
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(slots)
        .map(|(binding, slot)| wgpu::BindGroupLayoutEntry { binding, visibility, ty: slot.binding_type(), count: None })
        .collect();
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// Binds resources at 0, 1, 2….
pub(crate) fn bind_group<'r>(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: impl IntoIterator<Item = BindingResource<'r>>,
) -> wgpu::BindGroup {
    let entries: Vec<_> =
        (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// The first `bytes` of a buffer: what a dynamic offset is added to.
pub(crate) fn window(buffer: &wgpu::Buffer, bytes: usize) -> BindingResource<'_> {
    BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size: NonZeroU64::new(bytes as u64) })
}

pub(crate) fn texture(view: &wgpu::TextureView) -> BindingResource<'_> {
    BindingResource::TextureView(view)
}
