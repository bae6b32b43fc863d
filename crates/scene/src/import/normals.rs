//! Normals and tangents for sources without them. A corner's normal is the angle-weighted mean of the faces around it that bend
//! away by less than a crease angle. Corners that disagree get separate vertices.

use std::collections::HashMap;

use glam::DVec3;
use meshoptimizer_rs::{Error, Positions, TANGENT_COMPATIBLE, Workspace};

use super::SourceMesh;
use crate::Vertex;

/// Smooth, with edges sharper than 60° kept, for formats without shading information.
pub(crate) const CREASE_60_DEGREES: f64 = 0.5;
/// Flat except for coplanar faces, as glTF 2.0 (3.7.2.1) requires.
pub(crate) const FLAT: f64 = 0.999_999;

/// Around a hub of more corners than this, all are averaged or each is flat: the pairwise comparison would be quadratic.
const MAX_CORNERS_COMPARED: usize = 256;
/// Distance of unit normals up to which two corners share a vertex.
const SAME_DIRECTION: f32 = 1e-4;

/// Normalises the given normals, and computes those of zero length: smooth up to creases of 60°, flat on the triangles of
/// `is_flat`. Triangles that lie with their backs to their given normals are turned round, so `mesh` must be visible from both
/// sides. May add vertices.
pub(crate) fn fill(mesh: &mut SourceMesh, is_flat: impl Fn(usize) -> bool) {
    let mut is_given = Vec::with_capacity(mesh.vertices.len());
    for vertex in &mut mesh.vertices {
        let normal = DVec3::from(vertex.normal.map(f64::from)).try_normalize();
        is_given.push(normal.is_some());
        vertex.normal = normal.unwrap_or(DVec3::ZERO).as_vec3().to_array();
    }
    turn_to_given_normals(mesh, &is_given);
    compute(mesh, &is_given, |triangle| if is_flat(triangle) { FLAT } else { CREASE_60_DEGREES });
}

fn turn_to_given_normals(mesh: &mut SourceMesh, is_given: &[bool]) {
    for triangle in mesh.indices.chunks_exact_mut(3) {
        let corners = [0, 1, 2].map(|i| triangle[i] as usize);
        if corners.iter().all(|&vertex| is_given[vertex]) {
            let [a, b, c] = corners.map(|vertex| mesh.positions_in_mesh[vertex]);
            let given: DVec3 = corners.iter().map(|&v| DVec3::from(mesh.vertices[v].normal.map(f64::from))).sum();
            if (b - a).cross(c - a).dot(given) < 0.0 {
                triangle.swap(1, 2);
            }
        }
    }
}

/// Sets every normal; may add vertices.
pub(crate) fn generate(mesh: &mut SourceMesh, crease_cosine: f64) {
    compute(mesh, &vec![false; mesh.vertices.len()], |_| crease_cosine);
}

/// Sets the normals of all vertices but those of `is_given`; may add vertices. The cosine is that of a triangle's creases.
fn compute(mesh: &mut SourceMesh, is_given: &[bool], crease_cosine: impl Fn(usize) -> f64) {
    if is_given.iter().all(|is_given| *is_given) {
        return;
    }
    let faces = Faces::of(mesh);
    let corners_at = CornersByPosition::of(mesh);
    let original_count = mesh.vertices.len();
    let mut copies = Copies { next: vec![None; original_count], at_hub: HashMap::new() };
    let mut is_set = is_given.to_vec();
    for corner in 0..mesh.indices.len() {
        let vertex = mesh.indices[corner];
        if is_given[vertex as usize] {
            continue;
        }
        let crease_cosine = crease_cosine(corner / 3);
        let around = corners_at.around(vertex);
        let normal = faces.smooth_normal(corner, around, crease_cosine).as_vec3().to_array();
        let is_first = !std::mem::replace(&mut is_set[vertex as usize], true);
        if is_first {
            mesh.vertices[vertex as usize].normal = normal;
        } else if is_hub(around) {
            mesh.indices[corner] = copies.with_normal_at_hub(mesh, vertex, normal);
        } else {
            mesh.indices[corner] = copies.with_normal(mesh, vertex, normal);
        }
    }
    // Vertices without a triangle are never drawn, but must be valid.
    let unused = is_set.iter().enumerate().filter(|(_, set)| !**set);
    unused.for_each(|(i, _)| mesh.vertices[i].normal = [0.0, 1.0, 0.0]);
}

/// Normalises the given normals, and replaces those of zero length by the mean of their faces.
pub(crate) fn repair(mesh: &mut SourceMesh) {
    if mesh.vertices.iter().any(has_no_normal) {
        let faces = Faces::of(mesh);
        let corners_at = CornersByPosition::of(mesh);
        for corner in 0..mesh.indices.len() {
            let vertex = mesh.indices[corner];
            if has_no_normal(&mesh.vertices[vertex as usize]) {
                let normal = faces.smooth_normal(corner, corners_at.around(vertex), -2.0);
                mesh.vertices[vertex as usize].normal = normal.as_vec3().to_array();
            }
        }
    }
    for vertex in &mut mesh.vertices {
        let normal = DVec3::from(vertex.normal.map(f64::from));
        vertex.normal = normal.try_normalize().unwrap_or(DVec3::Y).as_vec3().to_array();
    }
}

fn has_no_normal(vertex: &Vertex) -> bool {
    DVec3::from(vertex.normal.map(f64::from)).length() < 1e-6
}

/// The copies of vertices whose corners disagree.
struct Copies {
    /// The copies of a vertex form a chain, which is at most as long as the number of corners around the vertex.
    next: Vec<Option<u32>>,
    /// The copies of a hub, of which there may be as many as triangles, by the original vertex and the rounded normal.
    at_hub: HashMap<(u32, [i32; 3]), u32>,
}

impl Copies {
    /// The vertex or its copy with about this normal, which may be a new one.
    fn with_normal(&mut self, mesh: &mut SourceMesh, vertex: u32, normal: [f32; 3]) -> u32 {
        let mut at = vertex as usize;
        loop {
            if is_same_direction(mesh.vertices[at].normal, normal) {
                return at as u32;
            }
            match self.next[at] {
                Some(next) => at = next as usize,
                None => break,
            }
        }
        let copy = self.add(mesh, vertex, normal);
        self.next[at] = Some(copy);
        copy
    }

    /// Does what [`Self::with_normal`] does, in constant time.
    fn with_normal_at_hub(&mut self, mesh: &mut SourceMesh, vertex: u32, normal: [f32; 3]) -> u32 {
        if rounded(mesh.vertices[vertex as usize].normal) == rounded(normal) {
            return vertex;
        }
        if let Some(&copy) = self.at_hub.get(&(vertex, rounded(normal))) {
            return copy;
        }
        let copy = self.add(mesh, vertex, normal);
        self.at_hub.insert((vertex, rounded(normal)), copy);
        copy
    }

    fn add(&mut self, mesh: &mut SourceMesh, vertex: u32, normal: [f32; 3]) -> u32 {
        let copy = mesh.copy_of(vertex);
        mesh.vertices[copy as usize].normal = normal;
        self.next.push(None);
        copy
    }
}

/// Whether so many corners meet at a point that they are not compared with each other.
fn is_hub(around: &[u32]) -> bool {
    around.len() > MAX_CORNERS_COMPARED
}

fn rounded(normal: [f32; 3]) -> [i32; 3] {
    normal.map(|c| (c / SAME_DIRECTION).round() as i32)
}

fn is_same_direction(a: [f32; 3], b: [f32; 3]) -> bool {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f32>() < SAME_DIRECTION * SAME_DIRECTION
}

/// Unit normal of each triangle, and the angle at each corner.
struct Faces {
    normals: Vec<DVec3>,
    corner_angles_rad: Vec<f64>,
}

impl Faces {
    fn of(mesh: &SourceMesh) -> Self {
        let mut faces = Self { normals: Vec::new(), corner_angles_rad: Vec::new() };
        for triangle in mesh.indices.chunks_exact(3) {
            let p: [DVec3; 3] = std::array::from_fn(|i| mesh.positions_in_mesh[triangle[i] as usize]);
            faces.normals.push((p[1] - p[0]).cross(p[2] - p[0]).try_normalize().unwrap_or(DVec3::ZERO));
            faces.corner_angles_rad.extend((0..3).map(|i| corner_angle_rad(p[i], p[(i + 1) % 3], p[(i + 2) % 3])));
        }
        faces
    }

    fn smooth_normal(&self, corner: usize, around: &[u32], crease_cosine: f64) -> DVec3 {
        let own = self.normals[corner / 3];
        let compares = !is_hub(around);
        if !compares && crease_cosine == FLAT {
            return own.try_normalize().unwrap_or(DVec3::Y);
        }
        // A hub's sum would be as long for each of its corners; a stride keeps the total linear.
        let stride = if compares { 1 } else { around.len() / MAX_CORNERS_COMPARED };
        let weighted = around.iter().step_by(stride).map(|&other| {
            let normal = self.normals[other as usize / 3];
            let joins = !compares || normal.dot(own) >= crease_cosine;
            if joins { normal * self.corner_angles_rad[other as usize] } else { DVec3::ZERO }
        });
        let sum: DVec3 = weighted.sum();
        sum.try_normalize().or_else(|| own.try_normalize()).unwrap_or(DVec3::Y)
    }
}

fn corner_angle_rad(at: DVec3, next: DVec3, last: DVec3) -> f64 {
    let a = next - at;
    let b = last - at;
    let lengths = (a.length_squared() * b.length_squared()).sqrt();
    if lengths > 0.0 { (a.dot(b) / lengths).clamp(-1.0, 1.0).acos() } else { 0.0 }
}

/// The corners of triangles that meet at each point, for any vertex numbers.
struct CornersByPosition {
    group_of_vertex: Vec<u32>,
    first_of_group: Vec<u32>,
    corners: Vec<u32>,
}

impl CornersByPosition {
    fn of(mesh: &SourceMesh) -> Self {
        let group_of_vertex = groups_by_position(&mesh.positions_in_mesh);
        let group_count = group_of_vertex.iter().max().map_or(0, |&g| g as usize + 1);
        let mut first_of_group = vec![0u32; group_count + 1];
        for &vertex in &mesh.indices {
            first_of_group[group_of_vertex[vertex as usize] as usize + 1] += 1;
        }
        for group in 1..first_of_group.len() {
            first_of_group[group] += first_of_group[group - 1];
        }
        let mut corners = vec![0u32; mesh.indices.len()];
        let mut next_free = first_of_group.clone();
        for (corner, &vertex) in mesh.indices.iter().enumerate() {
            let slot = &mut next_free[group_of_vertex[vertex as usize] as usize];
            corners[*slot as usize] = corner as u32;
            *slot += 1;
        }
        Self { group_of_vertex, first_of_group, corners }
    }

    /// `vertex` may be a later copy, since lookups use the original's number.
    fn around(&self, vertex: u32) -> &[u32] {
        let group = self.group_of_vertex[vertex as usize] as usize;
        &self.corners[self.first_of_group[group] as usize..self.first_of_group[group + 1] as usize]
    }
}

fn groups_by_position(positions: &[DVec3]) -> Vec<u32> {
    let mut group_of: HashMap<[u64; 3], u32> = HashMap::with_capacity(positions.len());
    let groups = positions.iter().map(|p| {
        let next = group_of.len() as u32;
        *group_of.entry((*p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(next)
    });
    groups.collect()
}

/// Sets the tangents of all corners, as MikkTSpace has them (Mikkelsen 2008), with which normal maps are baked. Corners of one
/// vertex whose tangents differ get separate vertices. The mesh has normals and details; `second_uv` says on which pair of
/// coordinates the normal map lies.
pub(crate) fn generate_tangents(mesh: &mut SourceMesh, second_uv: bool) -> Result<(), Error> {
    let positions: Vec<[f32; 3]> = mesh.positions_in_mesh.iter().map(|p| p.as_vec3().to_array()).collect();
    let normals: Vec<[f32; 3]> = mesh.vertices.iter().map(|v| v.normal).collect();
    let uvs: Vec<[f32; 2]> = match second_uv {
        false => mesh.vertices.iter().map(|v| v.uv).collect(),
        true => mesh.details.iter().map(|d| d.uv).collect(),
    };
    let positions = Positions::from_packed(&positions);
    let indices = Some(&*mesh.indices);
    let workspace = &mut Workspace::default();
    let count = mesh.indices.len();
    let tangents =
        meshoptimizer_rs::generate_tangents(indices, count, positions, &normals, &uvs, TANGENT_COMPATIBLE, workspace)?;
    let mut number_of = HashMap::new();
    let mut is_set = vec![false; mesh.vertices.len()];
    for (corner, [x, y, z, sign]) in tangents.into_iter().enumerate() {
        // MikkTSpace's bitangent points along v; that of glTF, whose v points down, against it.
        let tangent = [x, y, z, -sign];
        let vertex = mesh.indices[corner];
        let key = (vertex, tangent.map(f32::to_bits));
        let number = *number_of.entry(key).or_insert_with(|| {
            if std::mem::replace(&mut is_set[vertex as usize], true) { mesh.copy_of(vertex) } else { vertex }
        });
        mesh.details[number as usize].tangent = tangent;
        mesh.indices[corner] = number;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::source_scene::plain_vertex;
    use super::*;

    fn mesh(points: &[[f64; 3]], indices: &[u32]) -> SourceMesh {
        SourceMesh {
            positions_in_mesh: points.iter().map(|&p| p.into()).collect(),
            vertices: vec![plain_vertex(); points.len()],
            details: Vec::new(),
            indices: indices.to_vec(),
            parts: Vec::new(),
            influences: Vec::new(),
        }
    }

    #[test]
    fn a_right_angle_stays_sharp_and_a_gentle_one_is_smoothed() {
        let fold = |height: f64| {
            let points = [[0., 0., 0.], [0., 0., 1.], [1., 0., 0.], [-1., height, 0.]];
            let mut mesh = mesh(&points, &[0, 1, 2, 0, 3, 1]);
            generate(&mut mesh, CREASE_60_DEGREES);
            mesh
        };
        assert_eq!(fold(0.3).vertices.len(), 4);
        let sharp = fold(50.0);
        assert_eq!(sharp.vertices.len(), 6);
        assert_eq!(sharp.vertices[0].normal, [0.0, 1.0, 0.0]);
    }

    #[test]
    fn a_fan_around_one_hub_takes_linear_time() {
        let rim = 300_000u32;
        let on_rim = |i: u32| [f64::from(i).cos(), 0.0, f64::from(i).sin()];
        let points: Vec<_> = std::iter::once([0.0; 3]).chain((0..=rim).map(on_rim)).collect();
        let indices: Vec<_> = (1..=rim).flat_map(|i| [0, i + 1, i]).collect();
        let start = std::time::Instant::now();
        generate(&mut mesh(&points, &indices), CREASE_60_DEGREES);
        assert!(start.elapsed().as_secs() < 5);
    }

    #[test]
    fn a_flat_cone_of_many_triangles_takes_linear_time() {
        let rim = 200_000u32;
        let angle_rad = |i: u32| f64::from(i) / f64::from(rim) * std::f64::consts::TAU;
        let on_rim = |i: u32| [angle_rad(i).cos() * 1e3, -1e3, angle_rad(i).sin() * 1e3];
        let points: Vec<_> = std::iter::once([0.0; 3]).chain((0..=rim).map(on_rim)).collect();
        let indices: Vec<_> = (1..=rim).flat_map(|i| [0, i + 1, i]).collect();
        let mut cone = mesh(&points, &indices);
        let start = std::time::Instant::now();
        generate(&mut cone, FLAT);
        assert!(start.elapsed().as_secs() < 5);
        let hub_count = cone.positions_in_mesh.iter().filter(|p| **p == DVec3::ZERO).count();
        assert!(hub_count > 10_000, "the cone's tip is flat: {hub_count}");
        for triangle in cone.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|i| cone.positions_in_mesh[triangle[i] as usize]);
            let tip = DVec3::from(cone.vertices[triangle[0] as usize].normal.map(f64::from));
            assert!((b - a).cross(c - a).normalize_or_zero().distance(tip) < 1e-3);
        }
    }

    #[test]
    fn a_flat_fan_in_a_plane_shares_its_hub() {
        let rim = 1000u32;
        let angle_rad = |i: u32| f64::from(i) / f64::from(rim) * std::f64::consts::TAU;
        let on_rim = |i: u32| [angle_rad(i).cos(), 0.0, angle_rad(i).sin()];
        let points: Vec<_> = std::iter::once([0.0; 3]).chain((0..=rim).map(on_rim)).collect();
        let mut fan = mesh(&points, &(1..=rim).flat_map(|i| [0, i + 1, i]).collect::<Vec<_>>());
        generate(&mut fan, FLAT);
        assert_eq!(fan.vertices.len(), points.len());
    }

    #[test]
    fn degenerate_triangles_get_a_unit_normal() {
        let mut degenerate = mesh(&[[0.; 3], [0.; 3], [0.; 3]], &[0, 1, 2]);
        generate(&mut degenerate, FLAT);
        assert!(degenerate.vertices.iter().all(|v| v.normal == [0.0, 1.0, 0.0]));
    }
}
