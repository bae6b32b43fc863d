//! The numbered elements of a file, and indexed triangles from polygons of them.

use std::collections::HashMap;

use glam::DVec3;

use super::super::normals;
use super::super::source_scene::{SourceMesh, plain_vertex};
use super::text::{Line, floats};
use crate::error::{Fault, at_most};
use crate::{Limits, MeshPart, Vertex};

const NONE: u32 = u32::MAX;

/// Positions, coordinates and normals are numbered separately; a vertex is a triple of these numbers.
type Corner = [u32; 3];

#[derive(Default)]
pub(super) struct Faces {
    pub material_names: Vec<String>,
    number_of_material: HashMap<String, usize>,
    current_material: Option<usize>,
    indices_of_material: Vec<Vec<u32>>,
    vertex_of_corner: HashMap<Corner, u32>,
    mesh: SourceMesh,
    triangle_count: u64,
    has_normals: bool,
}

impl Faces {
    pub(super) fn use_material(&mut self, name: &str) {
        let next = self.material_names.len();
        let number = *self.number_of_material.entry(name.to_owned()).or_insert(next);
        if number == next {
            self.material_names.push(name.to_owned());
            self.indices_of_material.push(Vec::new());
        }
        self.current_material = Some(number);
    }

    pub(super) fn push(&mut self, line: &Line, attributes: &Attributes, limits: &Limits) -> Result<(), Fault> {
        if self.current_material.is_none() {
            self.use_material("");
        }
        let material = self.current_material.unwrap_or(0);
        let mut words = line.rest.split_ascii_whitespace();
        let mut next = |faces: &mut Self| words.next().map(|word| faces.vertex(word, line, attributes)).transpose();
        let too_few = || Fault::malformed(line, "a face of fewer than three corners");
        let (Some(hub), Some(mut last)) = (next(self)?, next(self)?) else { return Err(too_few()) };
        let before = self.triangle_count;
        while let Some(corner) = next(self)? {
            self.indices_of_material[material].extend([hub, last, corner]);
            self.triangle_count += 1;
            last = corner;
        }
        at_most(line, self.triangle_count, limits.triangles)?;
        at_most(line, self.mesh.vertices.len() as u64, limits.vertices)?;
        if self.triangle_count > before { Ok(()) } else { Err(too_few()) }
    }

    pub(super) fn into_mesh(mut self, material_numbers: &[u32]) -> Result<SourceMesh, Fault> {
        (self.mesh.indices, self.mesh.parts) = parts_of(self.indices_of_material, material_numbers);
        if self.mesh.indices.len() > u32::MAX as usize {
            return Err(Fault::unsupported("faces", "more than 2^32 corners"));
        }
        normals::complete(&mut self.mesh, self.has_normals, normals::CREASE_60_DEGREES);
        Ok(self.mesh)
    }

    fn vertex(&mut self, word: &str, line: &Line, attributes: &Attributes) -> Result<u32, Fault> {
        let corner = corner(word, attributes).map_err(|why| Fault::malformed(line, format!("{word:?} {why}")))?;
        if let Some(&vertex) = self.vertex_of_corner.get(&corner) {
            return Ok(vertex);
        }
        let vertex = self.mesh.vertices.len() as u32;
        self.vertex_of_corner.insert(corner, vertex);
        self.has_normals |= corner[2] != NONE;
        self.mesh.positions_in_mesh.push(attributes.positions_in_source[corner[0] as usize]);
        self.mesh.vertices.push(attributes.vertex(corner));
        Ok(vertex)
    }
}

/// The numbered elements that faces refer to.
#[derive(Default)]
pub(super) struct Attributes {
    pub(super) positions_in_source: Vec<DVec3>,
    /// Colours, one for each position once any position has one.
    pub(super) colors_srgba8: Vec<[u8; 4]>,
    pub(super) uvs: Vec<[f32; 2]>,
    pub(super) normals: Vec<[f32; 3]>,
}

impl Attributes {
    /// `v x y z`, optionally followed by a weight or a colour, as several programs write it.
    pub(super) fn push_position(&mut self, line: &Line) -> Result<(), Fault> {
        let [x, y, z, a, g, b] = floats::<6>(line, 3)?;
        let position = DVec3::new(x, y, z);
        let count = line.rest.split_ascii_whitespace().count();
        if count >= 6 {
            self.colors_srgba8.resize(self.positions_in_source.len(), [255; 4]);
            let [r, g, b] = [a, g, b].map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
            self.colors_srgba8.push([r, g, b, 255]);
        }
        let is_weighted = count == 4 && a != 0.0;
        self.positions_in_source.push(if is_weighted { position / a } else { position });
        Ok(())
    }

    fn vertex(&self, [position, uv, normal]: Corner) -> Vertex {
        let plain = plain_vertex();
        Vertex {
            color_srgba8: self.colors_srgba8.get(position as usize).copied().unwrap_or(plain.color_srgba8),
            uv: self.uvs.get(uv as usize).copied().unwrap_or(plain.uv),
            normal: self.normals.get(normal as usize).copied().unwrap_or(plain.normal),
            ..plain
        }
    }
}

/// `v`, `v/vt`, `v//vn` or `v/vt/vn`.
fn corner(word: &str, attributes: &Attributes) -> Result<Corner, &'static str> {
    let counts = [attributes.positions_in_source.len(), attributes.uvs.len(), attributes.normals.len()];
    let mut corner = [NONE; 3];
    let mut fields = word.split('/');
    for (number, count) in corner.iter_mut().zip(counts) {
        if let Some(field) = fields.next().filter(|f| !f.is_empty()) {
            *number = resolved(field, count)?;
        }
    }
    let is_complete = corner[0] != NONE && fields.next().is_none();
    if is_complete { Ok(corner) } else { Err("is not a corner") }
}

/// Resolves a number that counts from 1, or backwards from the last element so far.
fn resolved(field: &str, count: usize) -> Result<u32, &'static str> {
    let number: i64 = field.parse().map_err(|_| "is not a corner")?;
    let from_zero = if number < 0 { number.checked_add(count as i64) } else { number.checked_sub(1) };
    let in_range = from_zero.filter(|n| (0..count.min(NONE as usize) as i64).contains(n));
    in_range.map(|n| n as u32).ok_or("refers to something that is not there")
}

/// Sorts triangles by material, one part each.
fn parts_of(indices_of_material: Vec<Vec<u32>>, numbers: &[u32]) -> (Vec<u32>, Vec<MeshPart>) {
    let (mut indices, mut parts) = (Vec::new(), Vec::new());
    for (own, &material) in indices_of_material.into_iter().zip(numbers) {
        if !own.is_empty() {
            let (first_index, index_count) = (indices.len() as u32, own.len() as u32);
            parts.push(MeshPart { first_index, index_count, material });
            indices.extend(own);
        }
    }
    (indices, parts)
}
