//! The faces of a PLY file, and their triangles by texture.

use std::collections::HashMap;

use super::super::Import;
use super::super::polygons::{NOT_FINITE, PolygonCutter, TOO_COSTLY, TOO_SHORT};
use super::super::source_scene::SourceMesh;
use super::super::vertex_colors::{bytes, scale_to_bytes};
use super::super::warnings::Warnings;
use super::header::ColorRange;
use super::rows::FaceRow;
use super::vertices::{Vertices, v_downwards};
use crate::Vertex;
use crate::error::{Fault, at_most};

const UNKNOWN_VERTEX: &str = "faces with a vertex that is not there are left out";

/// The number of a vertex that no file has.
const NO_VERTEX: u32 = u32::MAX;

/// All faces of a file.
#[derive(Default)]
pub(super) struct Surface {
    faces: Vec<Face>,
    corners: Vec<u32>,
    /// One for each corner once any face has them.
    pub uvs: Vec<[f32; 2]>,
    /// One for each face once any has one, as the file has them.
    colors: Vec<[f32; 4]>,
    pub color_range: ColorRange,
    pub triangle_count: u64,
}

struct Face {
    /// The number of its row.
    row: u64,
    texture: i32,
    /// The end of its corners, which begin where those of the face before end.
    end: usize,
}

impl Surface {
    pub(super) fn push(&mut self, row: &FaceRow, number: u64, warnings: &Warnings) {
        let count = row.vertex_indices.len();
        if count < 3 {
            return warnings.count(TOO_SHORT, format_args!("face {number}"));
        }
        if row.texcoord.len() == 2 * count {
            self.uvs.resize(self.corners.len(), [0.0; 2]);
            self.uvs.extend(row.texcoord.chunks_exact(2).map(|uv| [uv[0], uv[1]]));
        } else if !row.texcoord.is_empty() {
            warnings
                .count("texture coordinates of another number than corners are dropped", format_args!("face {number}"));
        }
        self.corners.extend(row.vertex_indices.iter().map(|&vertex| u32::try_from(vertex).unwrap_or(NO_VERTEX)));
        if self.color_range != ColorRange::None {
            self.colors.resize(self.faces.len(), [f32::NAN; 4]);
            self.colors.push(row.color());
        }
        self.faces.push(Face { row: number, texture: row.texnumber, end: self.corners.len() });
        self.triangle_count += count as u64 - 2;
    }

    /// Adds the triangles of strips; −1 ends a strip. Every second triangle is turned round.
    pub(super) fn push_strips(&mut self, vertices: &[i64]) {
        let mut row = self.faces.len() as u64;
        for strip in vertices.split(|vertex| *vertex < 0) {
            for (number, triangle) in strip.windows(3).enumerate() {
                let [a, b, c] = [0, 1, 2].map(|i| u32::try_from(triangle[i]).unwrap_or(NO_VERTEX));
                // A vertex that is there twice leads from one strip to the next.
                if a != b && b != c && c != a {
                    self.corners.extend(if number % 2 == 0 { [a, b, c] } else { [b, a, c] });
                    self.faces.push(Face { row, texture: 0, end: self.corners.len() });
                    self.triangle_count += 1;
                    row += 1;
                }
            }
        }
    }

    /// The triangles of texture 0, then of texture 1 and so on, whose materials have the same numbers; those without a texture
    /// come last.
    pub(super) fn into_mesh(self, vertices: &Vertices, textures: u32, import: &Import) -> Result<SourceMesh, Fault> {
        let has_texture = textures > 0;
        let has_colors = vertices.colors != ColorRange::None || !self.colors.is_empty();
        if has_texture && has_colors {
            import.warnings.list("colours beside a texture are not shown", "vertex or face");
        }
        let takes_face_colors = vertices.colors == ColorRange::None && !has_texture;
        let mut builder = Builder {
            surface: &self,
            vertices,
            colored: vertices.colored(),
            face_colors_srgba8: if takes_face_colors { self.colors_srgba8() } else { Vec::new() },
            has_texture,
            mesh: SourceMesh::default(),
            indices_of_material: vec![Vec::new(); textures as usize + 1],
            number_of: HashMap::new(),
            number_of_plain: vec![NO_VERTEX; vertices.positions_in_source.len()],
            cutter: PolygonCutter::new(),
        };
        let mut start = 0;
        for (number, face) in self.faces.iter().enumerate() {
            builder.add(number, face, start..face.end, &import.warnings);
            start = face.end;
            at_most("vertices of faces", builder.mesh.vertices.len() as u64, import.limits.vertices)?;
        }
        let mut mesh = builder.mesh;
        for (material, indices) in builder.indices_of_material.into_iter().enumerate() {
            if !indices.is_empty() {
                mesh.push_part(indices, material as u32);
            }
        }
        if mesh.indices.is_empty() {
            let fault = import.warnings.no_triangles([UNKNOWN_VERTEX, NOT_FINITE, TOO_SHORT]);
            return Err(fault.unwrap_or_else(|| Fault::malformed("file", "there are no triangles: all are empty")));
        }
        Ok(mesh)
    }

    fn colors_srgba8(&self) -> Vec<[u8; 4]> {
        let scale = match self.color_range {
            ColorRange::Floats => scale_to_bytes(self.colors.iter().flatten().copied()),
            ColorRange::Words => 255.0 / 65_535.0,
            ColorRange::Bytes | ColorRange::None => 1.0,
        };
        self.colors.iter().map(|color| bytes(*color, scale)).collect()
    }
}

/// Makes vertices of corners and triangles of faces.
struct Builder<'a> {
    surface: &'a Surface,
    vertices: &'a Vertices,
    colored: Vec<Vertex>,
    face_colors_srgba8: Vec<[u8; 4]>,
    has_texture: bool,
    mesh: SourceMesh,
    indices_of_material: Vec<Vec<u32>>,
    /// Numbers in the mesh by the file's number, the bits of own texture coordinates, and the face's colour.
    number_of: HashMap<(u32, [u32; 2], [u8; 4]), u32>,
    /// Numbers in the mesh of vertices whose corners have nothing of their own, by the file's number.
    number_of_plain: Vec<u32>,
    cutter: PolygonCutter,
}

impl Builder<'_> {
    fn add(&mut self, number: usize, face: &Face, corners: std::ops::Range<usize>, warnings: &Warnings) {
        let place = format_args!("face {}", face.row);
        let positions = self.surface.corners[corners.clone()].iter();
        let polygon: Option<Vec<_>> =
            positions.map(|&vertex| self.vertices.positions_in_source.get(vertex as usize).copied()).collect();
        let Some(polygon) = polygon else { return warnings.count(UNKNOWN_VERTEX, place) };
        if !polygon.iter().all(|p| p.is_finite()) {
            return warnings.count(NOT_FINITE, place);
        }
        let color = self.face_colors_srgba8.get(number).copied();
        let in_mesh: Vec<u32> = corners.map(|corner| self.vertex(corner, color)).collect();
        let last = self.indices_of_material.len() - 1;
        let texture = usize::try_from(face.texture).ok().filter(|texture| *texture < last);
        if self.has_texture && texture.is_none() {
            warnings.count("faces of a texture that is not there are white", place);
        }
        let triangles = self.cutter.triangles(&polygon, || warnings.count(TOO_COSTLY, place));
        let triangles = triangles.iter().map(|&corner| in_mesh[corner as usize]);
        self.indices_of_material[texture.unwrap_or(last)].extend(triangles);
    }

    fn vertex(&mut self, corner: usize, face_color: Option<[u8; 4]>) -> u32 {
        let vertex = self.surface.corners[corner];
        let own_uv = self.surface.uvs.get(corner).copied().map(v_downwards);
        let next = self.mesh.vertices.len() as u32;
        let number = if own_uv.is_none() && face_color.is_none() {
            &mut self.number_of_plain[vertex as usize]
        } else {
            let key = (vertex, own_uv.unwrap_or_default().map(f32::to_bits), face_color.unwrap_or_default());
            self.number_of.entry(key).or_insert(NO_VERTEX)
        };
        if *number == NO_VERTEX {
            *number = next;
            let mut new = self.colored[vertex as usize];
            new.uv = own_uv.unwrap_or(new.uv);
            new.color_srgba8 = face_color.unwrap_or(if self.has_texture { [255; 4] } else { new.color_srgba8 });
            self.mesh.positions_in_mesh.push(self.vertices.positions_in_source[vertex as usize]);
            self.mesh.vertices.push(new);
            return next;
        }
        *number
    }
}
