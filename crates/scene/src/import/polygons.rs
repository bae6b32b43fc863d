//! Meshes of polygons, as OBJ and PLY have them, and triangles of polygons: concave ones, ones with bridges to holes, and
//! ones that are not plane.
//!
//! A polygon is seen along its Newell normal, the mean normal of its outline. Where its first corner sees all others, as in
//! every convex polygon, a fan is right and cheap. All others are cut by `earcut`.

use std::collections::HashMap;
use std::fmt::Arguments;
use std::hash::Hash;

use earcut::Earcut;
use glam::{DVec2, DVec3};

use super::{Import, SourceMesh, normals};
use crate::{Fault, Vertex, at_most};

/// The most corners of a polygon that is cut. An outline that crosses itself may take cubic time: `earcut` then tries all
/// diagonals against all edges.
const MAX_CORNERS_CUT: usize = 1024;
/// The most that a file's polygons may cost together, which takes some seconds. A polygon costs the cube of its number of corners, and
/// nothing if it is convex.
const MAX_COST: u64 = 1 << 36;
// Warnings of polygons that are left out, and of those that are not cut.
pub(crate) const TOO_SHORT: &str = "faces of fewer than three corners are left out";
pub(crate) const UNKNOWN_VERTEX: &str = "faces with a corner that is no vertex of the file are left out";
const NOT_FINITE: &str = "faces with a vertex that is not finite are left out";
const TOO_COSTLY: &str = "faces of too many corners to be cut are shown as if they were convex";

/// Makes vertices of the corners of faces, and triangles of the faces. Corners at one position share a vertex if their `K`,
/// which stands for all else that they have, is equal.
pub(crate) struct PolygonMesh<'a, K> {
    import: &'a Import<'a>,
    positions_in_source: &'a [DVec3],
    mesh: SourceMesh,
    triangles_of_material: Vec<Triangles>,
    /// The first corner at each position, with its vertex.
    first: Vec<Option<(K, u32)>>,
    /// The vertices of corners that differ from the first one at their position.
    others: HashMap<(u32, K), u32>,
    cutter: PolygonCutter,
}

#[derive(Default, Clone)]
struct Triangles {
    indices: Vec<u32>,
    /// Whether each triangle has a flat normal where it has no other.
    is_flat: Vec<bool>,
}

/// A face whose corners are at known positions.
pub(crate) struct Face<'p> {
    /// The face in messages.
    pub place: Arguments<'p>,
    pub polygon: Vec<DVec3>,
    /// The number of the face's material among those of the mesh.
    pub material: usize,
    pub is_flat: bool,
}

impl<'a, K: Copy + Eq + Hash> PolygonMesh<'a, K> {
    pub(crate) fn new(positions_in_source: &'a [DVec3], materials: usize, import: &'a Import<'a>) -> Self {
        Self {
            import,
            positions_in_source,
            mesh: SourceMesh::default(),
            triangles_of_material: vec![Triangles::default(); materials],
            first: vec![None; positions_in_source.len()],
            others: HashMap::new(),
            cutter: PolygonCutter::new(),
        }
    }

    /// The outline of a face; `None`, with a warning, for a face that is left out.
    pub(crate) fn polygon(&self, positions: impl Iterator<Item = u32>, place: Arguments) -> Option<Vec<DVec3>> {
        let polygon: Option<Vec<DVec3>> =
            positions.map(|position| self.positions_in_source.get(position as usize).copied()).collect();
        if polygon.is_none() {
            self.import.warnings.count(UNKNOWN_VERTEX, place);
        }
        let is_finite = polygon.iter().flatten().all(|p| p.is_finite());
        if !is_finite {
            self.import.warnings.count(NOT_FINITE, place);
        }
        polygon.filter(|_| is_finite)
    }

    /// The vertex of a corner at a known position, which `make` makes unless there is one.
    pub(crate) fn vertex(&mut self, position: u32, key: K, make: impl FnOnce() -> Vertex) -> u32 {
        let next = self.mesh.vertices.len() as u32;
        let number = match &mut self.first[position as usize] {
            Some((first, number)) if *first == key => *number,
            Some(_) => *self.others.entry((position, key)).or_insert(next),
            first => first.insert((key, next)).1,
        };
        if number == next {
            self.mesh.positions_in_mesh.push(self.positions_in_source[position as usize]);
            self.mesh.vertices.push(make());
        }
        number
    }

    /// Adds the triangles of a face, whose corners have `vertices`.
    pub(crate) fn push(&mut self, face: &Face, vertices: &[u32]) -> Result<(), Fault> {
        let Import { limits, warnings, .. } = self.import;
        at_most(face.place, self.mesh.vertices.len() as u64, limits.vertices)?;
        let triangles = self.cutter.triangles(&face.polygon, || warnings.count(TOO_COSTLY, face.place));
        let into = &mut self.triangles_of_material[face.material];
        into.indices.extend(triangles.iter().map(|&corner| vertices[corner as usize]));
        into.is_flat.resize(into.indices.len() / 3, face.is_flat);
        Ok(())
    }

    /// The mesh with a part for each material that is used, and with normals. `numbers` are the materials' in the scene.
    pub(crate) fn finish(self, numbers: impl IntoIterator<Item = u32>) -> Result<SourceMesh, Fault> {
        let mut mesh = self.mesh;
        let mut is_flat = Vec::new();
        for (triangles, number) in self.triangles_of_material.into_iter().zip(numbers) {
            if !triangles.indices.is_empty() {
                mesh.push_part(triangles.indices, number);
                is_flat.extend(triangles.is_flat);
            }
        }
        if mesh.indices.is_empty() {
            let fault = self.import.warnings.no_triangles([UNKNOWN_VERTEX, NOT_FINITE, TOO_SHORT]);
            return Err(fault.unwrap_or_else(|| Fault::malformed("scene", "it has no triangles")));
        }
        normals::fill(&mut mesh, |triangle| is_flat[triangle]);
        Ok(mesh)
    }
}

/// The triangles of a strip. Every other triangle is reversed; those that repeat a vertex only connect parts of the
/// strip.
pub(crate) fn triangles_of_strip(indices: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let windows = indices.windows(3).enumerate();
    let turned = windows.map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] });
    turned.filter(|[a, b, c]| a != b && b != c && a != c)
}

/// Cuts the polygons of a file into triangles; keeps its memory from one to the next.
struct PolygonCutter {
    cost_left: u64,
    earcut: Earcut<f64>,
    outline: Vec<DVec2>,
    corners: Vec<u32>,
}

impl PolygonCutter {
    fn new() -> Self {
        Self { cost_left: MAX_COST, earcut: Earcut::new(), outline: Vec::new(), corners: Vec::new() }
    }

    /// The triangles of a polygon as numbers of its corners, three a triangle, in the polygon's own direction. Fewer than three
    /// corners have none. Calls `warn_of_cost` where the polygon is too costly to be cut: its triangles are then a fan.
    fn triangles(&mut self, polygon: &[DVec3], warn_of_cost: impl FnOnce()) -> &[u32] {
        self.corners.clear();
        self.outline.clear();
        let normal = if polygon.len() > 3 { newell_normal(polygon).try_normalize() } else { None };
        if let Some(normal) = normal {
            let (u, v) = normal.any_orthonormal_pair();
            self.outline.extend(polygon.iter().map(|p| DVec2::new((p - polygon[0]).dot(u), (p - polygon[0]).dot(v))));
        }
        let is_fan = self.outline.is_empty() || sees_all_from_first(&self.outline);
        if !is_fan && !self.pays_for(polygon.len()) {
            warn_of_cost();
        } else if !is_fan {
            self.earcut.earcut(self.outline.iter().map(|p| p.to_array()), &[], &mut self.corners);
            turn_round_with(&mut self.corners, &self.outline);
        }
        if self.corners.is_empty() {
            let fan = (2..polygon.len() as u32).flat_map(|last| [0, last - 1, last]);
            self.corners.extend(fan);
        }
        &self.corners
    }

    /// Returns whether a polygon of so many corners may be cut, and counts its cost if so.
    fn pays_for(&mut self, corners: usize) -> bool {
        let left = (corners <= MAX_CORNERS_CUT).then(|| self.cost_left.checked_sub((corners as u64).pow(3))).flatten();
        left.inspect(|&left| self.cost_left = left).is_some()
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
    let areas = corners.chunks_exact(3).map(|triangle| {
        let [a, b, c] = [0, 1, 2].map(|i| outline[triangle[i] as usize]);
        (b - a).perp_dot(c - a)
    });
    if areas.sum::<f64>() < 0.0 {
        corners.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The areas of a polygon's triangles along `normal`.
    fn areas(polygon: &[[f64; 3]], normal: DVec3) -> Vec<f64> {
        let polygon: Vec<DVec3> = polygon.iter().map(|&p| p.into()).collect();
        let triangles = PolygonCutter::new().triangles(&polygon, || panic!("too costly")).to_vec();
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
        let triangles = |polygon: &[DVec3]| PolygonCutter::new().triangles(polygon, || panic!("too costly")).to_vec();
        assert_eq!(triangles(&[DVec3::ONE; 5]), [0, 1, 2, 0, 2, 3, 0, 3, 4]);
        assert!(triangles(&[DVec3::ONE; 2]).is_empty());
        assert!(triangles(&[]).is_empty());
    }

    /// A closed line that crosses itself in its middle; its lobes differ, so that it has an area.
    fn figure_eight(corners: u32) -> Vec<DVec3> {
        let angles = (0..corners).map(|i| f64::from(i) / f64::from(corners) * std::f64::consts::TAU + 0.1);
        angles.map(|angle| DVec3::new(angle.cos() * (1.5 + angle.cos()), (2.0 * angle).sin(), 0.0)).collect()
    }

    #[test]
    fn outlines_that_cross_themselves_end_in_time_and_use_up_the_cost() {
        let start = std::time::Instant::now();
        let mut cutter = PolygonCutter::new();
        let mut refused = 0;
        for _ in 0..100 {
            let triangles = cutter.triangles(&figure_eight(MAX_CORNERS_CUT as u32), || refused += 1);
            assert!(!triangles.is_empty());
        }
        assert_eq!(refused, 100 - (MAX_COST / (MAX_CORNERS_CUT as u64).pow(3)) as usize);
        let mut is_refused = false;
        let larger = figure_eight(MAX_CORNERS_CUT as u32 + 1);
        assert_eq!(PolygonCutter::new().triangles(&larger, || is_refused = true).len(), 3 * (larger.len() - 2));
        assert!(is_refused);
        assert!(start.elapsed().as_secs() < 5, "{:?}", start.elapsed());
    }

    #[test]
    fn convex_polygons_of_any_size_cost_nothing() {
        let angles = (0..100_000).map(|i| f64::from(i) / 100_000.0 * std::f64::consts::TAU);
        let circle: Vec<DVec3> = angles.map(|angle| DVec3::new(angle.cos(), angle.sin(), 0.0)).collect();
        let mut cutter = PolygonCutter::new();
        assert_eq!(cutter.triangles(&circle, || panic!("too costly")).len(), 3 * (circle.len() - 2));
        assert_eq!(cutter.cost_left, MAX_COST);
    }
}
