//! The single-pole occlusion camera (Mei, Popescu and Sacks 2005; Rosen et al., section 4): the image of a pinhole, pushed away
//! from a pole, the farther the deeper. So a single image shows the sides and the back of an object around the pole.
//!
//! A point at planar depth z moves by `κ (1/nearest − 1/z)` pixels, so that each pixel's ray is straight: its undistorted
//! position changes linearly in 1/z. All rays of one azimuth pass one point of a ring around the eye.

use glam::{UVec2, Vec2, Vec3, Vec3A};
use serde::{Deserialize, Serialize};

use crate::projection::{check_finite, check_range};
use crate::{Aabb, CameraError, MAX_IMAGE_SIDE_PX, PinholeCamera, PixelDepth, Ray};

/// The least depth of what a camera is placed around, as a share of its greatest.
const LEAST_DEPTH: f32 = 1e-3;
/// The room for the object's own rounding on both sides of the depths that a camera sees.
const DEPTH_SLACK: f32 = 1e-3;

/// A single-pole occlusion camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SinglePoleCamera {
    /// The pinhole before its pixels move. Those at its `near_m` stay; nothing nearer is seen.
    pub reference: PinholeCamera,
    /// The place that pixels move away from.
    pub pole_px: Vec2,
    /// How far pixels move at `farthest_m`. At 0 the camera is a pinhole.
    pub distortion_px: f32,
    /// The greatest planar depth that is seen, metres.
    pub farthest_m: f32,
}

impl SinglePoleCamera {
    /// The camera from an eye around a box, whose middle is the pole: of a large scale at which no part of the box leaves the
    /// image at this distortion. The eye lies outside of the box.
    #[must_use]
    pub fn around(bounds: &Aabb, eye: Vec3, distortion_px: f32, size_px: UVec2) -> Self {
        let middle = bounds.center();
        let up = if (middle - eye).normalize_or(Vec3::Z).y.abs() > 0.95 { Vec3::NEG_Z } else { Vec3::Y };
        let looking = PinholeCamera::looking_at(eye, middle, up, 1.0, size_px);
        let corners_in_camera = bounds.corners().map(|corner| looking.world_from_camera.conjugate() * (corner - eye));
        let depths_m = corners_in_camera.map(|corner| -corner.z);
        let farthest_m = depths_m.into_iter().fold(f32::MIN_POSITIVE, f32::max);
        let nearest_m = depths_m.into_iter().fold(farthest_m, f32::min).max(LEAST_DEPTH * farthest_m);
        let near_m = nearest_m * (1.0 - DEPTH_SLACK);
        let farthest_m = farthest_m * (1.0 + DEPTH_SLACK);
        let reference = PinholeCamera { near_m, ..looking };
        let unscaled = Self { reference, pole_px: reference.principal_px, distortion_px, farthest_m };
        // Away from the pole along one axis, nothing moves farther than the distortion.
        let room_px = 0.5 * size_px.min_element() as f32;
        let focals_px = corners_in_camera.map(|corner| {
            let at = corner.truncate().abs().max_element();
            let z = (-corner.z).max(nearest_m);
            (room_px - unscaled.shift_px(z.recip())).max(1.0) * z / at.max(f32::MIN_POSITIVE)
        });
        let focal_px = focals_px.into_iter().fold(f32::MAX, f32::min).clamp(2e-3, 1e6);
        Self { reference: PinholeCamera { focal_px: Vec2::splat(focal_px), ..reference }, ..unscaled }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is not finite or out of range.
    pub fn validate(&self) -> Result<(), CameraError> {
        self.reference.validate()?;
        check_finite("pole_px", self.pole_px.is_finite())?;
        check_finite("distortion_px", self.distortion_px.is_finite())?;
        check_finite("farthest_m", self.farthest_m.is_finite())?;
        // A tile of an image does not hold the image's pole.
        let pole = self.pole_px.abs().max_element();
        check_range("pole_px", pole, pole < 1e6, "within a million pixels")?;
        let distortion = self.distortion_px;
        check_range("distortion_px", distortion, distortion >= 0.0, "at least 0")?;
        check_range("distortion_px", distortion, distortion <= MAX_IMAGE_SIDE_PX as f32, "at most 16384")?;
        check_range("near_m", self.reference.near_m, self.reference.near_m >= 1e-6, "at least 1e-6")?;
        let [near_m, farthest_m] = [self.reference.near_m, self.farthest_m].map(f64::from);
        let is_beyond = farthest_m >= near_m * (1.0 + f64::from(DEPTH_SLACK));
        check_range("farthest_m", farthest_m, is_beyond, "beyond near_m by a thousandth")
    }

    /// The same field of view in another size. Of other proportions the distortion is that of the side that shrinks more.
    #[must_use]
    pub fn resized(&self, size_px: UVec2) -> Self {
        let scale = size_px.as_vec2() / self.reference.size_px.as_vec2();
        Self {
            reference: self.reference.resized(size_px),
            pole_px: self.pole_px * scale,
            distortion_px: self.distortion_px * scale.min_element(),
            ..*self
        }
    }

    /// See [`Camera::with_offset`](crate::Camera::with_offset).
    #[must_use]
    pub fn with_offset(&self, offset_px: Vec2) -> Self {
        Self { reference: self.reference.with_offset(offset_px), pole_px: self.pole_px - offset_px, ..*self }
    }

    /// κ: the pixels that a point moves for each inverse metre of depth.
    #[must_use]
    pub fn bend_px_m(&self) -> f32 {
        self.distortion_px / (self.reference.near_m.recip() - self.farthest_m.recip())
    }

    /// How far a point of this inverse depth moves from the pole.
    fn shift_px(&self, inverse_depth_per_m: f32) -> f32 {
        self.bend_px_m() * (self.reference.near_m.recip() - inverse_depth_per_m)
    }

    /// The position and depth of a point; `None` outside the depths that the camera sees.
    #[must_use]
    pub fn project(&self, point_in_world: Vec3) -> Option<PixelDepth> {
        let PixelDepth { pixel, planar_depth_m } = self.reference.project(point_in_world)?;
        let is_seen = (self.reference.near_m..=self.farthest_m).contains(&planar_depth_m);
        let away = away_from(self.pole_px, pixel) * self.shift_px(planar_depth_m.recip());
        is_seen.then_some(PixelDepth { pixel: pixel + away, planar_depth_m })
    }

    /// The ray of a pixel; its parameter is planar depth in metres. Its origin lies off the eye.
    #[must_use]
    pub fn ray(&self, pixel: Vec2) -> Ray {
        let away_px_m = away_from(self.pole_px, pixel) * self.bend_px_m();
        let through = self.reference.ray(pixel - away_px_m / self.reference.near_m);
        let off_axis = away_px_m / self.reference.focal_px;
        let off = self.reference.world_from_camera * Vec3A::new(off_axis.x, -off_axis.y, 0.0);
        Ray { origin_in_world: through.origin_in_world + Vec3::from(off), ..through }
    }

    /// See [`Camera::depths_m`](crate::Camera::depths_m): a ray ends where it meets the axis of the pole.
    #[must_use]
    pub fn depths_m(&self, pixel: Vec2) -> [f32; 2] {
        let bend_px_m = self.bend_px_m();
        let short_px = bend_px_m / self.reference.near_m - pixel.distance(self.pole_px);
        let axis_m = if short_px > 0.0 { bend_px_m / short_px } else { f32::INFINITY };
        [self.reference.near_m, self.farthest_m.min(axis_m)]
    }
}

/// The direction away from the pole, of unit length; that of columns at the pole itself.
fn away_from(pole_px: Vec2, pixel: Vec2) -> Vec2 {
    (pixel - pole_px).try_normalize().unwrap_or(Vec2::X)
}

#[cfg(test)]
#[path = "single_pole_tests.rs"]
mod tests;
