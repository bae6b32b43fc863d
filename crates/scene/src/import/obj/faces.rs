//! Faces as the file lists them, and indexed triangles of them once the whole file is known: a face may stand before its
//! vertices.

use std::collections::HashMap;

use glam::DVec3;

use super::super::Import;
use super::super::normals;
use super::super::polygons::{NOT_FINITE, PolygonCutter, TOO_COSTLY, TOO_SHORT};
use super::super::source_scene::SourceMesh;
use super::super::warnings::Warnings;
use super::attributes::{Attributes, Corner, NONE};
use super::map::UvTransform;
use super::text::Line;
use crate::error::{Fault, at_most};

const UNREADABLE: &str = "faces with a corner that is no vertex of the file are left out";
const TEXTURE_WITHOUT_COORDINATES: &str = "textures without coordinates show one texel";
const WITHOUT_ATTRIBUTES: &str = "texture coordinates and normals that the file does not have are dropped";

/// All faces of a file.
#[derive(Default)]
pub(super) struct Faces {
    /// The names of materials, in the order of their first use.
    pub material_names: Vec<Vec<u8>>,
    number_of_material: HashMap<Vec<u8>, u32>,
    current_material: Option<u32>,
    is_flat: bool,
    faces: Vec<Face>,
    corners: Vec<Corner>,
    triangle_count: u64,
}

struct Face {
    line: u32,
    material: u32,
    is_flat: bool,
    /// The end of its corners in `corners`, which begin where those of the face before end.
    end: usize,
}

/// The use of a material by faces.
#[derive(Clone, Copy)]
pub(super) struct MaterialUse {
    /// Number in the scene.
    pub number: u32,
    pub placement: UvTransform,
    /// Equal for equal placements: the corners of their faces share vertices.
    pub placement_number: u32,
    pub has_texture: bool,
}

impl Faces {
    pub(super) fn use_material(&mut self, name: &[u8]) {
        let next = self.material_names.len() as u32;
        let number = *self.number_of_material.entry(name.to_owned()).or_insert(next);
        if number == next {
            self.material_names.push(name.to_owned());
        }
        self.current_material = Some(number);
    }

    /// `s off` and `s 0` end smoothing.
    pub(super) fn set_smoothing(&mut self, line: &Line) {
        self.is_flat = line.words().next().is_none_or(|word| word.eq_ignore_ascii_case(b"off") || word == b"0");
    }

    pub(super) fn push(&mut self, line: &Line, attributes: &Attributes, import: &Import) -> Result<(), Fault> {
        let start = self.corners.len();
        let counts = attributes.counts();
        let mut is_readable = true;
        for word in line.words() {
            let corner = corner(word, counts);
            is_readable &= corner.is_some();
            self.corners.extend(corner);
        }
        let count = self.corners.len() - start;
        if !is_readable || count < 3 {
            self.corners.truncate(start);
            import.warnings.count(if is_readable { TOO_SHORT } else { UNREADABLE }, line);
            return Ok(());
        }
        if self.current_material.is_none() {
            self.use_material(b"");
        }
        self.triangle_count += count as u64 - 2;
        at_most(line, self.triangle_count, import.limits.triangles)?;
        let material = self.current_material.unwrap_or(0);
        let line = u32::try_from(line.number).unwrap_or(u32::MAX);
        self.faces.push(Face { line, material, is_flat: self.is_flat, end: self.corners.len() });
        Ok(())
    }

    pub(super) fn into_mesh(
        self,
        attributes: &Attributes,
        materials: &[MaterialUse],
        import: &Import,
    ) -> Result<SourceMesh, Fault> {
        let mut builder = Builder {
            attributes,
            colors_srgba8: attributes.colors_srgba8(),
            mesh: SourceMesh::default(),
            triangles: vec![Triangles::default(); self.material_names.len()],
            vertex_of_corner: HashMap::new(),
            cutter: PolygonCutter::new(),
            polygon_in_source: Vec::new(),
            vertices: Vec::new(),
        };
        let mut start = 0;
        for face in &self.faces {
            let corners = &self.corners[start..face.end];
            start = face.end;
            builder.add(face, corners, materials[face.material as usize], &import.warnings);
            let vertices = builder.mesh.vertices.len() as u64;
            at_most(format_args!("line {} (f)", face.line), vertices, import.limits.vertices)?;
        }
        let mut mesh = builder.mesh;
        let mut is_flat = Vec::new();
        for (triangles, material) in builder.triangles.into_iter().zip(materials) {
            if !triangles.indices.is_empty() {
                mesh.push_part(triangles.indices, material.number);
                is_flat.extend(triangles.is_flat);
            }
        }
        if mesh.indices.len() > u32::MAX as usize {
            return Err(Fault::unsupported("faces", "more than 2^32 corners"));
        }
        if mesh.indices.is_empty() {
            let fault = import.warnings.no_triangles([UNREADABLE, NOT_FINITE, TOO_SHORT]);
            return Err(fault.unwrap_or_else(|| Fault::malformed("scene", "it has no triangles")));
        }
        normals::fill(&mut mesh, |triangle| is_flat[triangle]);
        Ok(mesh)
    }
}

/// Makes vertices of corners and triangles of faces.
struct Builder<'a> {
    attributes: &'a Attributes,
    colors_srgba8: Vec<[u8; 4]>,
    mesh: SourceMesh,
    /// The triangles of each material.
    triangles: Vec<Triangles>,
    /// The key is a corner and the number of its placement.
    vertex_of_corner: HashMap<(Corner, u32), u32>,
    cutter: PolygonCutter,
    polygon_in_source: Vec<DVec3>,
    vertices: Vec<u32>,
}

#[derive(Default, Clone)]
struct Triangles {
    indices: Vec<u32>,
    /// Whether each triangle was listed after `s off`.
    is_flat: Vec<bool>,
}

impl Builder<'_> {
    fn add(&mut self, face: &Face, corners: &[Corner], material: MaterialUse, warnings: &Warnings) {
        let place = format_args!("line {} (f)", face.line);
        self.polygon_in_source.clear();
        for corner in corners {
            let position = self.attributes.positions_in_source.get(corner[0] as usize);
            self.polygon_in_source.extend(position);
        }
        if self.polygon_in_source.len() < corners.len() {
            return warnings.count(UNREADABLE, place);
        }
        if !self.polygon_in_source.iter().all(|p| p.is_finite()) {
            return warnings.count(NOT_FINITE, place);
        }
        self.vertices.clear();
        let mut has_all = true;
        let mut have_uvs = true;
        for corner in corners {
            let existing = self.attributes.existing(*corner).unwrap_or(*corner);
            has_all &= existing == *corner;
            have_uvs &= existing[1] != NONE;
            let vertex = self.vertex(existing, material);
            self.vertices.push(vertex);
        }
        if !has_all {
            warnings.count(WITHOUT_ATTRIBUTES, place);
        }
        if material.has_texture && !have_uvs {
            warnings.count(TEXTURE_WITHOUT_COORDINATES, place);
        }
        let triangles = self.cutter.triangles(&self.polygon_in_source, || warnings.count(TOO_COSTLY, place));
        let into = &mut self.triangles[face.material as usize];
        into.indices.extend(triangles.iter().map(|&corner| self.vertices[corner as usize]));
        into.is_flat.resize(into.indices.len() / 3, face.is_flat);
    }

    fn vertex(&mut self, corner: Corner, material: MaterialUse) -> u32 {
        let next = self.mesh.vertices.len() as u32;
        let number = *self.vertex_of_corner.entry((corner, material.placement_number)).or_insert(next);
        if number == next {
            let mut vertex = self.attributes.vertex(corner);
            vertex.color_srgba8 = self.colors_srgba8.get(corner[0] as usize).copied().unwrap_or(vertex.color_srgba8);
            if material.placement != UvTransform::IDENTITY {
                vertex.uv = material.placement.apply(vertex.uv);
            }
            self.mesh.positions_in_mesh.push(self.attributes.positions_in_source[corner[0] as usize]);
            self.mesh.vertices.push(vertex);
        }
        number
    }
}

/// `v`, `v/vt`, `v//vn` or `v/vt/vn`. `None` for anything else; numbers may be too large.
fn corner(word: &[u8], counts: [usize; 3]) -> Option<Corner> {
    let mut corner = [NONE; 3];
    let mut fields = word.split(|byte| *byte == b'/');
    for (number, count) in corner.iter_mut().zip(counts) {
        if let Some(field) = fields.next().filter(|field| !field.is_empty()) {
            *number = resolved(field, count)?;
        }
    }
    (corner[0] != NONE && fields.next().is_none()).then_some(corner)
}

/// Resolves a number that counts from 1, or backwards from the last element so far. A number of nothing becomes one that is
/// too large.
fn resolved(field: &[u8], count: usize) -> Option<u32> {
    let number: i64 = std::str::from_utf8(field).ok()?.parse().ok()?;
    let from_zero = if number < 0 { number.checked_add(count as i64) } else { number.checked_sub(1) };
    Some(from_zero.and_then(|n| u32::try_from(n).ok()).unwrap_or(NONE).min(NONE - 1))
}
