//! The parallel camera: its rays are lines of one direction, a spacing apart.

use glam::{Mat3A, Quat, UVec2, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::projection::{check_finite, check_range, check_sides, check_unit};
use crate::{CameraError, PixelDepth, Ray, ViewPart};

/// A camera of parallel lines. Planar depth is the distance from its reference plane; planes are linear in depth, not in inverse
/// depth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ParallelCamera {
    /// The corner of the first pixel, on the reference plane.
    pub corner_in_world: Vec3,
    /// Camera to world, a unit quaternion. The camera looks down -Z, +Y up.
    pub world_from_camera: Quat,
    /// From one line to the next, metres.
    pub spacing_m: f32,
    /// Columns and rows.
    pub size_px: UVec2,
    /// Surfaces beyond this planar depth are invisible, metres.
    pub range_m: f32,
}

impl ParallelCamera {
    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is not finite or out of range.
    pub fn validate(&self) -> Result<(), CameraError> {
        check_finite("corner_in_world", self.corner_in_world.is_finite())?;
        check_finite("world_from_camera", self.world_from_camera.is_finite())?;
        check_finite("spacing_m", self.spacing_m.is_finite())?;
        check_finite("range_m", self.range_m.is_finite())?;
        check_unit("world_from_camera", self.world_from_camera)?;
        for (field, metres) in [("spacing_m", self.spacing_m), ("range_m", self.range_m)] {
            check_range(field, metres, (1e-9..=1e9).contains(&f64::from(metres)), "from 1e-9 to 1e9")?;
        }
        check_sides(self.size_px)
    }

    /// The direction in which columns, rows and depths rise: unit vectors.
    #[must_use]
    pub fn axes_in_world(&self) -> [Vec3; 3] {
        let axes = Mat3A::from_quat(self.world_from_camera);
        [axes.x_axis.into(), Vec3::from(-axes.y_axis), Vec3::from(-axes.z_axis)]
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixel_count(&self) -> usize {
        self.size_px.x as usize * self.size_px.y as usize
    }

    /// The camera of a part of the image.
    #[must_use]
    pub fn part(&self, part: &ViewPart) -> Self {
        let [right, down, _] = self.axes_in_world();
        let first_m = part.first_px.as_vec2() * self.spacing_m;
        let corner_in_world = self.corner_in_world + right * first_m.x + down * first_m.y;
        Self { corner_in_world, size_px: part.size_px, ..*self }
    }

    /// The position and depth of a point; `None` where the camera does not look.
    #[must_use]
    pub fn project(&self, point_in_world: Vec3) -> Option<PixelDepth> {
        let [right, down, forward] = self.axes_in_world();
        let offset = point_in_world - self.corner_in_world;
        let planar_depth_m = offset.dot(forward);
        let pixel = Vec2::new(offset.dot(right), offset.dot(down)) / self.spacing_m;
        (0.0..=self.range_m).contains(&planar_depth_m).then_some(PixelDepth { pixel, planar_depth_m })
    }

    /// The point at a position and depth: the inverse of [`ParallelCamera::project`].
    #[must_use]
    pub fn unproject(&self, at: PixelDepth) -> Vec3 {
        self.ray(at.pixel).at(at.planar_depth_m)
    }

    /// The line of a position; its parameter is planar depth in metres.
    #[must_use]
    pub fn ray(&self, pixel: Vec2) -> Ray {
        let [right, down, forward] = self.axes_in_world();
        let place_m = pixel * self.spacing_m;
        let origin_in_world = self.corner_in_world + right * place_m.x + down * place_m.y;
        Ray { origin_in_world, direction_in_world: forward }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> ParallelCamera {
        ParallelCamera {
            corner_in_world: Vec3::new(1.0, 2.0, -3.0),
            world_from_camera: Quat::from_euler(glam::EulerRot::YXZ, 0.7, -0.3, 0.2),
            spacing_m: 0.25,
            size_px: UVec2::new(40, 30),
            range_m: 20.0,
        }
    }

    #[test]
    fn points_come_back_from_their_pixels_and_depths() {
        let camera = camera();
        for (x, y, planar_depth_m) in [(0.5, 0.5, 0.01), (39.5, 0.5, 19.99), (12.25, 29.0, 7.5)] {
            let at = PixelDepth { pixel: Vec2::new(x, y), planar_depth_m };
            let back = camera.project(camera.unproject(at)).unwrap();
            assert!(back.pixel.distance(at.pixel) < 1e-4 && (back.planar_depth_m - planar_depth_m).abs() < 1e-4);
        }
        let beyond = |planar_depth_m| camera.unproject(PixelDepth { pixel: Vec2::ONE, planar_depth_m });
        assert_eq!(camera.project(beyond(20.01)), None);
        assert_eq!(camera.project(beyond(-0.01)), None);
    }

    #[test]
    fn a_part_has_the_lines_of_the_whole() {
        let camera = camera();
        let first_px = UVec2::new(8, 16);
        let part = camera.part(&ViewPart { first_px, size_px: UVec2::new(4, 5) });
        let [own, whole] = [part.ray(Vec2::new(1.5, 2.5)), camera.ray(Vec2::new(9.5, 18.5))];
        assert!(own.origin_in_world.distance(whole.origin_in_world) < 1e-5);
        assert_eq!(own.direction_in_world, whole.direction_in_world);
    }

    #[test]
    fn what_cannot_be_used_is_named() {
        let named = |camera: ParallelCamera| match camera.validate().expect_err("an unusable camera") {
            CameraError::NotFinite { field } | CameraError::OutOfRange { field, .. } => field,
        };
        let good = camera();
        assert_eq!(good.validate(), Ok(()));
        for spacing_m in [f32::NAN, 0.0, -1.0, 1e-10, 1e10] {
            assert_eq!(named(ParallelCamera { spacing_m, ..good }), "spacing_m");
        }
        for range_m in [f32::INFINITY, 0.0, -2.0] {
            assert_eq!(named(ParallelCamera { range_m, ..good }), "range_m");
        }
        assert_eq!(named(ParallelCamera { size_px: UVec2::new(0, 1), ..good }), "size_px");
        assert_eq!(named(ParallelCamera { size_px: UVec2::new(1, 16_385), ..good }), "size_px");
        assert_eq!(named(ParallelCamera { corner_in_world: Vec3::NAN, ..good }), "corner_in_world");
        let world_from_camera = Quat::from_xyzw(1.0, 1.0, 0.0, 0.0);
        assert_eq!(named(ParallelCamera { world_from_camera, ..good }), "world_from_camera");
    }
}
