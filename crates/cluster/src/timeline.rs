//! When sample sets show the scene.

use serde::{Deserialize, Serialize};

use crate::check::{InvalidField, within};
use crate::limits::{MAX_SCENE_TIME_S, MAX_SETS};

/// Scene times of the sample sets.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Timeline {
    /// Scene time of set 0.
    pub start_s: f64,
    /// Scene time from set to set; 0 for a static scene.
    pub step_s: f64,
    /// Sample sets, from 1 to [`MAX_SETS`].
    pub set_count: u32,
}

impl Timeline {
    /// One set.
    #[must_use]
    pub fn still(at_s: f64) -> Self {
        Self { start_s: at_s, step_s: 0.0, set_count: 1 }
    }

    /// Whether sets differ in scene time: one set never does.
    #[must_use]
    pub fn moves(&self) -> bool {
        self.step_s != 0.0 && self.set_count > 1
    }

    /// Scene time of a set; `None` beyond the last.
    #[must_use]
    pub fn time_s(&self, set_index: u32) -> Option<f32> {
        (set_index < self.set_count).then(|| (self.start_s + f64::from(set_index) * self.step_s) as f32)
    }

    /// # Errors
    /// For no sets or too many, and for times that are not finite or too far from 0.
    pub fn validate(&self) -> Result<(), InvalidField> {
        within(self.set_count, 1..=MAX_SETS, "timeline.set_count", "from 1 to 1048576")?;
        let times = -MAX_SCENE_TIME_S..=MAX_SCENE_TIME_S;
        within(self.start_s, times.clone(), "timeline.start_s", "from -1e6 to 1e6")?;
        within(self.step_s, times, "timeline.step_s", "from -1e6 to 1e6")
    }
}
