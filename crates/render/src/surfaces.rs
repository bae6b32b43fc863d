//! What each pixel of one camera shows: the textures that surfaces are drawn into, and light is computed from.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError, Weak},
};

use glam::UVec2;
use gpu::Gpu;
use wgpu::{TextureFormat, TextureUsages};

/// How surfaces are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct SurfaceKind {
    pub size_px: UVec2,
    pub by_rays: bool,
    pub surface_id: bool,
}

/// Words of `surface.wgsl`, reversed depth, and surface ids where they are asked for.
pub(crate) struct SurfaceViews {
    pub surface: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    pub ids: Option<wgpu::TextureView>,
}

type Free = Mutex<HashMap<SurfaceKind, Vec<SurfaceViews>>>;

/// Lends textures; they come back when dropped.
pub(crate) struct SurfacePool {
    gpu: Arc<Gpu>,
    free: Arc<Free>,
}

/// On loan; contents are whatever the last borrower left.
pub(crate) struct Surfaces {
    views: Option<SurfaceViews>,
    kind: SurfaceKind,
    home: Weak<Free>,
}

impl SurfacePool {
    pub fn new(gpu: &Arc<Gpu>) -> Self {
        Self { gpu: gpu.clone(), free: Arc::default() }
    }

    pub fn lend(&self, kind: SurfaceKind) -> Surfaces {
        let kept = self.free.lock().unwrap_or_else(PoisonError::into_inner).get_mut(&kind).and_then(Vec::pop);
        let views = kept.unwrap_or_else(|| self.make(kind));
        Surfaces { views: Some(views), kind, home: Arc::downgrade(&self.free) }
    }

    fn make(&self, kind: SurfaceKind) -> SurfaceViews {
        let written = if kind.by_rays { TextureUsages::STORAGE_BINDING } else { TextureUsages::RENDER_ATTACHMENT };
        let view = |format| {
            let texture = self.gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("surfaces"),
                size: wgpu::Extent3d { width: kind.size_px.x, height: kind.size_px.y, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: written | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        SurfaceViews {
            surface: view(TextureFormat::Rgba32Uint),
            depth: view(if kind.by_rays { TextureFormat::R32Float } else { TextureFormat::Depth32Float }),
            ids: kind.surface_id.then(|| view(TextureFormat::Rg32Uint)),
        }
    }
}

impl Surfaces {
    pub fn size_px(&self) -> UVec2 {
        self.kind.size_px
    }
}

impl std::ops::Deref for Surfaces {
    type Target = SurfaceViews;
    fn deref(&self) -> &SurfaceViews {
        self.views.as_ref().expect("present until dropped")
    }
}

impl Drop for Surfaces {
    fn drop(&mut self) {
        if let (Some(home), Some(views)) = (self.home.upgrade(), self.views.take()) {
            home.lock().unwrap_or_else(PoisonError::into_inner).entry(self.kind).or_default().push(views);
        }
    }
}
