//! Measurements of views on a node's device, for budgets and for audits.

use std::any::Any;

use cluster::{BudgetMeasurement, MeasureCosts, Measured, ViewErrors};
use depth_image::{PinholeCamera, ViewPart};
use tonic::Status;

use crate::engine::{DirectWork, SharedSet, ViewWork};

/// Measures views, after all other work of the device. Calls block.
pub trait ViewProbes: Send + Sync + 'static {
    /// Measures one way to make views in the way of a budget.
    ///
    /// # Errors
    /// The device fails, or refuses the way to make them.
    fn probe(&self, request: &MeasureCosts, budget: &BudgetMeasurement) -> Result<Measured, Status>;

    /// The errors of one view, or of a part of it, that is made again and drawn directly, and the seconds that this took without waits.
    ///
    /// # Errors
    /// The device fails.
    fn audit(&self, view: ViewAudit) -> Result<(ViewErrors, f64), Status>;
}

/// A view to make again and to compare with the same view of the scene.
pub struct ViewAudit {
    /// How the view is made.
    pub made: MadeView,
    /// The whole view.
    pub camera: PinholeCamera,
    /// The part of the view that is compared.
    pub part: ViewPart,
    /// The same from the scene, with depth.
    pub truth: DirectWork,
}

/// How an audited view is made; its camera is the audit's.
#[allow(missing_docs, reason = "self-naming fields")]
pub enum MadeView {
    /// From a sample set, which is kept in memory until the view is made.
    FromSet { set: SharedSet, pinned: Box<dyn Any + Send>, view: ViewWork },
    /// From the scene, with fewer rays than its truth.
    Direct(DirectWork),
}
