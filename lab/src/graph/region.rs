//! Convex regions of space: their corners, and whether two are apart.

use glam::{DMat3, DVec3};

use super::plane::Plane;

/// Points this far outside count as on the border.
pub const BORDER_M: f64 = 1e-6;

/// How far a point lies inside of all planes; negative outside.
pub fn depth_m(planes: &[Plane], point: DVec3) -> f64 {
    planes.iter().map(|plane| plane.depth_m(point)).fold(f64::INFINITY, f64::min)
}

/// The part of a line's span that lies inside of all planes.
pub fn cut<'p>(
    planes: impl Iterator<Item = &'p Plane>,
    origin: DVec3,
    direction: DVec3,
    span: [f64; 2],
) -> Option<[f64; 2]> {
    let mut span = span;
    for plane in planes {
        span = plane.cut(origin, direction, span);
    }
    (span[0] < span[1]).then_some(span)
}

/// The corners of a region: the points in three of its planes and outside of none.
pub fn corners(planes: &[Plane]) -> Vec<DVec3> {
    let mut corners = Vec::new();
    for (i, a) in planes.iter().enumerate() {
        for (j, b) in planes.iter().enumerate().skip(i + 1) {
            for c in &planes[j + 1..] {
                corners.extend(common_point(a, b, c).filter(|point| depth_m(planes, *point) >= -BORDER_M));
            }
        }
    }
    corners
}

fn common_point(a: &Plane, b: &Plane, c: &Plane) -> Option<DVec3> {
    let rows = DMat3::from_cols(a.inwards, b.inwards, c.inwards).transpose();
    let is_point = rows.determinant().abs() > 1e-9;
    is_point.then(|| rows.inverse() * DVec3::new(a.least_m, b.least_m, c.least_m))
}

/// Whether a plane of either region has all corners of the other outside.
pub fn are_apart(first: &[Plane], second: &[Plane], corners: [&[DVec3]; 2]) -> bool {
    first.iter().any(|plane| is_behind(plane, corners[1])) || second.iter().any(|plane| is_behind(plane, corners[0]))
}

fn is_behind(plane: &Plane, corners: &[DVec3]) -> bool {
    corners.iter().all(|corner| plane.depth_m(*corner) <= BORDER_M)
}
