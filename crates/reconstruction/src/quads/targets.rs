//! The textures that quads are drawn into.

use glam::UVec2;
use gpu::{Binding, DrawPass, Gpu, Lent};
use wgpu::{TextureFormat, TextureUsages, TextureView, TextureViewDimension};

pub(crate) const SAMPLE_FORMAT: TextureFormat = TextureFormat::R32Uint;

/// The size of views, and how many there are.
pub(crate) type TargetKind = (UVec2, u32);

/// Depth and samples.
pub(crate) fn target_bytes(&(size_px, count): &TargetKind) -> u64 {
    8 * u64::from(size_px.x) * u64::from(size_px.y) * u64::from(count)
}

/// Targets of a batch of views.
pub(crate) type QuadTargets = Lent<TargetKind, Targets>;

/// The textures that views are drawn into, a layer each.
pub(crate) struct Targets {
    pub depth: Layers,
    pub samples: Layers,
}

/// A texture with a layer for each view.
pub(crate) struct Layers {
    all: TextureView,
    pub each: Vec<TextureView>,
}

impl Layers {
    fn new(gpu: &Gpu, label: &str, format: TextureFormat, (size_px, count): TargetKind) -> Self {
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
        let texture = gpu.texture(label, size_px.extend(count).to_array(), format, usage);
        let view = |dimension, base_array_layer, count| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(dimension),
                base_array_layer,
                array_layer_count: Some(count),
                ..Default::default()
            })
        };
        Self {
            all: view(TextureViewDimension::D2Array, 0, count),
            each: (0..count).map(|layer| view(TextureViewDimension::D2, layer, 1)).collect(),
        }
    }
}

impl Targets {
    pub fn new(gpu: &Gpu, kind: TargetKind) -> Self {
        Self {
            depth: Layers::new(gpu, "drawn depth", DrawPass::DEPTH_FORMAT, kind),
            samples: Layers::new(gpu, "drawn samples", SAMPLE_FORMAT, kind),
        }
    }

    /// As `resolve.wgsl` reads them.
    pub fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::texture("drawn_depth", &self.depth.all), Binding::texture("drawn_sample", &self.samples.all)]
    }
}
