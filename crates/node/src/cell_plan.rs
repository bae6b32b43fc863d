//! The plan of one view cell.

use std::ops::Deref;
use std::sync::Arc;

use cluster::Assignment;
use tonic::Status;

/// The plan of one view cell, without the images of other cells. Clones share it.
#[derive(Debug, Clone)]
pub struct CellPlan {
    plan: Arc<Assignment>,
    cell: u32,
    cell_count: usize,
}

impl CellPlan {
    /// The part of `plan` for one view cell.
    ///
    /// # Errors
    /// For a cell beyond the plan's last.
    pub fn of(plan: &Arc<Assignment>, cell: u32) -> Result<Self, Status> {
        let cell_count = plan.workload.cell_count();
        if (cell, cell_count) == (0, 1) {
            return Ok(Self { plan: plan.clone(), cell, cell_count });
        }
        let beyond = || Status::invalid_argument(format!("cell_index {cell} is beyond {cell_count} view cells"));
        Ok(Self { plan: Arc::new(plan.of_cell(cell).ok_or_else(beyond)?), cell, cell_count })
    }

    /// Index into the plan's view cells.
    #[must_use]
    pub fn cell(&self) -> u32 {
        self.cell
    }

    /// The number of view cells of the whole plan.
    #[must_use]
    pub fn cell_count(&self) -> usize {
        self.cell_count
    }
}

impl Deref for CellPlan {
    type Target = Assignment;

    fn deref(&self) -> &Assignment {
        &self.plan
    }
}
