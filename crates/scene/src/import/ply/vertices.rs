//! The vertices of a PLY file, of which the surface takes those that its faces use.

use glam::DVec3;

use super::super::source_scene::plain_vertex;
use super::super::vertex_colors::{bytes, scale_to_bytes};
use super::super::warnings::Warnings;
use super::header::ColorRange;
use super::rows::VertexRow;
use crate::Vertex;

#[derive(Default)]
pub(super) struct Vertices {
    /// Not finite where the file has no numbers.
    pub positions_in_source: Vec<DVec3>,
    pub colors: ColorRange,
    pub has_uvs: bool,
    vertices: Vec<Vertex>,
    /// The colours of a file that has numbers of an unknown range.
    float_colors: Vec<[f32; 4]>,
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
        let plain = plain_vertex();
        let color_srgba8 = match self.colors {
            ColorRange::None => plain.color_srgba8,
            ColorRange::Bytes => bytes(row.color(), 1.0),
            ColorRange::Words => bytes(row.color(), 255.0 / 65_535.0),
            ColorRange::Floats => {
                self.float_colors.push(row.color());
                plain.color_srgba8
            }
        };
        self.positions_in_source.push(position);
        let normal = normal.unwrap_or(DVec3::ZERO).as_vec3().to_array();
        self.vertices.push(Vertex { normal, uv: v_downwards(uv), color_srgba8, ..plain });
    }

    /// The vertices with their colours.
    pub(super) fn colored(&self) -> Vec<Vertex> {
        let scale = scale_to_bytes(self.float_colors.iter().flatten().copied());
        let mut vertices = self.vertices.clone();
        for (vertex, color) in vertices.iter_mut().zip(&self.float_colors) {
            vertex.color_srgba8 = bytes(*color, scale);
        }
        vertices
    }
}

/// PLY's v runs upwards. Coordinates that are not finite are 0.
pub(super) fn v_downwards(uv: [f32; 2]) -> [f32; 2] {
    let [u, v] = uv.map(|c| if c.is_finite() { c } else { 0.0 });
    [u, 1.0 - v]
}
