//! Equirectangular environment maps: radiance from far away, for every direction.

use std::f32::consts::{PI, TAU};

use glam::{UVec2, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::{linear_from_rgb9e5, rgb9e5_from_linear};

/// Columns and rows of the largest map.
pub const MAX_ENVIRONMENT_SIZE_PX: UVec2 = UVec2::new(4096, 2048);

/// Radiance by direction. Columns span 360°: the middle of a row looks along −Z, its right half towards +X. Rows span
/// 180°, from +Y at the top to −Y. Radiance is linear RGB, in RGB9E5: channels above 65,408 are clamped to it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct EnvironmentMap {
    size_px: UVec2,
    /// Row by row, top-down.
    texels_rgb9e5: Vec<u32>,
}

/// A map that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum EnvironmentMapError {
    #[error("size: {width_px}×{height_px} texels, expected 1×1 to 4096×2048")]
    Size { width_px: u32, height_px: u32 },
    #[error("texels: there are {found}, the size needs {expected}")]
    Count { found: usize, expected: usize },
    #[error("radiance: {radiance_linear} in column {column} of row {row} is negative or not finite")]
    Radiance { radiance_linear: Vec3, column: u32, row: u32 },
}

impl EnvironmentMap {
    /// A map of radiances, row by row.
    ///
    /// # Errors
    /// A size beyond the limits, another number of radiances, or one that is negative or not finite.
    pub fn new(size_px: UVec2, radiance_linear: &[Vec3]) -> Result<Self, EnvironmentMapError> {
        check_size(size_px, radiance_linear.len())?;
        let bad = radiance_linear.iter().position(|radiance| !radiance.is_finite() || radiance.min_element() < 0.0);
        if let Some(at) = bad {
            let column = at as u32 % size_px.x;
            let row = at as u32 / size_px.x;
            return Err(EnvironmentMapError::Radiance { radiance_linear: radiance_linear[at], column, row });
        }
        Ok(Self {
            size_px,
            texels_rgb9e5: radiance_linear.iter().map(|&radiance| rgb9e5_from_linear(radiance)).collect(),
        })
    }

    /// A map of packed radiances, row by row; every word is one.
    ///
    /// # Errors
    /// A size beyond the limits, or another number of texels.
    pub fn from_texels(size_px: UVec2, texels_rgb9e5: Vec<u32>) -> Result<Self, EnvironmentMapError> {
        check_size(size_px, texels_rgb9e5.len())?;
        Ok(Self { size_px, texels_rgb9e5 })
    }

    /// Checks the size, as [`EnvironmentMap::from_texels`] does.
    ///
    /// # Errors
    /// As [`EnvironmentMap::from_texels`].
    pub fn validate(&self) -> Result<(), EnvironmentMapError> {
        check_size(self.size_px, self.texels_rgb9e5.len())
    }

    /// Columns and rows.
    #[must_use]
    pub fn size_px(&self) -> UVec2 {
        self.size_px
    }

    /// Radiances in RGB9E5, row by row.
    #[must_use]
    pub fn texels_rgb9e5(&self) -> &[u32] {
        &self.texels_rgb9e5
    }

    /// The radiance of a texel.
    #[must_use]
    pub fn texel_linear(&self, column: u32, row: u32) -> Vec3 {
        linear_from_rgb9e5(self.texels_rgb9e5[(row * self.size_px.x + column) as usize])
    }

    /// The solid angle of each texel of a row, in steradians.
    #[must_use]
    pub fn solid_angle_sr(&self, row: u32) -> f32 {
        let height = f64::from(self.size_px.y);
        let [top, bottom] = [row, row + 1].map(|edge| (std::f64::consts::PI * f64::from(edge) / height).cos());
        (std::f64::consts::TAU / f64::from(self.size_px.x) * (top - bottom)) as f32
    }
}

fn check_size(size_px: UVec2, texels: usize) -> Result<(), EnvironmentMapError> {
    if size_px.min_element() == 0 || size_px.cmpgt(MAX_ENVIRONMENT_SIZE_PX).any() {
        return Err(EnvironmentMapError::Size { width_px: size_px.x, height_px: size_px.y });
    }
    let expected = size_px.element_product() as usize;
    if texels == expected { Ok(()) } else { Err(EnvironmentMapError::Count { found: texels, expected }) }
}

/// The direction of a place in a map, in shares of its width and height.
pub(crate) fn direction_at(share: Vec2) -> Vec3 {
    let ((sin_east, cos_east), (sin_down, cos_down)) = ((TAU * (share.x - 0.5)).sin_cos(), (PI * share.y).sin_cos());
    Vec3::new(sin_east * sin_down, cos_down, -cos_east * sin_down)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_invalid_map_is_refused_with_its_field() {
        let grey = |count| vec![Vec3::ONE; count];
        for (size, count) in [([0, 0], 0), ([0, 4], 0), ([4, 0], 0), ([8192, 1], 8192), ([1, 4096], 4096)] {
            let refused = EnvironmentMap::new(size.into(), &grey(count)).unwrap_err();
            assert!(refused.to_string().starts_with("size: "), "{refused}");
        }
        assert_eq!(
            EnvironmentMap::new(UVec2::new(4, 2), &grey(7)),
            Err(EnvironmentMapError::Count { found: 7, expected: 8 })
        );
        for bad in [f32::NAN, f32::INFINITY, -1.0] {
            let mut radiance = grey(8);
            radiance[6].y = bad;
            let refused = EnvironmentMap::new(UVec2::new(4, 2), &radiance).unwrap_err().to_string();
            assert!(refused.starts_with("radiance: ") && refused.contains("column 2 of row 1"), "{refused}");
        }
        let bright = EnvironmentMap::new(UVec2::ONE, &[Vec3::splat(1e30)]).unwrap();
        assert_eq!(bright.texel_linear(0, 0), Vec3::splat(65_408.0));
    }

    #[test]
    fn texels_share_the_whole_sphere() {
        let map = EnvironmentMap::new(UVec2::new(6, 5), &[Vec3::ONE; 30]).unwrap();
        let sum: f32 = (0..5).map(|row| 6.0 * map.solid_angle_sr(row)).sum();
        assert!((sum / (4.0 * PI) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_middle_looks_forward_and_the_right_half_east() {
        for (share, direction) in
            [([0.5, 0.5], Vec3::NEG_Z), ([0.75, 0.5], Vec3::X), ([0.0, 0.5], Vec3::Z), ([0.3, 0.0], Vec3::Y)]
        {
            assert!(direction_at(share.into()).distance(direction) < 1e-6, "{share:?}");
        }
    }
}
