//! The vertices of a PLY file, its faces, and their triangles by texture.

use glam::DVec3;
use serde::Deserialize;

use super::super::polygons::{self, PolygonMesh, TOO_SHORT, triangles_of_strip};
use super::super::vertex_colors::{ColorRange, Colors};
use super::super::{Import, SourceMesh, Warnings, plain_vertex};
use crate::{Fault, Vertex};

/// The number of a vertex that no file has.
const NO_VERTEX: u32 = u32::MAX;

/// A polygon, or strips of triangles between −1.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct FaceRow {
    pub vertex_indices: Vec<i64>,
    red: Option<f32>,
    green: Option<f32>,
    blue: Option<f32>,
    alpha: Option<f32>,
    /// u and v of each corner.
    pub texcoord: Vec<f32>,
    pub texnumber: i32,
}

/// All faces of a file.
#[derive(Default)]
pub(super) struct Surface {
    faces: Vec<Face>,
    corners: Vec<u32>,
    /// One for each corner once any face has them.
    pub uvs: Vec<[f32; 2]>,
    /// One for each face once any has one.
    pub colors: Colors,
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
        if self.colors.range != ColorRange::None {
            let channels = [row.red, row.green, row.blue, row.alpha];
            self.colors.values.resize(self.faces.len(), [f32::NAN; 4]);
            self.colors.values.push(channels.map(|channel| channel.unwrap_or(f32::NAN)));
        }
        self.faces.push(Face { row: number, texture: row.texnumber, end: self.corners.len() });
        self.triangle_count += count as u64 - 2;
    }

    /// Adds the triangles of strips; −1 ends a strip.
    pub(super) fn push_strips(&mut self, vertices: &[i64]) {
        let mut row = self.faces.len() as u64;
        for strip in vertices.split(|vertex| *vertex < 0) {
            let strip: Vec<u32> = strip.iter().map(|&vertex| u32::try_from(vertex).unwrap_or(NO_VERTEX)).collect();
            for triangle in triangles_of_strip(&strip) {
                self.corners.extend(triangle);
                self.faces.push(Face { row, texture: 0, end: self.corners.len() });
                self.triangle_count += 1;
                row += 1;
            }
        }
    }

    /// The triangles of texture 0, then of texture 1 and so on, whose materials have the same numbers; those without a texture
    /// come last.
    pub(super) fn into_mesh(self, vertices: &Vertices, textures: u32, import: &Import) -> Result<SourceMesh, Fault> {
        let has_texture = textures > 0;
        let vertices_have_colors = vertices.colors.range != ColorRange::None;
        if has_texture && (vertices_have_colors || !self.colors.values.is_empty()) {
            import.warnings.list("colours beside a texture are not shown", "vertex or face");
        }
        let shown = if vertices_have_colors { &vertices.colors } else { &self.colors };
        let colors_srgba8 = if has_texture { Vec::new() } else { shown.srgba8() };
        let mut mesh = PolygonMesh::new(&vertices.positions_in_source, textures as usize + 1, import);
        let mut start = 0;
        for (number, face) in self.faces.iter().enumerate() {
            let corners = start..face.end;
            start = face.end;
            let place = format_args!("face {}", face.row);
            let positions = &self.corners[corners.clone()];
            let Some(polygon) = mesh.polygon(positions.iter().copied(), place) else { continue };
            let face_color = colors_srgba8.get(number).filter(|_| !vertices_have_colors).copied();
            let mut in_mesh = Vec::with_capacity(positions.len());
            for (corner, &position) in corners.zip(positions) {
                let own_uv = self.uvs.get(corner).copied().map(v_downwards);
                let has_own = own_uv.is_some() || face_color.is_some();
                let own = (own_uv.unwrap_or_default().map(f32::to_bits), face_color.unwrap_or_default());
                in_mesh.push(mesh.vertex(position, has_own.then_some(own), || {
                    let vertex = vertices.vertices[position as usize];
                    let vertex_color = colors_srgba8.get(position as usize).filter(|_| vertices_have_colors).copied();
                    let color_srgba8 = face_color.or(vertex_color).unwrap_or(vertex.color_srgba8);
                    Vertex { uv: own_uv.unwrap_or(vertex.uv), color_srgba8, ..vertex }
                }));
            }
            let texture = u32::try_from(face.texture).ok().filter(|texture| *texture < textures);
            if has_texture && texture.is_none() {
                import.warnings.count("faces of a texture that is not there are white", place);
            }
            let material = texture.unwrap_or(textures) as usize;
            mesh.push(&polygons::Face { place, polygon, material, is_flat: false }, &in_mesh)?;
        }
        mesh.finish(0..=textures)
    }
}

/// A vertex of numbers of any type. Position and colour come first, and no field has an alias, so that `serde-ply`
/// reads common rows by offset instead of by name. The header has shown that there is a position.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct VertexRow {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    red: Option<f32>,
    green: Option<f32>,
    blue: Option<f32>,
    alpha: Option<f32>,
    pub nx: f32,
    pub ny: f32,
    pub nz: f32,
    pub s: Option<f32>,
    pub t: Option<f32>,
}

#[derive(Default)]
pub(super) struct Vertices {
    /// Not finite where the file has no numbers.
    pub positions_in_source: Vec<DVec3>,
    pub has_uvs: bool,
    /// Without their colours.
    vertices: Vec<Vertex>,
    pub colors: Colors,
}

impl Vertices {
    pub(super) fn push(&mut self, row: &VertexRow, warnings: &Warnings) {
        let number = self.vertices.len();
        let place = format_args!("vertex {number}");
        let position = DVec3::new(row.x, row.y, row.z);
        if !position.is_finite() {
            warnings.count("vertices that are not finite", place);
        }
        // A normal of length 0 is computed from the faces.
        let given_normal = DVec3::new(row.nx.into(), row.ny.into(), row.nz.into());
        let normal = given_normal.try_normalize();
        if normal.is_none() && given_normal != DVec3::ZERO {
            warnings.count("normals that are not finite are computed", place);
        }
        let uv = [row.s.unwrap_or(0.0), row.t.unwrap_or(0.0)];
        if !uv.iter().all(|c| c.is_finite()) {
            warnings.count("texture coordinates that are not finite count as 0", place);
        }
        if self.colors.range != ColorRange::None {
            let channels = [row.red, row.green, row.blue, row.alpha];
            self.colors.values.push(channels.map(|channel| channel.unwrap_or(f32::NAN)));
        }
        self.positions_in_source.push(position);
        let normal = normal.unwrap_or(DVec3::ZERO).as_vec3().to_array();
        self.vertices.push(Vertex { normal, uv: v_downwards(uv), ..plain_vertex() });
    }
}

/// PLY's v runs upwards. Coordinates that are not finite are 0.
fn v_downwards(uv: [f32; 2]) -> [f32; 2] {
    let [u, v] = uv.map(|c| if c.is_finite() { c } else { 0.0 });
    [u, 1.0 - v]
}
