//! Measurements of views on a node's device, for budgets and for audits.

use std::any::Any;
use std::sync::Arc;

use cluster::{BudgetMeasurement, MeasureCosts, Measured, ViewErrors};
use depth_image::{DepthImage, ViewPart};
use tonic::Status;

use crate::engine::{DirectWork, SharedSet, ViewWork};

/// Measures views, after all other work of the device. Calls block.
pub trait ViewProbes: Send + Sync + 'static {
    /// Measures a representation in the way of a budget.
    ///
    /// # Errors
    /// The device fails, or refuses the representation.
    fn probe(&self, request: &MeasureCosts, budget: &BudgetMeasurement) -> Result<Measured, Status>;

    /// The errors of one view, or of a part of it, that is made again and drawn directly, and the seconds that this took without waits.
    ///
    /// # Errors
    /// The device fails.
    fn audit(&self, view: ViewAudit) -> Result<(ViewErrors, f64), Status>;
}

/// A view to compare with the same view of the scene.
pub struct ViewAudit {
    /// The set that it is made from.
    pub set: SharedSet,
    /// Its images where they are compared, too; else none.
    pub sample_images: Arc<[DepthImage]>,
    /// Keeps the set in memory until the view is made.
    pub pinned: Box<dyn Any + Send>,
    /// One view.
    pub view: ViewWork,
    /// The part of it that is compared.
    pub part: ViewPart,
    /// The same from the scene, with depth.
    pub direct: DirectWork,
}
