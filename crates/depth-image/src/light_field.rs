//! Layered light fields: parallel cameras that look at a scene from many directions, and the light on all of their lines.

use glam::{Mat3A, Quat, UVec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::layered::{check_lines, check_plane};
use crate::projection::{check_finite, check_range};
use crate::{Aabb, CameraError, LightDirections, ParallelCamera, SampleImageError, ViewPart};

/// Lines along each side of the square of a direction.
pub const LIGHT_FIELD_SIDES: std::ops::RangeInclusive<u32> = 16..=90;

/// The lines of a light field around a box: a square of parallel lines for each direction. As an image, a row has the lines of a pair
/// of opposite directions, one square after the other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LightFieldCamera {
    /// Surfaces lie in it.
    pub bounds: Aabb,
    /// All directions, of which the camera may have a part.
    pub directions: LightDirections,
    /// Lines along each side of a square.
    pub side_px: u32,
    /// The first pair of directions.
    pub first_pair: u32,
    /// Pairs of opposite directions.
    pub pairs: u32,
}

impl LightFieldCamera {
    /// All directions around a box.
    #[must_use]
    pub fn around(bounds: Aabb, directions: LightDirections, side_px: u32) -> Self {
        Self { bounds, directions, side_px, first_pair: 0, pairs: directions.pairs() }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is not finite or out of range.
    pub fn validate(&self) -> Result<(), CameraError> {
        let Self { bounds, directions, side_px, first_pair, pairs } = *self;
        let diagonal_m = bounds.size().length();
        check_finite("bounds", bounds.min.is_finite() && bounds.max.is_finite() && diagonal_m.is_finite())?;
        check_range("bounds", diagonal_m, diagonal_m > 1e-6 && !bounds.is_empty(), "a box with an extent")?;
        check_range("side_px", side_px, LIGHT_FIELD_SIDES.contains(&side_px), "from 16 to 90")?;
        let end = u64::from(first_pair) + u64::from(pairs);
        let are_pairs = end <= u64::from(directions.pairs()) && pairs > 0;
        check_range("pairs", end as f64, are_pairs, "at least 1, and not beyond the last")
    }

    /// Columns and rows as an image: lines of a pair, and pairs.
    #[must_use]
    pub fn size_px(&self) -> UVec2 {
        UVec2::new(2 * self.side_px * self.side_px, self.pairs)
    }

    /// Lines of all directions.
    #[must_use]
    pub fn line_count(&self) -> usize {
        let [columns, rows] = self.size_px().to_array().map(|side| side as usize);
        columns * rows
    }

    /// Some rows of the whole.
    #[must_use]
    pub fn part(&self, part: &ViewPart) -> Self {
        Self { first_pair: self.first_pair + part.first_px.y, pairs: part.size_px.y, ..*self }
    }

    /// Depths of samples are at most this, metres.
    #[must_use]
    pub fn range_m(&self) -> f32 {
        self.bounds.size().length() * (1.0 + 1e-3)
    }

    /// The camera that meets, first of all, the light that goes `towards` a unit vector. That of the opposite direction has the same
    /// lines, with columns and depths counted from their other ends.
    #[must_use]
    pub fn lines(&self, towards: Vec3) -> ParallelCamera {
        let forward = -towards;
        let slightest = forward.abs();
        let across = if slightest.x <= slightest.y && slightest.x <= slightest.z {
            Vec3::X
        } else if slightest.y <= slightest.z {
            Vec3::Y
        } else {
            Vec3::Z
        };
        let right = forward.cross(across).normalize_or_zero();
        let up = right.cross(forward);
        let frame = Mat3A::from_cols(right.into(), up.into(), (-forward).into());
        let [width_m, height_m] = [right, up].map(|axis| axis.abs().dot(self.bounds.size()));
        let range_m = self.range_m();
        // The outermost lines pass along the faces. A box may be seen edge-on.
        let spacing_m = width_m.max(height_m).max(range_m * 1e-3) / (self.side_px - 1) as f32;
        let half_m = 0.5 * self.side_px as f32 * spacing_m;
        ParallelCamera {
            corner_in_world: self.bounds.center() + (up - right) * half_m - forward * (0.5 * range_m),
            world_from_camera: Quat::from_mat3a(&frame).normalize(),
            spacing_m,
            size_px: UVec2::splat(self.side_px),
            range_m,
        }
    }
}

/// The light of all surfaces on the lines of a light field (Lischinski §3.2). A surface is a sample of the directions that it faces.
#[derive(Debug, Clone, PartialEq)]
pub struct LayeredLightField {
    /// The lines: direction after direction, each row after row.
    pub camera: LightFieldCamera,
    /// The number of the first sample of each line, and after the last line the number of all samples.
    pub first: Vec<u32>,
    /// Metres from the reference plane of the direction's camera; does not fall along a line.
    pub planar_depth_m: Vec<f32>,
    /// Radiance towards the direction, linear RGB9E5.
    pub radiance_rgb9e5: Vec<u32>,
}

impl LayeredLightField {
    /// Checks the camera, the sizes of planes, the prefix sums, and the order of depths.
    ///
    /// # Errors
    /// The first fault.
    pub fn validate(&self) -> Result<(), SampleImageError> {
        self.camera.validate()?;
        let samples = self.planar_depth_m.len();
        check_plane("first", self.first.len(), self.camera.line_count() + 1)?;
        check_plane("radiance", self.radiance_rgb9e5.len(), samples)?;
        check_lines(&self.first, &self.planar_depth_m, self.camera.range_m())
    }

    /// Number of samples.
    #[must_use]
    pub fn sample_count(&self) -> usize {
        self.planar_depth_m.len()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::PixelDepth;

    fn camera() -> LightFieldCamera {
        let bounds = Aabb { min: Vec3::new(-2.0, 0.0, -1.0), max: Vec3::new(3.0, 1.0, 4.0) };
        LightFieldCamera::around(bounds, LightDirections::D66, 16)
    }

    #[test]
    fn lines_of_a_pair_are_the_same_from_their_other_ends() {
        let camera = camera();
        for pair in LightDirections::D66.all().chunks(2) {
            let [own, other] = [pair[0], pair[1]].map(|direction| camera.lines(direction.towards));
            own.validate().unwrap();
            for (x, y, depth_m) in [(0.5, 0.5, 1.0), (3.5, 15.5, 2.5), (8.25, 2.0, 0.1)] {
                let at = PixelDepth { pixel: Vec2::new(x, y), planar_depth_m: depth_m };
                let turned = PixelDepth { pixel: Vec2::new(16.0 - x, y), planar_depth_m: own.range_m - depth_m };
                assert!(own.unproject(at).distance(other.unproject(turned)) < 1e-4);
            }
        }
    }

    #[test]
    fn lines_reach_all_of_the_box_and_look_against_their_light() {
        let camera = camera();
        let Aabb { min, max } = camera.bounds;
        let corners = (0..8).map(|n| Vec3::select(glam::BVec3::new(n & 1 > 0, n & 2 > 0, n & 4 > 0), max, min));
        let corners: Vec<Vec3> = corners.collect();
        for direction in LightDirections::D66.all() {
            let lines = camera.lines(direction.towards);
            assert!(lines.axes_in_world()[2].distance(-direction.towards) < 1e-5);
            for &corner in &corners {
                let at = lines.project(corner).unwrap();
                assert!(at.pixel.min_element() >= 0.49 && at.pixel.max_element() <= 15.51, "{}", at.pixel);
            }
        }
    }

    #[test]
    fn faults_are_named() {
        let good = camera();
        assert_eq!(good.validate(), Ok(()));
        let named = |camera: LightFieldCamera| match camera.validate().expect_err("a fault") {
            CameraError::NotFinite { field } | CameraError::OutOfRange { field, .. } => field,
        };
        for side_px in [0, 15, 91] {
            assert_eq!(named(LightFieldCamera { side_px, ..good }), "side_px");
        }
        for (first_pair, pairs) in [(0, 34), (33, 1), (0, 0), (u32::MAX, u32::MAX)] {
            assert_eq!(named(LightFieldCamera { first_pair, pairs, ..good }), "pairs");
        }
        assert_eq!(named(LightFieldCamera { bounds: Aabb::EMPTY, ..good }), "bounds");
        assert_eq!(named(LightFieldCamera { bounds: Aabb { min: Vec3::NAN, max: Vec3::ONE }, ..good }), "bounds");
        let lines = good.line_count();
        let image = LayeredLightField {
            camera: good,
            first: vec![0; lines + 1],
            planar_depth_m: Vec::new(),
            radiance_rgb9e5: Vec::new(),
        };
        assert_eq!((image.validate(), lines), (Ok(()), 66 * 16 * 16));
        let short = LayeredLightField { radiance_rgb9e5: vec![0], ..image.clone() };
        assert!(matches!(short.validate(), Err(SampleImageError::Plane { plane: "radiance", len: 1, expected: 0 })));
        let mut first = image.first.clone();
        *first.last_mut().unwrap() = 1;
        let deep = LayeredLightField { first, planar_depth_m: vec![8.0], radiance_rgb9e5: vec![0], ..image };
        assert!(matches!(deep.validate(), Err(SampleImageError::Depth { layer: 0, .. })));
    }
}
