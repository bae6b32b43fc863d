//! What each pixel of one camera shows: the textures that surfaces are drawn into, and light is computed from.

use std::sync::Arc;

use glam::UVec2;
use gpu::{Gpu, Lent, Pool};
use wgpu::{TextureFormat, TextureUsages};

/// How surfaces are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct SurfaceKind {
    pub size_px: UVec2,
    pub by_rays: bool,
    pub surface_id: bool,
    /// Whether what is nearest is wanted besides what is shown.
    pub front: bool,
}

/// Words of `surface.wgsl`, reversed depth, and surface ids where they are asked for.
pub(crate) struct SurfaceViews {
    pub surface: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    ids: Option<wgpu::TextureView>,
    front: Option<wgpu::TextureView>,
}

/// Lends textures; they come back when dropped.
pub(crate) struct SurfacePool {
    gpu: Arc<Gpu>,
    surfaces: Pool<SurfaceKind, SurfaceViews>,
}

/// On loan; contents are whatever the last borrower left.
pub(crate) struct Surfaces {
    views: Lent<SurfaceKind, SurfaceViews>,
    /// Not lent: where surface ids are drawn instead.
    own_ids: Option<wgpu::TextureView>,
}

impl SurfacePool {
    pub fn new(gpu: &Arc<Gpu>) -> Self {
        Self { gpu: gpu.clone(), surfaces: Pool::keeping(usize::MAX) }
    }

    pub fn lend(&self, kind: SurfaceKind) -> Surfaces {
        Surfaces { views: self.surfaces.lend(kind, |&kind| self.make(kind)), own_ids: None }
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
        let depth = if kind.by_rays { TextureFormat::R32Float } else { TextureFormat::Depth32Float };
        SurfaceViews {
            surface: view(TextureFormat::Rgba32Uint),
            depth: view(depth),
            front: kind.front.then(|| view(depth)),
            ids: kind.surface_id.then(|| view(TextureFormat::Rg32Uint)),
        }
    }
}

impl SurfaceViews {
    /// Reversed depth of the nearest surface on each pixel's ray, shown or left out.
    pub fn front(&self) -> &wgpu::TextureView {
        self.front.as_ref().unwrap_or(&self.depth)
    }
}

impl Surfaces {
    pub fn with_ids(mut self, ids: wgpu::TextureView) -> Self {
        self.own_ids = Some(ids);
        self
    }

    /// Where surface ids are asked for.
    pub fn ids(&self) -> Option<&wgpu::TextureView> {
        self.own_ids.as_ref().or(self.views.ids.as_ref())
    }

    pub fn size_px(&self) -> UVec2 {
        self.views.kind().size_px
    }
}

impl std::ops::Deref for Surfaces {
    type Target = SurfaceViews;
    fn deref(&self) -> &SurfaceViews {
        &self.views
    }
}
