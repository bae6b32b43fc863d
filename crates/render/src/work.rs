//! Requests to draw, besides the cameras.

use depth_image::{Antialias, Highlight, Refinement};
use gpu::Turn;

use crate::lamp_maps::LampMaps;
use crate::{GpuScene, Lighting, Visibility};

/// A scene at a moment, and how it is drawn.
#[derive(Clone, Copy)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct DrawWork<'a> {
    pub scene: &'a GpuScene,
    pub lighting: Lighting,
    /// The moment of an animated scene.
    pub scene_time_s: f32,
    /// The way of finding surfaces.
    pub visibility: Visibility,
    /// The refinement of a still scene's light.
    pub refinement: Refinement,
    /// The place in the device's order.
    pub turn: Turn,
    /// Triangles are drawn from behind, too, as rays meet them.
    pub both_faces: bool,
    /// The shadow maps of light that asks them.
    pub lamp_maps: LampMaps<'a>,
}

impl<'a> DrawWork<'a> {
    /// A scene at its start, finished at once, surfaces found by whichever way is faster.
    #[must_use]
    pub fn new(scene: &'a GpuScene, lighting: Lighting) -> Self {
        Self {
            scene,
            lighting,
            scene_time_s: 0.0,
            visibility: Visibility::Measured,
            refinement: Refinement::default(),
            turn: Turn::default(),
            both_faces: false,
            lamp_maps: LampMaps::default(),
        }
    }
}

impl DrawWork<'_> {
    /// The same surfaces, without light.
    pub(crate) fn unlit(self) -> Self {
        Self { lighting: Lighting::UNLIT, refinement: Refinement::default(), ..self }
    }

    /// The formula of highlights, where the scene has any.
    pub(crate) fn highlight(self) -> Option<Highlight> {
        self.lighting.highlight().filter(|&highlight| self.scene.has_highlights(highlight))
    }
}

/// The samples of a texel's colour, and the optional planes of depth images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct SamplePlanes {
    /// With more than one, a texel's colour is the mean of its centre and of as many positions around it, as far as these
    /// show the centre's surface. Light that is refined is the centre's.
    pub antialias: Antialias,
    /// [`DepthImage::normal_oct16`](depth_image::DepthImage::normal_oct16).
    pub normal: bool,
    /// [`DepthImage::surface_id`](depth_image::DepthImage::surface_id).
    pub surface_id: bool,
    /// [`DepthImage::specular`](depth_image::DepthImage::specular), with normals, where the scene has highlights under the
    /// lighting.
    pub specular: bool,
    /// [`DepthImage::corner_inverse_depth_per_m`](depth_image::DepthImage::corner_inverse_depth_per_m): a second picture.
    pub corners: bool,
    /// [`DepthImage::light`](depth_image::DepthImage::light) in place of colour, with normals; a texel then has one position.
    pub light: bool,
}

/// The surfaces that a layered image holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LayerSelection {
    /// All that its lines meet (Lischinski §3.1).
    All,
    /// Those whose normal is largest along the lines, of the camera's three axes, or nearly so: images along all three axes hold
    /// each surface on one of them at least.
    Dominant,
}

/// A surface is kept along each axis in which its normal has at least this share of its largest component: neighbouring images
/// overlap.
const LEAST_DOMINANT_SHARE: f32 = 0.9;

impl LayerSelection {
    pub(crate) fn least_share(self) -> f32 {
        match self {
            Self::All => 0.0,
            Self::Dominant => LEAST_DOMINANT_SHARE,
        }
    }
}
