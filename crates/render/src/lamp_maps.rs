//! Shadow maps from places of a rectangle: what is nearest to each of them, of the scene or of samples of it.

use depth_image::PinholeCamera;
use gpu::{Binding, DrawPass, Frame, Gpu, Lent, Pool};
use wgpu::{TextureUsages, TextureView, TextureViewDimension};

use crate::RenderError;

/// Maps that are drawn and asked together: 64 MiB of 1024².
pub(crate) const MAPS_AT_ONCE: u32 = 16;
/// The sides of shadow maps.
pub(crate) const DEFAULT_SIDE_PX: u32 = 1024;
/// The most bytes of free maps.
const MOST_FREE_BYTES: u64 = 64 << 20;

/// Draws shadow maps from samples of what lamps see.
pub trait LampMapSource: Sync {
    /// Records what each camera on a lamp, by its number, sees of the samples into its depth target.
    ///
    /// # Errors
    /// The lamp has no samples, or the device.
    fn record(
        &self,
        frame: &mut Frame<'_>,
        lamp: usize,
        cameras: &[PinholeCamera],
        reversed_depths: &[TextureView],
    ) -> Result<(), RenderError>;
}

/// The shadow maps of rectangles, for light that asks them.
#[derive(Clone, Copy)]
pub struct LampMaps<'a> {
    /// Width and height.
    pub side_px: u32,
    /// Where maps come from that are not of the scene itself.
    pub samples: Option<&'a dyn LampMapSource>,
}

impl Default for LampMaps<'_> {
    fn default() -> Self {
        Self { side_px: DEFAULT_SIDE_PX, samples: None }
    }
}

/// A texture with a layer for each map.
pub(crate) struct MapLayers {
    all: TextureView,
    pub each: Vec<TextureView>,
}

/// Textures of maps by their side.
pub(crate) type MapPool = Pool<u32, MapLayers>;

pub(crate) fn pool(gpu: &Gpu) -> MapPool {
    Pool::of_device(gpu, MOST_FREE_BYTES, |&side_px| 4 * u64::from(side_px).pow(2) * u64::from(MAPS_AT_ONCE))
}

/// Textures on loan, with whatever the last borrower left.
pub(crate) fn lend(gpu: &Gpu, pool: &MapPool, side_px: u32) -> Lent<u32, MapLayers> {
    pool.lend(side_px, |&side_px| MapLayers::new(gpu, side_px))
}

impl MapLayers {
    fn new(gpu: &Gpu, side_px: u32) -> Self {
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
        let size = [side_px, side_px, MAPS_AT_ONCE];
        let texture = gpu.texture("shadow maps", size, DrawPass::DEPTH_FORMAT, usage);
        Self {
            all: view_of(&texture, TextureViewDimension::D2Array, 0, MAPS_AT_ONCE),
            each: (0..MAPS_AT_ONCE).map(|layer| view_of(&texture, TextureViewDimension::D2, layer, 1)).collect(),
        }
    }

    pub fn binding(&self) -> Binding<'_> {
        Binding::texture("maps", &self.all)
    }
}

fn view_of(texture: &wgpu::Texture, dimension: TextureViewDimension, base_array_layer: u32, count: u32) -> TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(dimension),
        base_array_layer,
        array_layer_count: Some(count),
        ..Default::default()
    })
}
