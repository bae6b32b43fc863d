//! What all camera models speak of: rays, positions with depth, and why a camera cannot be used.

use glam::{Quat, UVec2, Vec2, Vec3};

/// The largest image side that any part of the system accepts.
pub const MAX_IMAGE_SIDE_PX: u32 = 16_384;

/// A half-line: `origin + t · direction`, `t >= 0`. The direction need not have unit length.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct Ray {
    pub origin_in_world: Vec3,
    pub direction_in_world: Vec3,
}

impl Ray {
    /// The point at parameter `t`.
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin_in_world + self.direction_in_world * t
    }
}

/// A position in an image and the depth there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PixelDepth {
    /// Columns to the right, rows down; pixel centres at +0.5.
    pub pixel: Vec2,
    /// Along the camera's forward axis, metres, positive in front.
    pub planar_depth_m: f32,
}

/// An unusable camera.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum CameraError {
    #[error("camera {field} is not finite")]
    NotFinite { field: &'static str },
    #[error("camera {field} is {value}, must be {allowed}")]
    OutOfRange { field: &'static str, value: f64, allowed: &'static str },
}

/// Refuses a field that is not finite.
pub(crate) fn check_finite(field: &'static str, is_finite: bool) -> Result<(), CameraError> {
    if is_finite { Ok(()) } else { Err(CameraError::NotFinite { field }) }
}

/// Refuses a value that is not allowed.
pub(crate) fn check_range(
    field: &'static str,
    value: impl Into<f64>,
    is_allowed: bool,
    allowed: &'static str,
) -> Result<(), CameraError> {
    if is_allowed { Ok(()) } else { Err(CameraError::OutOfRange { field, value: value.into(), allowed }) }
}

/// Refuses a rotation that is not a unit quaternion.
pub(crate) fn check_unit(field: &'static str, rotation: Quat) -> Result<(), CameraError> {
    let length = f64::from(rotation.length());
    check_range(field, length, (length - 1.0).abs() < 1e-3, "of unit length")
}

/// Refuses an image without pixels, and one with too long a side.
pub(crate) fn check_sides(size_px: UVec2) -> Result<(), CameraError> {
    let [least_side, side] = [size_px.min_element(), size_px.max_element()];
    check_range("size_px", least_side, least_side >= 1, "at least 1")?;
    check_range("size_px", side, side <= MAX_IMAGE_SIDE_PX, "at most 16384")
}
