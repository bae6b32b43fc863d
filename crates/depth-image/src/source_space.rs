//! The space of a scene's file, and world space in it.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// Relates world space to the space of the scene's file, in double precision: files have coordinates far from their origin, and
/// models of atoms and of planets.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SourceSpace {
    /// The point of the file's space that is the world's origin.
    pub origin_in_source: DVec3,
    /// Metres of the world for each unit of the file; above 0. It is 1 but for models so small or large that `f32` cannot draw
    /// them.
    pub metres_per_unit: f64,
}

impl Default for SourceSpace {
    /// The spaces are the same.
    fn default() -> Self {
        Self::moved(DVec3::ZERO)
    }
}

impl SourceSpace {
    /// World space with another origin.
    #[must_use]
    pub const fn moved(origin_in_source: DVec3) -> Self {
        Self { origin_in_source, metres_per_unit: 1.0 }
    }

    /// A point of the file in world space.
    #[must_use]
    pub fn world_from_source(&self, point_in_source: DVec3) -> Vec3 {
        ((point_in_source - self.origin_in_source) * self.metres_per_unit).as_vec3()
    }

    /// A point of world space in the file's space.
    #[must_use]
    pub fn source_from_world(&self, point_in_world: Vec3) -> DVec3 {
        point_in_world.as_dvec3() / self.metres_per_unit + self.origin_in_source
    }

    /// Returns whether all numbers are finite, and the unit has a length.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.origin_in_source.is_finite() && self.metres_per_unit.is_normal() && self.metres_per_unit > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_come_back_from_the_world() {
        let tiny = SourceSpace { origin_in_source: DVec3::new(3e-12, 0.0, -1e-12), metres_per_unit: 2f64.powi(40) };
        for space in [SourceSpace::default(), SourceSpace::moved(DVec3::new(2.7e6, 0.0, -1.2e6)), tiny] {
            let point_in_world = Vec3::new(1.5, -2.0, 0.25);
            assert_eq!(space.world_from_source(space.source_from_world(point_in_world)), point_in_world);
            assert_eq!(space.world_from_source(space.origin_in_source), Vec3::ZERO);
            assert!(space.is_valid());
        }
        assert!(!SourceSpace { metres_per_unit: 0.0, ..tiny }.is_valid());
        assert!(!SourceSpace { metres_per_unit: f64::NAN, ..tiny }.is_valid());
        assert!(!SourceSpace::moved(DVec3::INFINITY).is_valid());
    }
}
