//! Axis-aligned boxes.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::Ray;

/// A box in world space, `min <= max` on every axis unless empty.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Aabb {
    /// Least corner, metres.
    pub min: Vec3,
    /// Greatest corner, metres.
    pub max: Vec3,
}

impl Aabb {
    /// The box without points; `grown_to` makes it the box of one point.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around `points`.
    #[must_use]
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::grown_to)
    }

    /// The smallest box around this box and `point`.
    #[must_use]
    pub fn grown_to(self, point: Vec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// This box with a margin on all sides.
    #[must_use]
    pub fn padded(self, margin_m: f32) -> Self {
        Self { min: self.min - margin_m, max: self.max + margin_m }
    }

    /// Returns whether the box holds no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Middle of the box.
    #[must_use]
    pub fn center(&self) -> Vec3 {
        (self.min + self.max) * 0.5
    }

    /// Edge lengths, metres.
    #[must_use]
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// The eight corners.
    #[must_use]
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            Vec3::new(
                if i & 1 == 0 { self.min.x } else { self.max.x },
                if i & 2 == 0 { self.min.y } else { self.max.y },
                if i & 4 == 0 { self.min.z } else { self.max.z },
            )
        })
    }

    /// The ray's parameters at entry and exit; `None` where it misses. The entry may be negative: the origin
    /// is then inside or beyond.
    #[must_use]
    pub fn intersect(&self, ray: &Ray) -> Option<(f32, f32)> {
        let inverse = ray.direction_in_world.recip();
        let a = (self.min - ray.origin_in_world) * inverse;
        let b = (self.max - ray.origin_in_world) * inverse;
        // A ray along a face gives 0 * inf = NaN there; min/max of std ignore NaN, glam's may not.
        let near = (0..3).fold(f32::NEG_INFINITY, |t, i| t.max(a[i].min(b[i])));
        let far = (0..3).fold(f32::INFINITY, |t, i| t.min(a[i].max(b[i])));
        (near <= far).then_some((near, far))
    }
}
