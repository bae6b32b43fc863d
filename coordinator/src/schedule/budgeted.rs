//! Budgets of sessions, and the ways to make their views that are measured for one.

use cluster::{BudgetMeasurement, DIRECT, InvalidField, MOST_PLANNED_PIXELS, MeasureCosts, Workload, nonempty};
use depth_image::{Antialias, PinholeCamera, SampleCamera, ViewCell, ViewPart, ViewPlanes};
use glam::UVec2;
use planner::{Budget, Row};
use serde::{Deserialize, Serialize};

/// Larger views are compared in parts of at most about this size.
const MOST_PART_PIXELS: usize = 1 << 16;

/// A session's budget, and the rows among which it chooses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Budgeted {
    /// The budget.
    pub budget: Budget,
    /// The rows; the last is direct drawing in the light of the session.
    pub rows: Vec<Row>,
    /// The size of sample images of density 1.
    pub full_px: UVec2,
    /// A view as most of the session's are.
    pub typical_view: PinholeCamera,
    /// Samples a pixel.
    pub antialias_samples: u32,
    /// How frames are encoded.
    pub codec: String,
}

impl Budgeted {
    /// Whether sessions share a promise: they have one budget, for views of about one size.
    pub(super) fn is_shareable(&self, other: &Self) -> bool {
        let pixels_ratio = other.typical_view.pixel_count() as f64 / self.typical_view.pixel_count() as f64;
        let with_own_views =
            Self { typical_view: self.typical_view, full_px: self.full_px, codec: self.codec.clone(), ..other.clone() };
        *self == with_own_views && (MOST_PLANNED_PIXELS.recip()..=MOST_PLANNED_PIXELS).contains(&pixels_ratio)
    }

    pub(super) fn antialias(&self) -> Antialias {
        Antialias::of(self.antialias_samples).unwrap_or_default()
    }

    /// The workload as a row makes it, in these view cells.
    pub(super) fn in_row(&self, row: &Row, workload: &Workload, cells: &[ViewCell]) -> Workload {
        let (camera_count, density) = match row {
            Row::Direct { lighting, .. } => return Workload { lighting: lighting.clone(), ..workload.clone() },
            Row::Samples { camera_count, density, .. } => (*camera_count, *density),
        };
        let size_px = (self.full_px.as_dvec2() * density).round().as_uvec2().max(UVec2::ONE);
        let cameras = cells.iter().map(|cell| cell.nested_cameras(camera_count as usize, size_px));
        let cameras: Vec<Vec<SampleCamera>> =
            cameras.map(|cameras| cameras.into_iter().map(SampleCamera::from).collect()).collect();
        match workload.cell_first_indices.is_empty() {
            true => Workload { sample_cameras: cameras.concat(), ..workload.clone() },
            false => workload.clone().with_view_cells(cameras),
        }
    }

    /// The request to measure a row: the errors of views, and its costs.
    pub(super) fn measurement(
        &self,
        row: &Row,
        workload: &Workload,
        cells: &[ViewCell],
        views: Vec<PinholeCamera>,
    ) -> MeasureCosts {
        MeasureCosts {
            workload: self.in_row(row, workload, cells),
            method: match row {
                Row::Samples { method, .. } => method.clone(),
                Row::Direct { .. } => DIRECT.to_owned(),
            },
            codec: self.codec.clone(),
            batch_count: views.len() as u32,
            typical_views: views,
            planes: ViewPlanes { antialias: self.antialias(), ..ViewPlanes::COLOR },
            in_background: true,
            budget: Some(BudgetMeasurement { truth_lighting: workload.lighting.clone() }),
        }
    }

    /// # Errors
    /// For rows, texts and a view that cannot be used.
    pub(crate) fn validate(&self) -> Result<(), InvalidField> {
        for row in &self.rows {
            row.validate().map_err(|error| InvalidField::out_of_range("rows", error, "valid"))?;
        }
        nonempty(&self.codec, "codec")?;
        self.typical_view.validate().map_err(|source| InvalidField::Camera { field: "typical_view", source })
    }
}

/// A part of a view, the same size for all parts of views of one size. `place` has two numbers from 0 to below 1, by column and row.
pub(super) fn part_of(view: &PinholeCamera, place: [f64; 2]) -> PinholeCamera {
    let parts_a_side = (view.pixel_count() as f64 / MOST_PART_PIXELS as f64).sqrt().ceil().max(1.0);
    let size_px = (view.size_px.as_dvec2() / parts_a_side).as_uvec2().max(UVec2::ONE);
    let [column, row] = place.map(|place| (place * parts_a_side) as u32);
    view.part(&ViewPart { first_px: UVec2::new(column, row) * size_px, size_px })
}
