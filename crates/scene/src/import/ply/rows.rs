//! Rows of a PLY file.

use glam::DVec3;
use serde::Deserialize;

use super::super::source_scene::plain_vertex;
use crate::Vertex;

/// A vertex of numbers of any type. Position and colour come first, and no field has an alias, so that `serde-ply`
/// reads common rows by offset instead of by name.
#[derive(Deserialize)]
pub(super) struct VertexRow {
    x: f64,
    y: f64,
    z: f64,
    #[serde(default)]
    red: Option<f32>,
    #[serde(default)]
    green: Option<f32>,
    #[serde(default)]
    blue: Option<f32>,
    #[serde(default)]
    alpha: Option<f32>,
    #[serde(default)]
    nx: f32,
    #[serde(default)]
    ny: f32,
    #[serde(default)]
    nz: f32,
    #[serde(default)]
    s: Option<f32>,
    #[serde(default)]
    t: Option<f32>,
    #[serde(default)]
    u: Option<f32>,
    #[serde(default)]
    v: Option<f32>,
    #[serde(default)]
    texture_u: Option<f32>,
    #[serde(default)]
    texture_v: Option<f32>,
}

/// A polygon.
#[derive(Deserialize)]
pub(super) struct FaceRow {
    #[serde(alias = "vertex_index")]
    vertex_indices: Vec<u32>,
}

/// A row of an element that scenes do not use.
#[derive(Deserialize)]
pub(super) struct SkippedRow {}

impl VertexRow {
    pub(super) fn vertex(&self, color_scale: f32) -> Result<(DVec3, Vertex), String> {
        let position = DVec3::new(self.x, self.y, self.z);
        let normal = [self.nx, self.ny, self.nz];
        let u = self.s.or(self.u).or(self.texture_u).unwrap_or(0.0);
        let v = self.t.or(self.v).or(self.texture_v).unwrap_or(0.0);
        if !position.is_finite() || !normal.iter().chain(&[u, v]).all(|v| v.is_finite()) {
            return Err("a position, normal or texture coordinate is not finite".into());
        }
        let byte = |channel: Option<f32>| channel.map_or(255, |c| (c * color_scale + 0.5) as u8);
        let color_srgba8 = [byte(self.red), byte(self.green), byte(self.blue), byte(self.alpha)];
        // PLY's v runs upwards.
        Ok((position, Vertex { normal, uv: [u, 1.0 - v], color_srgba8, ..plain_vertex() }))
    }
}

impl FaceRow {
    pub(super) fn append_fan(&self, indices: &mut Vec<u32>) -> Result<(), String> {
        let [hub, rim @ ..] = self.vertex_indices.as_slice() else {
            return Err("it has no corners".into());
        };
        if rim.len() < 2 {
            return Err(format!("it has {} corners", rim.len() + 1));
        }
        indices.extend(rim.windows(2).flat_map(|edge| [*hub, edge[0], edge[1]]));
        Ok(())
    }
}
