//! Textures with a layer for each image of a set, or for each shadow map.

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
        // Shaders do not write depth.
        let stored =
            if format.is_depth_stencil_format() { TextureUsages::empty() } else { TextureUsages::STORAGE_BINDING };
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING | stored;
        let all = gpu.texture("layers", size, format, usage);
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
