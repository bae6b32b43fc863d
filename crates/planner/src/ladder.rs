//! The representations among which a budget chooses.

use std::collections::BTreeSet;
use std::fmt;

use depth_image::{PinholeCamera, ViewCell};
use glam::UVec2;
use serde::{Deserialize, Serialize};

use crate::invalid::{InvalidField, name, within};

/// The most rows of a ladder.
pub const MAX_ROWS: usize = 220;
/// The most sample cameras of a row.
const MAX_CAMERAS: u32 = 64;

/// One representation: how a scene is sampled, and how views are reconstructed from the samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The sampling method, as users name it.
    pub sampling: String,
    /// The reconstruction method, as users name it.
    pub method: String,
    /// S.
    pub camera_count: u32,
    /// The places of the sample cameras: one for each camera, or a single one for all.
    pub place_count: u32,
    /// The side of a sample image, as a share of the side that `--sample-size auto` chooses.
    pub side_ratio: f64,
    /// Rows of one kind differ in effort only.
    pub kind: String,
    /// The effort of reconstruction within the kind.
    pub rank: u32,
}

impl Row {
    /// Whether the row is of the other's kind and has no more sample cameras, no larger images and no higher rank. Its
    /// errors are then expected to be no smaller.
    #[must_use]
    pub fn is_dominated_by(&self, other: &Self) -> bool {
        self.kind == other.kind
            && self.camera_count <= other.camera_count
            && self.side_ratio <= other.side_ratio
            && self.rank <= other.rank
    }

    /// # Errors
    /// For a value that its field does not allow.
    pub fn validate(&self) -> Result<(), InvalidField> {
        name(&self.sampling, "sampling")?;
        name(&self.method, "method")?;
        name(&self.kind, "kind")?;
        within(self.camera_count, 1..=MAX_CAMERAS, "camera_count", "from 1 to 64")?;
        if self.place_count != 1 && self.place_count != self.camera_count {
            return Err(InvalidField::new("place_count", self.place_count, "1 or camera_count"));
        }
        within(self.side_ratio, 0.01..=16.0, "side_ratio", "from 0.01 to 16")
    }

    /// The sample cameras of the row in a view cell. `whole_px` is the size of images at a side ratio of 1.
    #[must_use]
    pub fn cameras(&self, cell: &ViewCell, whole_px: UVec2) -> Vec<PinholeCamera> {
        let placed = cell.nested_cameras(self.place_count as usize, self.size_px(whole_px));
        placed.iter().copied().cycle().take(self.camera_count as usize).collect()
    }

    /// The size of sample images, from their size at a side ratio of 1.
    #[must_use]
    pub fn size_px(&self, whole_px: UVec2) -> UVec2 {
        (whole_px.as_vec2() * self.side_ratio as f32).round().as_uvec2().max(UVec2::ONE)
    }

    /// The fields by which rows differ.
    fn identity(&self) -> (&str, &str, u32, u64) {
        (&self.sampling, &self.method, self.camera_count, self.side_ratio.to_bits())
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { sampling, method, camera_count, side_ratio, .. } = self;
        write!(f, "{sampling}, S = {camera_count}, side {side_ratio}, {method}")
    }
}

/// Rows to choose from, 1 to [`MAX_ROWS`], each once.
#[derive(Debug, Clone, PartialEq)]
pub struct Ladder {
    rows: Vec<Row>,
}

impl Ladder {
    /// # Errors
    /// For no rows, too many, an invalid one, or one that is there twice.
    pub fn new(rows: Vec<Row>) -> Result<Self, InvalidField> {
        within(rows.len(), 1..=MAX_ROWS, "rows", "from 1 to 220")?;
        rows.iter().try_for_each(Row::validate)?;
        let mut seen = BTreeSet::new();
        match rows.iter().find(|row| !seen.insert(row.identity())) {
            Some(row) => Err(InvalidField::new("rows", format!("with {row} twice"), "without repeated rows")),
            None => Ok(Self { rows }),
        }
    }

    /// The rows, at least one.
    #[must_use]
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }
}
