//! Audits of promises: compositors draw some of the views that they make directly as well, and compare them.

use depth_image::Antialias;
use planner::{Interval, ViewErrors};
use serde::{Deserialize, Serialize};

use crate::check::{InvalidField, at_most, nonempty, within};
use crate::limits::MAX_PROBE_VIEWS;

/// The greatest share of a compositor's time that audits may take.
pub const MAX_AUDIT_TIME_RATIO: f64 = 0.5;
/// A promise is for views of up to this many times the planned pixels, or of that share of them.
pub const MOST_PLANNED_PIXELS: f64 = 2.0;
/// More pixels than any view has.
const MAX_PIXELS: u32 = 1 << 28;

/// How the views of a plan are audited.
#[derive(Debug, Clone, PartialEq)]
pub struct AuditOrder {
    /// The share of a compositor's time, drawing and comparing included: above 0, at most 0.5.
    pub time_ratio: f64,
    /// Samples a pixel of the views that the promise is for.
    pub antialias: Antialias,
    /// Pixels of a view as it was planned for.
    pub planned_pixel_count: u32,
    /// The light of the directly drawn views with which views are compared.
    pub truth_lighting: String,
}

/// The audits of a member since its last report.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AuditReport {
    /// Audited views.
    pub views: Vec<AuditedView>,
    /// Views that the promise is for, audited or not.
    pub covered_views: u64,
    /// Views that the promise is not for.
    pub uncovered_views: u64,
}

/// A view that was drawn directly as well.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AuditedView {
    /// The plan by which it was made.
    pub plan_epoch: u64,
    /// Its errors.
    pub errors: ViewErrors,
    /// They are those of a part of it, which was chosen at random.
    pub is_part: bool,
}

/// The findings of the audits of a promise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AuditSummary {
    /// Views that were audited since the representation is in force.
    pub audited_views: u64,
    /// Views that the promise is for, audited or not.
    pub covered_views: u64,
    /// Views that the promise is not for.
    pub uncovered_views: u64,
    /// The interval of the error as a ratio, however often it is looked at; `None` for too few views.
    pub error: Option<Interval>,
}

impl AuditOrder {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        if !(self.time_ratio > 0.0 && self.time_ratio <= MAX_AUDIT_TIME_RATIO) {
            return Err(InvalidField::out_of_range("audit.time_ratio", self.time_ratio, "above 0 and at most 0.5"));
        }
        within(self.planned_pixel_count, 1..=MAX_PIXELS, "audit.planned_pixel_count", "from 1 to 2^28")?;
        nonempty(&self.truth_lighting, "audit.truth_lighting")
    }
}

/// Errors of a view are from 0 to 1.
pub(crate) fn check_view_errors(errors: &ViewErrors) -> Result<(), InvalidField> {
    errors.validate().map_err(|error| InvalidField::out_of_range(error.field, error.value, error.allowed))
}

impl AuditReport {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        at_most(self.views.len(), MAX_PROBE_VIEWS, "audit.views")?;
        self.views.iter().try_for_each(|view| check_view_errors(&view.errors))
    }
}

impl AuditSummary {
    /// The share of views that the promise is not for.
    #[must_use]
    pub fn uncovered_ratio(&self) -> f64 {
        self.uncovered_views as f64 / (self.covered_views + self.uncovered_views).max(1) as f64
    }

    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        let Some(Interval { low, mean, high }) = self.error else { return Ok(()) };
        [low, mean, high].into_iter().try_for_each(|ratio| within(ratio, 0.0..=1.0, "audit.error", "from 0 to 1"))
    }
}
