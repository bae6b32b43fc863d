//! How much a session asks for, and the lower qualities that it accepts.

use depth_image::PinholeCamera;
use serde::{Deserialize, Serialize};

use crate::check::{frame_rate, nonempty, ratio, viewpoints};
use crate::error::InvalidField;
use crate::limits::MAX_VIEWS_PER_SET;

/// A quality below the one that a session asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// How samples are lit.
    pub lighting: String,
    /// How views are reconstructed.
    pub method: String,
    /// Sides of sample images, of those asked for: above 0, at most 1.
    pub sample_side_ratio: f64,
    /// Pictures a second, of those asked for: above 0, at most 1.
    pub frame_rate_ratio: f64,
}

impl Quality {
    /// # Errors
    /// For settings that are missing or too long, and for ratios that are not above 0 and at most 1.
    pub fn validate(&self) -> Result<(), InvalidField> {
        nonempty(&self.lighting, "fallbacks.lighting")?;
        nonempty(&self.method, "fallbacks.reconstruction_method")?;
        ratio(self.sample_side_ratio, "fallbacks.sample_side_ratio")?;
        ratio(self.frame_rate_ratio, "fallbacks.frame_rate_ratio").map(drop)
    }
}

/// A session asks for more, or for less.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangeSession {
    /// The session's number at the coordinator.
    pub session: u64,
    /// V: views that are asked of each sample set.
    pub views_per_set: u32,
    /// Pictures a second; `None`: as fast as they come.
    pub frames_per_s: Option<f64>,
    /// New viewpoints; `None`: as before.
    pub viewpoints: Option<Vec<PinholeCamera>>,
}

impl ChangeSession {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        if self.views_per_set > MAX_VIEWS_PER_SET {
            return Err(InvalidField::out_of_range("views_per_set_count", self.views_per_set, "from 0 to 65536"));
        }
        frame_rate(self.frames_per_s)?;
        viewpoints(self.viewpoints.as_deref().unwrap_or_default())
    }
}
