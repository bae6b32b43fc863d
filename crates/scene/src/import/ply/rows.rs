//! Rows of a PLY file as `serde-ply` reads them.

use glam::DVec3;
use serde::Deserialize;

/// A vertex of numbers of any type. Position and colour come first, and no field has an alias, so that `serde-ply`
/// reads common rows by offset instead of by name. The header has shown that there is a position.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct VertexRow {
    x: f64,
    y: f64,
    z: f64,
    red: Option<f32>,
    green: Option<f32>,
    blue: Option<f32>,
    alpha: Option<f32>,
    nx: f32,
    ny: f32,
    nz: f32,
    s: Option<f32>,
    t: Option<f32>,
}

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

/// A row of an element that scenes do not use.
#[derive(Deserialize)]
pub(super) struct SkippedRow {}

impl VertexRow {
    pub(super) fn position(&self) -> DVec3 {
        DVec3::new(self.x, self.y, self.z)
    }

    /// Zero where it must be computed.
    pub(super) fn normal(&self) -> DVec3 {
        DVec3::new(f64::from(self.nx), f64::from(self.ny), f64::from(self.nz))
    }

    /// The coordinates as the file has them: v runs upwards.
    pub(super) fn uv(&self) -> [f32; 2] {
        [self.s.unwrap_or(0.0), self.t.unwrap_or(0.0)]
    }

    /// The colour as the file has it; NaN for a channel that is not there.
    pub(super) fn color(&self) -> [f32; 4] {
        [self.red, self.green, self.blue, self.alpha].map(|channel| channel.unwrap_or(f32::NAN))
    }
}

impl FaceRow {
    /// The colour as the file has it; NaN for a channel that is not there.
    pub(super) fn color(&self) -> [f32; 4] {
        [self.red, self.green, self.blue, self.alpha].map(|channel| channel.unwrap_or(f32::NAN))
    }
}
