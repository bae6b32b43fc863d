//! Textures with a texel for each sample and a layer for each image of a set.

use std::sync::Arc;

use glam::UVec2;
use gpu::Gpu;
use parking_lot::Mutex;
use wgpu::{TextureFormat, TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension};

pub(crate) struct Layers {
    all: wgpu::Texture,
    pub size_px: UVec2,
    /// The device's shortages of memory when it was made.
    shortages: u64,
    /// Each layer, to be written.
    pub each: Vec<TextureView>,
}

/// The last layers that were made: making and clearing them costs as much as drawing a picture.
#[derive(Default)]
pub(crate) struct LayerCache(Mutex<Option<Arc<Layers>>>);

impl LayerCache {
    /// Layers that nobody else uses; they hold what is left over. `size` is columns, rows and layers.
    pub fn of(&self, gpu: &Gpu, size: [u32; 3], format: TextureFormat) -> Arc<Layers> {
        let mut kept = self.0.lock();
        let free = kept.as_ref().filter(|layers| Arc::strong_count(layers) == 1).filter(|layers| {
            let Layers { all, shortages, .. } = &***layers;
            ([all.width(), all.height(), all.depth_or_array_layers()], all.format()) == (size, format)
                && *shortages == gpu.shortages()
        });
        match free {
            Some(layers) => layers.clone(),
            None => kept.insert(Arc::new(Layers::new(gpu, size, format))).clone(),
        }
    }
}

impl Layers {
    fn new(gpu: &Gpu, size: [u32; 3], format: TextureFormat) -> Self {
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
        Self { each: each.collect(), size_px: UVec2::new(size[0], size[1]), shortages: gpu.shortages(), all }
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
