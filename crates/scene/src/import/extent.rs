//! The extent of a scene, and its place and size in the world.

use std::ops::RangeInclusive;

use glam::{BVec3, DVec3};

use crate::SourceSpace;
use crate::error::Fault;

/// Distance from the origin beyond which `f32` loses a millimetre.
const FAR_M: f64 = 1e4;
/// The extents of a scene that is drawn in the unit of its file. Others are scaled to about a metre, because shaders multiply
/// four lengths in `f32`.
const DRAWABLE_EXTENT_M: RangeInclusive<f64> = 1e-3..=1e6;
/// The extents of a scene that is shown at all: that of a model is far within, and that of a damaged file is not.
const POSSIBLE_EXTENT: RangeInclusive<f64> = 1e-30..=1e12;
/// The extents of a mesh that is kept in its own unit, for the same reason.
pub(super) const DRAWABLE_MESH_EXTENT: RangeInclusive<f64> = 1e-6..=1e8;
/// Distance in diagonals beyond which `f32` loses a hundred-thousandth of the model.
const FAR_IN_DIAGONALS: f64 = 1e3;

/// The space of a source with these bounds. A source that moves may be in one point at rest.
pub(super) fn source_space(bounds: Box3, is_animated: bool) -> Result<SourceSpace, Fault> {
    let extent = bounds.extent();
    if !(bounds.min.is_finite() && bounds.max.is_finite()) {
        return Err(Fault::malformed("scene", "its bounds are not finite"));
    }
    if extent == 0.0 && !is_animated {
        return Err(Fault::malformed("scene", "it has no extent: all its triangles are in one point"));
    }
    if extent != 0.0 && !POSSIBLE_EXTENT.contains(&extent) {
        return Err(Fault::malformed("scene", format!("its extent of {extent:e} is out of range")));
    }
    let metres_per_unit = scale_to_drawable(extent, &DRAWABLE_EXTENT_M);
    Ok(SourceSpace { origin_in_source: recentring_offset(bounds, metres_per_unit), metres_per_unit })
}

/// The factor that brings an extent to 1…2, or 1 for one that is drawable or 0. It is a power of two: scaling is exact.
pub(super) fn scale_to_drawable(extent: f64, drawable: &RangeInclusive<f64>) -> f64 {
    if extent == 0.0 || !extent.is_finite() || drawable.contains(&extent) {
        1.0
    } else {
        (-extent.log2().floor()).exp2()
    }
}

/// Offset that moves `bounds` to the origin, in whole units unless the bounds are too small or will be scaled.
pub(super) fn recentring_offset(bounds: Box3, scale: f64) -> DVec3 {
    if bounds.is_empty() {
        return DVec3::ZERO;
    }
    let centre = bounds.center();
    let diagonal = bounds.diagonal();
    let distance = centre.length();
    if distance * scale <= FAR_M && distance <= FAR_IN_DIAGONALS * diagonal {
        DVec3::ZERO
    } else if diagonal > 10.0 && scale == 1.0 {
        centre.round()
    } else {
        centre
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Box3 {
    min: DVec3,
    max: DVec3,
}

impl Box3 {
    pub(super) fn around(points: impl Iterator<Item = DVec3>) -> Self {
        let empty = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };
        points.fold(empty, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    pub(crate) fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    pub(crate) fn diagonal(&self) -> f64 {
        (self.max - self.min).length()
    }

    /// The longest side; 0 for the empty box.
    pub(super) fn extent(&self) -> f64 {
        (self.max - self.min).max_element().max(0.0)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    pub(super) fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| DVec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), self.max, self.min))
    }
}
