//! Textures with a texel for each sample and a layer for each image of a set.

use glam::UVec2;
use gpu::{Gpu, Pool};
use wgpu::{TextureFormat, TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension};

/// The most bytes of free layers: a set of 16 images of 1920×1080 samples.
const MOST_FREE_BYTES: u64 = 512 << 20;

pub(crate) struct Layers {
    all: wgpu::Texture,
    pub size_px: UVec2,
    /// Each layer, to be written.
    pub each: Vec<TextureView>,
}

/// Columns, rows and layers, and their format.
pub(crate) type LayerKind = ([u32; 3], TextureFormat);

/// Lends layers, which hold what is left over: making and clearing them costs as much as drawing a picture.
pub(crate) fn pool(gpu: &Gpu) -> Pool<LayerKind, Layers> {
    Pool::of_device(gpu, MOST_FREE_BYTES, |&(size, format)| {
        u64::from(format.block_copy_size(None).unwrap_or(4)) * size.map(u64::from).iter().product::<u64>()
    })
}

impl Layers {
    pub fn new(gpu: &Gpu, size: [u32; 3], format: TextureFormat) -> Self {
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING;
        let all = gpu.texture("held samples", size, format, usage);
        let each = (0..size[2]).map(|base_array_layer| {
            all.create_view(&TextureViewDescriptor {
                dimension: Some(TextureViewDimension::D2),
                base_array_layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        });
        Self { each: each.collect(), size_px: UVec2::new(size[0], size[1]), all }
    }

    /// The first `count` layers, to be read while others are written.
    pub fn first(&self, count: usize) -> TextureView {
        self.all.create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2Array),
            array_layer_count: Some(count as u32),
            ..Default::default()
        })
    }
}
