//! The vertices of a PLY file, of which the surface takes those that its faces use.

use glam::DVec3;
use serde::Deserialize;

use super::super::source_scene::plain_vertex;
use super::super::vertex_colors::{ColorRange, Colors};
use super::super::warnings::Warnings;
use crate::Vertex;

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
    pub vertices: Vec<Vertex>,
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
pub(super) fn v_downwards(uv: [f32; 2]) -> [f32; 2] {
    let [u, v] = uv.map(|c| if c.is_finite() { c } else { 0.0 });
    [u, 1.0 - v]
}
