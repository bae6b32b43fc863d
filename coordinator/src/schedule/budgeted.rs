//! Budgets of sessions, and what the schedule needs to plan for one.

use cluster::{InvalidField, MOST_PLANNED_PIXELS, Workload, nonempty};
use depth_image::{Antialias, PinholeCamera, SampleCamera, ViewCell};
use glam::UVec2;
use planner::{Budget, Ladder, Row};
use serde::{Deserialize, Serialize};

/// A session's budget, and the representations among which it chooses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Budgeted {
    /// The budget.
    pub budget: Budget,
    /// The rows that the session's own choices leave, one to 220.
    pub rows: Vec<Row>,
    /// The size of sample images at a side ratio of 1.
    pub whole_px: UVec2,
    /// Every row is sampled by the workload's own cameras.
    pub keeps_cameras: bool,
    /// A view as most of the session's are.
    pub typical_view: PinholeCamera,
    /// Samples a pixel.
    pub antialias_samples: u32,
    /// How frames are encoded.
    pub codec: String,
    /// The light in which rows are compared: the session's, or a cheaper one where rays are traced.
    pub screening_lighting: String,
}

impl Budgeted {
    /// Whether sessions with comparable budgets can share a representation: they choose among the same, for views of about
    /// one size.
    pub(super) fn is_shareable(&self, other: &Self) -> bool {
        let pixels_ratio = other.typical_view.pixel_count() as f64 / self.typical_view.pixel_count() as f64;
        let with_own_views =
            Self { budget: self.budget, typical_view: self.typical_view, codec: self.codec.clone(), ..other.clone() };
        *self == with_own_views && (MOST_PLANNED_PIXELS.recip()..=MOST_PLANNED_PIXELS).contains(&pixels_ratio)
    }

    pub(super) fn ladder(&self) -> Result<Ladder, InvalidField> {
        Ladder::new(self.rows.clone()).map_err(|error| InvalidField::out_of_range("rows", error, "a ladder"))
    }

    pub(super) fn antialias(&self) -> Antialias {
        Antialias::of(self.antialias_samples).unwrap_or_default()
    }

    /// The workload as a row samples it, in these view cells.
    pub(super) fn sampled_as(&self, row: &Row, workload: &Workload, cells: &[ViewCell]) -> Workload {
        let cameras: Vec<Vec<SampleCamera>> = if self.keeps_cameras {
            let own = workload.sample_cameras.iter();
            vec![own.map(|camera| camera.resized(row.size_px(camera.size_px()))).collect()]
        } else {
            let of_cells = cells.iter().map(|cell| row.cameras(cell, self.whole_px));
            of_cells.map(|cameras| cameras.into_iter().map(SampleCamera::from).collect()).collect()
        };
        let workload = Workload { sampling: row.sampling.clone(), ..workload.clone() };
        match workload.cell_first_indices.is_empty() {
            true => Workload { sample_cameras: cameras.concat(), ..workload },
            false => workload.with_view_cells(cameras),
        }
    }

    /// # Errors
    /// For rows that are no ladder, and for texts and a view that cannot be used.
    pub(crate) fn validate(&self) -> Result<(), InvalidField> {
        self.ladder()?;
        nonempty(&self.codec, "codec")?;
        nonempty(&self.screening_lighting, "screening_lighting")?;
        self.typical_view.validate().map_err(|source| InvalidField::Camera { field: "typical_view", source })
    }
}
