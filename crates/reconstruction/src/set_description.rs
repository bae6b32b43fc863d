//! What all images of a sample set share.

use std::sync::Arc;

use depth_image::{Aabb, Environment, Highlight, Illumination};
use gpu::GpuEnvironment;

/// The properties that all images of a sample set share.
#[derive(Clone, Copy)]
pub struct SetDescription<'a> {
    /// Holds all geometry of the scene.
    pub volume: Aabb,
    /// Radiance of rays that leave the scene, by their direction.
    pub background: Environment,
    /// The scene's lights; they are seen in highlights only, since the samples' colours hold the rest.
    pub illumination: &'a Illumination,
    /// How surfaces reflect towards the viewer; `None` leaves highlights away, even where images have planes for them.
    pub highlight: Option<Highlight>,
    /// A map in the place of the background and of the lights' environment. The twin does not know it.
    pub environment: Option<&'a Arc<GpuEnvironment>>,
    /// Colours have coarser levels, for mirrored rays that cover several texels.
    pub mips: bool,
}
