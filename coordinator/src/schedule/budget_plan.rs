//! The plan for a budget: its measurements, as a node is asked for them.

use cluster::{InvalidField, MeasureCosts, Workload};
use depth_image::{PinholeCamera, ViewCell};
use glam::DVec3;
use planner::{Demand, PlanRequest, Planner, Probe, ProbeView, Row};

use super::budgeted::{Budgeted, part_of};

/// A plan for the views of some cells of a workload.
#[derive(Debug, Clone)]
pub struct BudgetPlan {
    /// The plan.
    pub planner: Planner,
    pub(super) budgeted: Budgeted,
    /// As the session asks for it.
    pub workload: Workload,
    cells: Vec<ViewCell>,
}

impl BudgetPlan {
    /// A plan that has measured nothing yet.
    ///
    /// # Errors
    /// For rows or cells that cannot be planned for.
    pub(crate) fn new(
        number: u64,
        budgeted: Budgeted,
        workload: Workload,
        cells: Vec<ViewCell>,
        demand: Demand,
    ) -> Result<Self, InvalidField> {
        if cells.is_empty() {
            return Err(InvalidField::Missing { field: "viewpoints" });
        }
        let exact = budgeted.rows.iter().position(|row| matches!(row, Row::Direct { ray_ratio: 1.0, .. }));
        let request = PlanRequest { number, budget: budgeted.budget, rows: budgeted.rows.clone(), exact, demand };
        let planner = Planner::new(request)
            .map_err(|error| InvalidField::out_of_range(error.field, error.value, error.allowed))?;
        Ok(Self { planner, budgeted, workload, cells })
    }

    /// A row by its place.
    #[must_use]
    pub fn row(&self, row: usize) -> Option<&Row> {
        self.budgeted.rows.get(row)
    }

    /// A measurement as a node is asked for it.
    #[must_use]
    pub fn measurement(&self, probe: &Probe) -> Option<MeasureCosts> {
        let views = probe.views.iter().map(|&view| self.camera(view)).collect();
        Some(self.budgeted.measurement(self.row(probe.row)?, &self.workload, &self.cells, views))
    }

    /// The camera of a view, or of the part of it that is compared.
    #[must_use]
    pub fn camera(&self, view: ProbeView) -> PinholeCamera {
        let place = view.place(self.planner.request().number);
        let cell = &self.cells[((place.cell * self.cells.len() as f64) as usize).min(self.cells.len() - 1)];
        let eye = (DVec3::from_array(place.eye) * 2.0 - 1.0).as_vec3();
        let whole = cell.view_at(eye, &self.budgeted.typical_view);
        if view.is_whole() { whole } else { part_of(&whole, place.part) }
    }
}
