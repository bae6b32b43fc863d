//! Triangles of polygons: concave ones, ones with bridges to holes, and ones that are not plane.
//!
//! A polygon is seen along its Newell normal, the mean normal of its outline. Where its first corner sees all others, as in
//! every convex polygon, a fan is right and cheap. All others are cut by `earcut`.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// The most corners that are cut: cutting may take quadratic time.
const MAX_CORNERS_CUT: usize = 16_384;
/// The warning of polygons that are not cut.
pub(crate) const TOO_MANY_CORNERS: &str = "faces of more than 16384 corners are shown as if they were convex";

/// Cuts polygons into triangles; keeps its memory from one to the next.
pub(crate) struct PolygonCutter {
    earcut: Earcut<f64>,
    outline: Vec<DVec2>,
    corners: Vec<u32>,
}

impl PolygonCutter {
    pub(crate) fn new() -> Self {
        Self { earcut: Earcut::new(), outline: Vec::new(), corners: Vec::new() }
    }

    /// Returns whether a polygon has too many corners to be cut: it is shown as a fan.
    pub(crate) fn is_too_large(polygon: &[DVec3]) -> bool {
        polygon.len() > MAX_CORNERS_CUT
    }

    /// The triangles of a polygon as numbers of its corners, three a triangle, in the polygon's own direction. Fewer than three
    /// corners have none.
    pub(crate) fn triangles(&mut self, polygon: &[DVec3]) -> &[u32] {
        self.corners.clear();
        self.outline.clear();
        let normal = if polygon.len() > 3 { newell_normal(polygon).try_normalize() } else { None };
        if let Some(normal) = normal {
            let (u, v) = normal.any_orthonormal_pair();
            self.outline.extend(polygon.iter().map(|p| DVec2::new((p - polygon[0]).dot(u), (p - polygon[0]).dot(v))));
        }
        let is_fan = self.outline.is_empty() || sees_all_from_first(&self.outline);
        if !is_fan && !Self::is_too_large(polygon) {
            self.earcut.earcut(self.outline.iter().map(|p| p.to_array()), &[], &mut self.corners);
            turn_round_with(&mut self.corners, &self.outline);
        }
        if self.corners.is_empty() {
            let fan = (2..polygon.len() as u32).flat_map(|last| [0, last - 1, last]);
            self.corners.extend(fan);
        }
        &self.corners
    }
}

/// Twice the area of a closed outline, along its normal.
fn newell_normal(polygon: &[DVec3]) -> DVec3 {
    let edges = polygon[1..].windows(2);
    edges.map(|edge| (edge[0] - polygon[0]).cross(edge[1] - polygon[0])).sum()
}

/// Returns whether no triangle of a fan around the first corner is turned round.
fn sees_all_from_first(outline: &[DVec2]) -> bool {
    let mut rim = outline[1..].windows(2);
    rim.all(|edge| (edge[0] - outline[0]).perp_dot(edge[1] - outline[0]) >= 0.0)
}

/// Turns all triangles counter-clockwise where most are clockwise: an outline along its own normal is counter-clockwise.
fn turn_round_with(corners: &mut [u32], outline: &[DVec2]) {
    let area = |triangle: &[u32]| {
        let [a, b, c] = [0, 1, 2].map(|i| outline[triangle[i] as usize]);
        (b - a).perp_dot(c - a)
    };
    if corners.chunks_exact(3).map(area).sum::<f64>() < 0.0 {
        corners.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The areas of a polygon's triangles along `normal`.
    fn areas(polygon: &[[f64; 3]], normal: DVec3) -> Vec<f64> {
        let polygon: Vec<DVec3> = polygon.iter().map(|&p| p.into()).collect();
        let triangles = PolygonCutter::new().triangles(&polygon).to_vec();
        let area = |t: &[u32]| {
            let [a, b, c] = [0, 1, 2].map(|i| polygon[t[i] as usize]);
            (b - a).cross(c - a).dot(normal) * 0.5
        };
        triangles.chunks_exact(3).map(area).collect()
    }

    fn assert_covers(polygon: &[[f64; 3]], normal: DVec3, area: f64) {
        for first in 0..polygon.len() {
            let mut turned = polygon.to_vec();
            turned.rotate_left(first);
            let found = areas(&turned, normal);
            let sum: f64 = found.iter().sum();
            assert!((sum - area).abs() < 1e-9 * area, "from corner {first}: {found:?}");
            assert!(found.iter().all(|a| *a >= -1e-12), "from corner {first}: {found:?}");
        }
    }

    #[test]
    fn an_arrow_is_cut_at_its_notch_from_every_corner() {
        let arrow = [[0., 3., 0.], [-2., -1., 0.], [0., 0., 0.], [2., -1., 0.]];
        assert_covers(&arrow, DVec3::Z, 6.0);
        let mut behind = arrow;
        behind.reverse();
        assert_covers(&behind, DVec3::NEG_Z, 6.0);
    }

    #[test]
    fn a_hole_with_a_bridge_stays_open() {
        let ring = [
            [0., 0., 5.],
            [4., 0., 5.],
            [4., 4., 5.],
            [0., 4., 5.],
            [0., 0., 5.],
            [1., 1., 5.],
            [1., 3., 5.],
            [3., 3., 5.],
            [3., 1., 5.],
            [1., 1., 5.],
        ];
        let found = areas(&ring, DVec3::Z);
        assert!((found.iter().sum::<f64>() - 12.0).abs() < 1e-9 && found.iter().all(|a| *a >= 0.0), "{found:?}");
    }

    #[test]
    fn a_bent_arrow_keeps_its_notch() {
        let arrow = [[0., 3., 0.], [-2., -1., 0.], [0., 0., 0.7], [2., -1., 0.]];
        assert_covers(&arrow, DVec3::Z, 6.0);
    }

    #[test]
    fn polygons_of_any_size_are_cut() {
        let comb = |scale: f64| {
            [[0., 0.], [5., 0.], [5., 3.], [4., 3.], [4., 1.], [2., 1.], [2., 3.], [0., 3.]]
                .map(|[x, y]| [x * scale, 0.0, -y * scale])
        };
        for scale in [1e-12, 1.0, 1e9] {
            assert_covers(&comb(scale), DVec3::Y, 11.0 * scale * scale);
        }
    }

    #[test]
    fn polygons_without_area_become_fans() {
        assert_eq!(PolygonCutter::new().triangles(&[DVec3::ONE; 5]), [0, 1, 2, 0, 2, 3, 0, 3, 4]);
        assert!(PolygonCutter::new().triangles(&[DVec3::ONE; 2]).is_empty());
        assert!(PolygonCutter::new().triangles(&[]).is_empty());
    }
}
