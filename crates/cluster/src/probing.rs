//! Probing: a node measures what views of a representation cost, and how far they are from directly drawn ones.

use depth_image::{Antialias, PinholeCamera};

use serde::{Deserialize, Serialize};

use crate::check::{InvalidField, at_most, finite_seconds, nonempty, within};
use crate::costs::Costs;
use crate::limits::MAX_PROBE_VIEWS;
use crate::views::check_view_size;
use crate::workload::Workload;

/// Asks a node to measure views of a workload, at set 0 of its timeline.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeViews {
    /// The workload, sampled as the representation has it. Costs are those of its light.
    pub workload: Workload,
    /// How views are reconstructed.
    pub method: String,
    /// The light in which views are compared, cheaper than the workload's where geometry decides.
    pub compared_lighting: String,
    /// The views, each made from its own view cell: of one size, at least one.
    pub views: Vec<PinholeCamera>,
    /// Samples a pixel.
    pub antialias: Antialias,
    /// Views are compared with directly drawn ones. Otherwise the representation is timed alone, and nothing of earlier calls
    /// is used.
    pub with_errors: bool,
}

/// Errors of a view, each from 0 to 1; see `planner::ViewErrors`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "as there")]
pub struct ProbedView {
    pub foreground_ratio: f64,
    pub flip: f64,
    pub flip_whole: f64,
    pub mean_square: f64,
    pub disoccluded_ratio: f64,
}

/// The answer to [`ProbeViews`].
#[derive(Debug, Clone, PartialEq)]
pub struct ProbedViews {
    /// The errors of the views, in their order; none where none were asked for.
    pub views: Vec<ProbedView>,
    /// g_s, d and c; other costs are 0.
    pub costs: Costs,
    /// The node's time for all of it, in s.
    pub busy_s: f64,
}

impl ProbeViews {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        self.workload.validate()?;
        nonempty(&self.method, "reconstruction_method")?;
        nonempty(&self.compared_lighting, "compared_lighting")?;
        if self.workload.sample_cameras.is_empty() {
            return Err(InvalidField::Missing { field: "sample_cameras" });
        }
        at_most(self.views.len(), MAX_PROBE_VIEWS, "views")?;
        let first = self.views.first().ok_or(InvalidField::Missing { field: "views" })?;
        check_view_size(first.size_px, "views.size_px")?;
        for view in &self.views {
            view.validate().map_err(|source| InvalidField::Camera { field: "views", source })?;
        }
        match self.views.iter().find(|view| view.size_px != first.size_px) {
            Some(other) => Err(InvalidField::out_of_range("views", other.size_px, "all of one size")),
            None => Ok(()),
        }
    }
}

impl ProbedViews {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        at_most(self.views.len(), MAX_PROBE_VIEWS, "views")?;
        self.views.iter().try_for_each(ProbedView::validate)?;
        self.costs.validate()?;
        finite_seconds(self.busy_s, "busy_s")
    }
}

impl ProbedView {
    pub(crate) fn validate(&self) -> Result<(), InvalidField> {
        let Self { foreground_ratio, flip, flip_whole, mean_square, disoccluded_ratio } = *self;
        let fields = [
            (foreground_ratio, "foreground_ratio"),
            (flip, "flip_ratio"),
            (flip_whole, "flip_whole_ratio"),
            (mean_square, "mean_square_ratio"),
            (disoccluded_ratio, "disoccluded_ratio"),
        ];
        fields.into_iter().try_for_each(|(value, field)| within(value, 0.0..=1.0, field, "from 0 to 1"))
    }
}
