//! Rows of a PLY file as `serde-ply` reads them.

use serde::Deserialize;

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
