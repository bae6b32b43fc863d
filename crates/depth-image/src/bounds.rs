//! Axis-aligned boxes.

use glam::{BVec3, Vec3};
use serde::{Deserialize, Serialize};

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

    /// The smallest box around `boxes`; empty ones count for nothing.
    #[must_use]
    pub fn of_boxes(boxes: &[Self]) -> Self {
        let boxes = boxes.iter().filter(|b| !b.is_empty());
        boxes.fold(Self::EMPTY, |all, b| all.grown_to(b.min).grown_to(b.max))
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

    /// The distance to the near plane of cameras that name none: a thousandth of the diagonal, metres.
    #[must_use]
    pub fn near_m(&self) -> f32 {
        (self.size().length() * 1e-3).max(1e-6)
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
        std::array::from_fn(|i| Vec3::select(BVec3::new(i & 1 == 0, i & 2 == 0, i & 4 == 0), self.min, self.max))
    }
}
