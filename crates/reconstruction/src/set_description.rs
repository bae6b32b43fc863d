//! The properties that all images of a sample set share.

use depth_image::{Aabb, Highlight, Illumination};
use glam::Vec3;

/// The properties that all images of a sample set share.
#[derive(Debug, Clone, Copy)]
pub struct SetDescription<'a> {
    /// Holds all geometry of the scene.
    pub volume: Aabb,
    /// The colour of pixels that show nothing.
    pub background_linear: Vec3,
    /// The scene's lights; they are seen in highlights only, since the samples' colours hold the rest.
    pub illumination: &'a Illumination,
    /// How surfaces reflect towards the viewer; `None` leaves highlights away, even where images have planes for them.
    pub highlight: Option<Highlight>,
}
