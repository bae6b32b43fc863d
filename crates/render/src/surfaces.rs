//! The surfaces of one camera: textures that `raster` or `primary` draws into, and that light is computed from.

use std::sync::Arc;

use glam::UVec2;
use gpu::{Binding, DispatchSize, DrawPass, Gpu, Lent, Pool};
use wgpu::{TextureFormat, TextureUsages};

/// Words of `packed_surface.wgsl`.
pub(crate) const SURFACE_FORMAT: TextureFormat = TextureFormat::Rgba32Uint;
/// Instance and primitive.
pub(crate) const SURFACE_ID_FORMAT: TextureFormat = TextureFormat::Rg32Uint;

/// All bits of a word: no instance has this number, and no triangle.
pub(crate) const NOTHING: u32 = u32::MAX;

/// The textures that are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct SurfaceKind {
    pub size_px: UVec2,
    pub by_rays: bool,
    pub surface_id: bool,
    /// The nearest surface is wanted besides the one that is shown.
    pub front: bool,
}

/// Texture views of one kind.
pub(crate) struct SurfaceViews {
    pub surfaces: wgpu::TextureView,
    pub reversed_depth: wgpu::TextureView,
    surface_ids: Option<wgpu::TextureView>,
    front_depth: Option<wgpu::TextureView>,
}

/// Lends textures; they come back when dropped.
pub(crate) struct SurfacePool {
    gpu: Arc<Gpu>,
    surfaces: Pool<SurfaceKind, SurfaceViews>,
}

/// Textures on loan; contents are whatever the last borrower left.
pub(crate) struct Surfaces {
    views: Lent<SurfaceKind, SurfaceViews>,
    /// A texture that is not lent, where surface ids are drawn instead.
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
        let depth = if kind.by_rays { TextureFormat::R32Float } else { DrawPass::DEPTH_FORMAT };
        SurfaceViews {
            surfaces: view(SURFACE_FORMAT),
            reversed_depth: view(depth),
            front_depth: kind.front.then(|| view(depth)),
            surface_ids: kind.surface_id.then(|| view(SURFACE_ID_FORMAT)),
        }
    }
}

impl SurfaceViews {
    /// The reversed depth of the nearest surface on each pixel's ray, redundant or not.
    pub fn front_depth(&self) -> &wgpu::TextureView {
        self.front_depth.as_ref().unwrap_or(&self.reversed_depth)
    }
}

impl Surfaces {
    pub fn with_ids(mut self, ids: wgpu::TextureView) -> Self {
        self.own_ids = Some(ids);
        self
    }

    /// The surface ids, where they are asked for.
    pub fn surface_ids(&self) -> Option<&wgpu::TextureView> {
        self.own_ids.as_ref().or(self.views.surface_ids.as_ref())
    }

    pub fn size_px(&self) -> UVec2 {
        self.views.kind().size_px
    }

    /// The variables of `surfaces.wgsl`.
    pub fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::texture("surfaces", &self.surfaces), Binding::texture("reversed_depth", &self.reversed_depth)]
    }

    /// One invocation for each pixel, or for each `step_px`-th in both directions.
    pub fn invocations(&self, step_px: u32) -> DispatchSize<'static> {
        let size = self.size_px().map(|side| side.div_ceil(step_px));
        DispatchSize::Invocations([size.x, size.y, 1])
    }
}

impl std::ops::Deref for Surfaces {
    type Target = SurfaceViews;
    fn deref(&self) -> &SurfaceViews {
        &self.views
    }
}
