//! Faces as the file lists them, and indexed triangles of them once the whole file is known: a face may stand before its
//! vertices.

use std::collections::HashMap;

use super::super::Import;
use super::super::polygons::{self, PolygonMesh, TOO_SHORT, UNKNOWN_VERTEX};
use super::super::source_scene::SourceMesh;
use super::attributes::{Attributes, Corner, NONE};
use super::map::UvTransform;
use super::text::Line;
use crate::error::{Fault, at_most};

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
            import.warnings.count(if is_readable { TOO_SHORT } else { UNKNOWN_VERTEX }, line);
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
        mut attributes: Attributes,
        materials: &[MaterialUse],
        import: &Import,
    ) -> Result<SourceMesh, Fault> {
        let colors_srgba8 = attributes.colors_srgba8();
        let mut mesh = PolygonMesh::new(&attributes.positions_in_source, materials.len(), import);
        let mut start = 0;
        for face in &self.faces {
            let corners = &self.corners[start..face.end];
            start = face.end;
            let place = format_args!("line {} (f)", face.line);
            let Some(polygon) = mesh.polygon(corners.iter().map(|corner| corner[0]), place) else { continue };
            let material = materials[face.material as usize];
            let mut in_mesh = Vec::with_capacity(corners.len());
            let mut has_all = true;
            let mut have_uvs = true;
            for corner in corners {
                let existing @ [position, uv, normal] = attributes.existing(*corner);
                has_all &= existing == *corner;
                have_uvs &= uv != NONE;
                in_mesh.push(mesh.vertex(position, [uv, normal, material.placement_number], || {
                    let mut vertex = attributes.vertex(existing);
                    vertex.color_srgba8 = colors_srgba8.get(position as usize).copied().unwrap_or(vertex.color_srgba8);
                    if material.placement != UvTransform::IDENTITY {
                        vertex.uv = material.placement.apply(vertex.uv);
                    }
                    vertex
                }));
            }
            if !has_all {
                import.warnings.count(WITHOUT_ATTRIBUTES, place);
            }
            if material.has_texture && !have_uvs {
                import.warnings.count(TEXTURE_WITHOUT_COORDINATES, place);
            }
            let is_flat = face.is_flat;
            mesh.push(&polygons::Face { place, polygon, material: face.material as usize, is_flat }, &in_mesh)?;
        }
        mesh.finish(materials.iter().map(|material| material.number))
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
