//! What shaders find at their bindings.

use wgpu::BindingResource;

use super::Reconstructor;
use crate::ShaderKey;

/// What a shader finds at a binding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Slot {
    /// The view's uniform, at a dynamic offset.
    View,
    Uniform,
    Read,
    Write,
    /// See `word_texture`.
    Words,
    /// A layer for each view of a batch: what of its depth was drawn, and of which samples.
    DrawnDepth,
    DrawnSamples,
}

impl Slot {
    fn ty(self) -> wgpu::BindingType {
        let buffer =
            |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: self == Self::View, min_binding_size: None };
        let texture = |sample_type, view_dimension| wgpu::BindingType::Texture {
            sample_type,
            view_dimension,
            multisampled: false,
        };
        match self {
            Self::View | Self::Uniform => buffer(wgpu::BufferBindingType::Uniform),
            Self::Read => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
            Self::Write => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
            Self::Words => texture(wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2),
            Self::DrawnDepth => texture(wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2Array),
            Self::DrawnSamples => texture(wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2Array),
        }
    }

    fn entry(self, binding: u32) -> wgpu::BindGroupLayoutEntry {
        let visibility = wgpu::ShaderStages::COMPUTE;
        wgpu::BindGroupLayoutEntry { binding, visibility, ty: self.ty(), count: None }
    }
}

/// A shader's bindings, in their order.
fn slots(key: ShaderKey) -> Vec<Slot> {
    use Slot::{DrawnDepth, DrawnSamples, Read, Uniform, View, Words, Write};
    match key.name {
        "tile_start.wgsl" => vec![View, Words, Words, Write],
        "fill.wgsl" => vec![View, Write, Write, Read, Read, Read],
        "specular.wgsl" => vec![View, Words, Words, Write, Read, Read, Uniform, Words],
        "mesh.wgsl" | "hybrid_mesh.wgsl" => vec![Uniform, Words, Write, Write],
        "merge.wgsl" | "quad_count.wgsl" => vec![Uniform, Read, Write, Write],
        "quad_scan.wgsl" => vec![Uniform, Write, Write],
        "quad_indices.wgsl" => vec![Uniform, Read, Read, Write],
        _ => {
            let mut slots = vec![View, Words, Words, Read, Write, Write, Write, Write, Write, Words];
            slots.extend(key.count_fetches.then_some(Write));
            slots.extend([Read, Read].into_iter().filter(|_| key.march_camera > 0));
            slots.extend([DrawnDepth, DrawnSamples].into_iter().filter(|_| key.name == "resolve.wgsl"));
            slots
        }
    }
}

impl Reconstructor {
    pub(super) fn layout(&self, key: ShaderKey) -> wgpu::BindGroupLayout {
        let entries: Vec<_> = (0..).zip(slots(key)).map(|(binding, slot)| slot.entry(binding)).collect();
        self.gpu
            .device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(key.name), entries: &entries })
    }

    /// The first resource is the views' uniforms, of which a shader sees one.
    pub(super) fn bind(
        &self,
        pipeline: &wgpu::ComputePipeline,
        stride: u32,
        mut resources: Vec<BindingResource<'_>>,
    ) -> wgpu::BindGroup {
        if let Some(BindingResource::Buffer(views)) = resources.first_mut() {
            views.size = std::num::NonZeroU64::new(u64::from(stride));
        }
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        })
    }
}
