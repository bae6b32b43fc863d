//! The scene that a coordinator offers: enough for a client to place its views.

use depth_image::{Aabb, Camera};
use glam::DVec3;

use crate::check::{at_most, text};
use crate::error::InvalidField;
use crate::limits::MAX_SAMPLE_CAMERAS;
use crate::scene::SceneRef;

/// The scene on offer.
#[derive(Debug, Clone, PartialEq)]
pub struct OfferStatus {
    /// The scene by content.
    pub scene: SceneRef,
    /// Sample cameras for sessions that bring none.
    pub sample_cameras: Vec<Camera>,
    /// The bounds of reconstruction.
    pub volume: Aabb,
    /// The point of the source file's space that is the world's origin.
    pub origin_in_source: DVec3,
    /// Settings for sessions that choose none.
    pub settings: OfferSettings,
}

/// Settings named as on the command line; `None` where the client may choose.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct OfferSettings {
    /// How views are reconstructed.
    pub method: Option<String>,
    /// How images are sampled.
    pub sampling: Option<String>,
    /// How samples are lit.
    pub lighting: Option<String>,
}

impl OfferStatus {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        if !self.origin_in_source.is_finite() {
            return Err(InvalidField::out_of_range("origin_in_source", self.origin_in_source, "finite"));
        }
        self.scene.validate()?;
        at_most(self.sample_cameras.len(), MAX_SAMPLE_CAMERAS, "sample_cameras")?;
        let OfferSettings { method, sampling, lighting } = &self.settings;
        for (setting, field) in
            [(method, "reconstruction_method"), (sampling, "sampling_method"), (lighting, "lighting")]
        {
            text(setting.as_deref().unwrap_or_default(), field)?;
        }
        Ok(())
    }
}
