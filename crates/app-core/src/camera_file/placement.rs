//! Facts that a camera file does not state.

use glam::DVec3;

/// Facts that a camera file does not state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The origin of world space, in the file's space.
    pub origin_in_source: DVec3,
    /// The distance to the near plane.
    pub near_m: f32,
}
