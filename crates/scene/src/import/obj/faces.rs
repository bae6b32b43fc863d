//! The numbered elements of a file, which are positions with colours, texture coordinates and normals; faces as the file lists
//! them, and indexed triangles of them once the whole file is known: a face may stand before its
//! vertices.

use std::collections::HashMap;

use glam::DVec3;

use super::super::polygons::{self, PolygonMesh, TOO_SHORT, UNKNOWN_VERTEX};
use super::super::vertex_colors::{ColorRange, Colors};
use super::super::{Import, SourceMesh, Warnings, plain_vertex};
use super::map::UvTransform;
use super::text::Line;
use crate::{Fault, Limits, Vertex, at_most};

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

/// The number of an element that a corner does not have.
const NONE: u32 = u32::MAX;

/// Positions, coordinates and normals are numbered separately; a vertex is a triple of these numbers.
type Corner = [u32; 3];

#[derive(Default)]
pub(super) struct Attributes {
    /// Not finite where the file has no numbers.
    positions_in_source: Vec<DVec3>,
    /// One for each position once any position has one.
    colors: Vec<[f32; 4]>,
    /// The colours of ZBrush, in the order of positions.
    mrgb_srgb8: Vec<[u8; 3]>,
    uvs: Vec<[f32; 2]>,
    /// Zero where they must be computed.
    normals: Vec<[f32; 3]>,
}

impl Attributes {
    /// `v x y z`, optionally followed by a weight or a colour, as several programs write it.
    pub(super) fn push_position(&mut self, line: &Line, import: &Import) -> Result<(), Fault> {
        at_most(line, self.positions_in_source.len() as u64 + 1, import.limits.vertices)?;
        let [x, y, z, a, g, b] = line.numbers();
        let position = DVec3::from([x, y, z].map(|c| c.unwrap_or(f64::NAN)));
        if !position.is_finite() {
            import.warnings.count("vertices without three finite coordinates", line);
        }
        if let [Some(r), Some(g), Some(b)] = [a, g, b] {
            self.colors.resize(self.positions_in_source.len(), [f32::NAN; 4]);
            self.colors.push([r, g, b, f64::NAN].map(|c| c as f32));
        }
        let weight = a.filter(|weight| g.is_none() && weight.is_finite() && *weight != 0.0);
        self.positions_in_source.push(weight.map_or(position, |weight| position / weight));
        Ok(())
    }

    pub(super) fn push_uv(&mut self, line: &Line, warnings: &Warnings) {
        let [u, v] = line.numbers();
        // OBJ's v runs upwards.
        let uv = [u, v].map(|c| c.unwrap_or(0.0) as f32);
        if u.is_none() || !uv.iter().all(|c| c.is_finite()) {
            warnings.count("texture coordinates that are not finite count as 0", line);
        }
        let [u, v] = uv.map(|c| if c.is_finite() { c } else { 0.0 });
        self.uvs.push([u, 1.0 - v]);
    }

    pub(super) fn push_normal(&mut self, line: &Line, warnings: &Warnings) {
        let normal = line.numbers::<3>().map(|c| c.unwrap_or(f64::NAN));
        let direction = DVec3::from(normal).try_normalize();
        if direction.is_none() && normal != [0.0; 3] {
            warnings.count("normals that are not finite are computed", line);
        }
        self.normals.push(direction.unwrap_or(DVec3::ZERO).as_vec3().to_array());
    }

    /// `#MRGB` and up to 64 colours of eight digits: a mask, red, green, blue.
    pub(super) fn push_mrgb(&mut self, line: &Line, limits: &Limits) {
        for digits in line.rest.chunks_exact(8) {
            let number = std::str::from_utf8(digits).ok().and_then(|digits| u32::from_str_radix(digits, 16).ok());
            let Some(number) = number.filter(|_| (self.mrgb_srgb8.len() as u64) < limits.vertices) else { return };
            let [_, r, g, b] = number.to_be_bytes();
            self.mrgb_srgb8.push([r, g, b]);
        }
    }

    /// A corner without the parts that are not there.
    fn existing(&self, [position, uv, normal]: Corner) -> Corner {
        let uv = if (uv as usize) < self.uvs.len() { uv } else { NONE };
        let normal = if (normal as usize) < self.normals.len() { normal } else { NONE };
        [position, uv, normal]
    }

    /// How many elements of each kind there are so far: negative numbers count back from here.
    fn counts(&self) -> [usize; 3] {
        [self.positions_in_source.len(), self.uvs.len(), self.normals.len()]
    }

    /// Colours of all positions, in bytes; shorter where some have none.
    fn colors_srgba8(&mut self) -> Vec<[u8; 4]> {
        if self.colors.is_empty() {
            return self.mrgb_srgb8.iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect();
        }
        Colors { range: ColorRange::Floats, values: std::mem::take(&mut self.colors) }.srgba8()
    }

    /// A vertex without its colour. An element that is not there has its default.
    fn vertex(&self, [_, uv, normal]: Corner) -> Vertex {
        let plain = plain_vertex();
        Vertex {
            uv: self.uvs.get(uv as usize).copied().unwrap_or(plain.uv),
            normal: self.normals.get(normal as usize).copied().unwrap_or(plain.normal),
            ..plain
        }
    }
}
