//! Half-spaces, of which regions are made.

use glam::DVec3;

/// The points with `inwards · p ≥ least_m`; `inwards` has unit length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    pub inwards: DVec3,
    pub least_m: f64,
}

impl Plane {
    /// The plane through a point.
    pub fn through(point: DVec3, inwards: DVec3) -> Self {
        let inwards = inwards.normalize_or_zero();
        Self { inwards, least_m: inwards.dot(point) }
    }

    /// How far a point lies inside; negative outside.
    pub fn depth_m(&self, point: DVec3) -> f64 {
        self.inwards.dot(point) - self.least_m
    }

    pub fn moved_out(&self, by_m: f64) -> Self {
        Self { least_m: self.least_m - by_m, ..*self }
    }

    pub fn is_finite(&self) -> bool {
        self.inwards.is_finite() && self.least_m.is_finite()
    }

    /// The part of a line's span that lies inside.
    pub fn cut(&self, origin: DVec3, direction: DVec3, [near, far]: [f64; 2]) -> [f64; 2] {
        let depth_m = self.depth_m(origin);
        let rise = self.inwards.dot(direction);
        if rise == 0.0 {
            // Along the plane: all of the line or nothing.
            return if depth_m >= 0.0 { [near, far] } else { [near, f64::NEG_INFINITY] };
        }
        let crossing = -depth_m / rise;
        if rise > 0.0 { [near.max(crossing), far] } else { [near, far.min(crossing)] }
    }
}
