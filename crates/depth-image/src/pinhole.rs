//! The pinhole camera.

use glam::{Mat3A, Quat, UVec2, Vec2, Vec3, Vec3A, Vec4};
use serde::{Deserialize, Serialize};

use crate::projection::{check_finite, check_range, check_sides, check_unit};
use crate::{CameraError, PixelDepth, Ray};

/// A pinhole camera; the principal point may lie anywhere (lens shift).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PinholeCamera {
    /// The centre of projection, metres.
    pub eye_in_world: Vec3,
    /// Camera to world, a unit quaternion. The camera looks down -Z, +Y up.
    pub world_from_camera: Quat,
    /// Focal lengths in pixels, both positive.
    pub focal_px: Vec2,
    /// The intersection of the forward axis with the image, in pixels.
    pub principal_px: Vec2,
    /// Columns and rows.
    pub size_px: UVec2,
    /// Closer surfaces are invisible, metres of planar depth.
    pub near_m: f32,
}

impl PinholeCamera {
    /// A camera at `eye` aimed at `target`, with square pixels and a centred axis. Only the part of `up` that is
    /// perpendicular to the view counts.
    #[must_use]
    pub fn looking_at(eye: Vec3, target: Vec3, up: Vec3, fov_y_rad: f32, size_px: UVec2) -> Self {
        let back = (eye - target).try_normalize().unwrap_or(Vec3::Z);
        let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
        let rotation = Mat3A::from_cols(right.into(), back.cross(right).into(), back.into());
        let focal = size_px.y as f32 * 0.5 / (fov_y_rad * 0.5).tan();
        Self {
            eye_in_world: eye,
            world_from_camera: Quat::from_mat3a(&rotation).normalize(),
            focal_px: Vec2::splat(focal),
            principal_px: size_px.as_vec2() * 0.5,
            size_px,
            near_m: 0.01,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is not finite or out of range.
    pub fn validate(&self) -> Result<(), CameraError> {
        check_finite("eye_in_world", self.eye_in_world.is_finite())?;
        check_finite("world_from_camera", self.world_from_camera.is_finite())?;
        check_finite("focal_px", self.focal_px.is_finite())?;
        check_finite("principal_px", self.principal_px.is_finite())?;
        check_finite("near_m", self.near_m.is_finite())?;
        check_unit("world_from_camera", self.world_from_camera)?;
        let focal = f64::from(self.focal_px.min_element());
        let is_focal = focal > 1e-3 && self.focal_px.max_element() < 1e7;
        check_range("focal_px", focal, is_focal, "above 0.001 and below 1e7")?;
        let principal = self.principal_px.abs().max_element();
        check_range("principal_px", principal, principal < 1e6, "within a million pixels")?;
        check_range("near_m", self.near_m, self.near_m > 0.0, "above 0")?;
        check_sides(self.size_px)
    }

    /// The same field of view in another size.
    #[must_use]
    pub fn resized(&self, size_px: UVec2) -> Self {
        let scale = size_px.as_vec2() / self.size_px.as_vec2();
        Self { size_px, focal_px: self.focal_px * scale, principal_px: self.principal_px * scale, ..*self }
    }

    /// The camera whose pixels' centres are those points of this one's pixels, in pixels from their centres.
    #[must_use]
    pub fn with_offset(&self, offset_px: Vec2) -> Self {
        Self { principal_px: self.principal_px - offset_px, ..*self }
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        self.size_px.x as usize * self.size_px.y as usize
    }

    /// Unit forward axis.
    #[must_use]
    pub fn forward_in_world(&self) -> Vec3 {
        self.world_from_camera * Vec3::NEG_Z
    }

    /// Three rows that map `(point_in_world, 1)` to homogeneous pixels `(column · w, row · w, w)`, where `w`
    /// is the planar depth in metres.
    #[must_use]
    pub fn homogeneous_pixel_from_world(&self) -> [Vec4; 3] {
        let axes = [Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z].map(|axis| self.world_from_camera * axis);
        let [right, down, depth] = axes.map(|axis| axis.extend(-axis.dot(self.eye_in_world)));
        [
            right * self.focal_px.x + depth * self.principal_px.x,
            down * self.focal_px.y + depth * self.principal_px.y,
            depth,
        ]
    }

    /// The position, inside the image or not, and depth of a point; `None` at or behind the eye.
    #[must_use]
    pub fn project(&self, point_in_world: Vec3) -> Option<PixelDepth> {
        let in_camera = self.world_from_camera.conjugate() * (point_in_world - self.eye_in_world);
        let planar_depth_m = -in_camera.z;
        (planar_depth_m > 0.0).then(|| PixelDepth {
            pixel: self.principal_px + self.focal_px * Vec2::new(in_camera.x, -in_camera.y) / planar_depth_m,
            planar_depth_m,
        })
    }

    /// The point at a position and depth, in world space.
    #[must_use]
    pub fn unproject(&self, at: PixelDepth) -> Vec3 {
        self.ray(at.pixel).at(at.planar_depth_m)
    }

    /// The ray of a pixel; its parameter is planar depth in metres.
    #[must_use]
    pub fn ray(&self, pixel: Vec2) -> Ray {
        let slope = (pixel - self.principal_px) / self.focal_px;
        let direction = self.world_from_camera * Vec3A::new(slope.x, -slope.y, -1.0);
        Ray { origin_in_world: self.eye_in_world, direction_in_world: direction.into() }
    }

    /// Returns whether a position lies inside the image.
    #[must_use]
    pub fn contains(&self, pixel: Vec2) -> bool {
        pixel.cmpge(Vec2::ZERO).all() && pixel.cmplt(self.size_px.as_vec2()).all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shifted() -> PinholeCamera {
        let mut camera = PinholeCamera::looking_at(
            Vec3::new(1.0, 2.0, 3.0),
            Vec3::new(-1.0, 0.5, -4.0),
            Vec3::Y,
            0.8,
            UVec2::new(400, 300),
        );
        camera.principal_px += Vec2::new(37.5, -12.0);
        camera
    }

    #[test]
    fn unproject_inverts_project() {
        let camera = shifted();
        for i in 0..1000 {
            let pixel = Vec2::new((i * 37 % 400) as f32 + 0.25, (i * 53 % 300) as f32 + 0.75);
            let at = PixelDepth { pixel, planar_depth_m: 0.1 + i as f32 * 0.05 };
            let back = camera.project(camera.unproject(at)).expect("in front");
            assert!((back.pixel - at.pixel).length() < 2e-2, "{at:?} {back:?}");
            assert!((back.planar_depth_m / at.planar_depth_m - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn homogeneous_rows_agree_with_project() {
        let camera = shifted();
        let point = Vec3::new(-0.4, 0.2, -2.0);
        let [u, v, w] = camera.homogeneous_pixel_from_world().map(|row| row.dot(point.extend(1.0)));
        let at = camera.project(point).expect("in front");
        assert!((Vec2::new(u, v) / w - at.pixel).length() < 1e-2);
        assert!((w - at.planar_depth_m).abs() < 1e-5);
    }

    #[test]
    fn a_point_behind_the_eye_has_no_pixel() {
        let camera = shifted();
        assert_eq!(camera.project(camera.eye_in_world - camera.forward_in_world()), None);
        assert_eq!(camera.project(camera.eye_in_world), None);
    }

    #[test]
    fn an_invalid_camera_is_refused_with_its_field() {
        let good = shifted();
        good.validate().expect("good");
        let bad = [
            (PinholeCamera { eye_in_world: Vec3::NAN, ..good }, "eye_in_world"),
            (PinholeCamera { world_from_camera: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..good }, "world_from_camera"),
            (PinholeCamera { focal_px: Vec2::new(0.0, 1.0), ..good }, "focal_px"),
            (PinholeCamera { principal_px: Vec2::splat(f32::INFINITY), ..good }, "principal_px"),
            (PinholeCamera { near_m: 0.0, ..good }, "near_m"),
            (PinholeCamera { size_px: UVec2::new(0, 0), ..good }, "size_px"),
            (PinholeCamera { size_px: UVec2::splat(65_535), ..good }, "size_px"),
        ];
        for (camera, field) in bad {
            let error = camera.validate().expect_err(field);
            assert!(error.to_string().contains(field), "{error}");
        }
    }
}
