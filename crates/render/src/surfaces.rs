//! The surfaces of one camera: textures that `raster` or `primary` draws into, and that light is computed from.

use glam::UVec2;
use gpu::{Binding, DrawPass, Gpu, Lent, Pool};
use wgpu::{TextureFormat, TextureUsages};

/// Words of `packed_surface.wgsl`.
pub(crate) const SURFACE_FORMAT: TextureFormat = TextureFormat::Rgba32Uint;
/// Instance and primitive.
pub(crate) const SURFACE_ID_FORMAT: TextureFormat = TextureFormat::Rg32Uint;

/// Octahedral.
pub(crate) const TRIANGLE_NORMAL_FORMAT: TextureFormat = TextureFormat::R32Uint;

/// All bits of a word: no instance has this number, and no triangle.
pub(crate) const NOTHING: u32 = u32::MAX;

/// The bit of a surface's normal that says that light goes through, where pixels with glass are marked: the last of the vector's first
/// number.
pub(crate) const SEEN_THROUGH: u32 = 1;

/// The most bytes of free textures: those of a few batches.
pub(crate) const MOST_FREE_BYTES: u64 = 128 << 20;

/// The textures that are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct SurfaceKind {
    pub size_px: UVec2,
    pub by_rays: bool,
    pub surface_id: bool,
    pub triangle_normal: bool,
    /// Positions within the pixels share light, by the surface of the first.
    pub first_surface: bool,
    /// The nearest surface is wanted besides the one that is shown.
    pub front: bool,
}

impl SurfaceKind {
    pub fn bytes(&self) -> u64 {
        let floats = 1 + u64::from(self.front) + u64::from(self.triangle_normal);
        let pixel = 16 * (1 + u64::from(self.first_surface)) + 4 * floats + 8 * u64::from(self.surface_id);
        pixel * u64::from(self.size_px.x) * u64::from(self.size_px.y)
    }
}

/// Texture views of one kind.
pub(crate) struct SurfaceViews {
    pub surfaces: wgpu::TextureView,
    pub reversed_depth: wgpu::TextureView,
    /// The reversed depth of the nearest surface on each pixel's ray, redundant or not.
    pub front_depth: wgpu::TextureView,
    surface_ids: Option<wgpu::TextureView>,
    /// On the side that is seen.
    pub triangle_normals: Option<wgpu::TextureView>,
    /// What `light_cache.wgsl` keeps of the surfaces at the first position.
    first_surfaces: Option<wgpu::TextureView>,
}

/// Textures on loan; contents are whatever the last borrower left.
pub(crate) struct Surfaces {
    pub views: Lent<SurfaceKind, SurfaceViews>,
    /// The surface ids, where they are asked for.
    pub surface_ids: Option<wgpu::TextureView>,
}

impl SurfaceViews {
    fn new(gpu: &Gpu, kind: SurfaceKind) -> Self {
        let written = if kind.by_rays { TextureUsages::STORAGE_BINDING } else { TextureUsages::RENDER_ATTACHMENT };
        let [width, height] = kind.size_px.to_array();
        let view_for = |format, written| {
            let usage = written | TextureUsages::TEXTURE_BINDING;
            gpu.texture("surfaces", [width, height, 1], format, usage).create_view(&Default::default())
        };
        let view = |format| view_for(format, written);
        let depth = if kind.by_rays { TextureFormat::R32Float } else { DrawPass::DEPTH_FORMAT };
        let reversed_depth = view(depth);
        Self {
            surfaces: view(SURFACE_FORMAT),
            front_depth: if kind.front { view(depth) } else { reversed_depth.clone() },
            reversed_depth,
            surface_ids: kind.surface_id.then(|| view(SURFACE_ID_FORMAT)),
            triangle_normals: kind.triangle_normal.then(|| view(TRIANGLE_NORMAL_FORMAT)),
            first_surfaces: kind.first_surface.then(|| view_for(SURFACE_FORMAT, TextureUsages::STORAGE_BINDING)),
        }
    }
}

impl Surfaces {
    /// Surface ids are drawn into `own_ids`, which are not lent, where there are any.
    pub fn lend(
        gpu: &Gpu,
        pool: &Pool<SurfaceKind, SurfaceViews>,
        kind: SurfaceKind,
        own_ids: Option<&wgpu::TextureView>,
    ) -> Self {
        let views = pool.lend(kind, |&kind| SurfaceViews::new(gpu, kind));
        Self { surface_ids: own_ids.or(views.surface_ids.as_ref()).cloned(), views }
    }

    /// All textures; each shader declares some of them.
    pub fn bindings(&self) -> impl Iterator<Item = Binding<'_>> {
        let SurfaceViews { surfaces, reversed_depth, front_depth, triangle_normals, first_surfaces, .. } = &*self.views;
        let always = [("surfaces", surfaces), ("reversed_depth", reversed_depth), ("front_depth", front_depth)];
        let ids = self.surface_ids.as_ref().map(|view| ("surface_ids", view));
        let normals = triangle_normals.as_ref().map(|view| ("triangle_normals", view));
        let first = first_surfaces.as_ref().map(|view| ("first_surfaces", view));
        let views = always.into_iter().chain(ids).chain(normals).chain(first);
        views.map(|(name, view)| Binding::texture(name, view))
    }
}
