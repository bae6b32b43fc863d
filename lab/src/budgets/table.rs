//! All rows of one scene, measured on views that no plan sees.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::experiment::Experiment;
use app_core::planning::PlannedViews;
use app_core::setup::{SceneArgs, Setup};
use coordinator::schedule::BudgetPlan;
use depth_image::{Antialias, PinholeCamera, ViewCell};
use engine::GpuEngine;
use glam::{UVec2, Vec2};
use gpu::DevicePreference;
use node::ViewProbes;
use planner::{Budget, Demand, Probe, ProbeId, ProbeView, Row, RowCosts, ViewErrors};
use probe::Probers;
use render::Lighting;

use crate::statistics::median_of;

/// Parts of views on which rows are compared.
const VIEWS: u64 = 32;
/// Views of one measurement.
const VIEWS_A_PROBE: u64 = 16;
/// Times that a row is timed, each after all others.
const TIMES: usize = 3;
/// The plan whose fresh views the table has: no plan that is made has this number.
const HELD_OUT: u64 = 1 << 40;

/// A scene under a light, and the size of its views.
#[derive(Debug, Clone, Copy)]
pub struct Subject {
    pub scene: &'static str,
    pub lighting: Lighting,
    pub size_px: UVec2,
}

/// A subject on the device.
pub struct Stage {
    pub subject: Subject,
    args: SceneArgs,
    setup: Setup,
    engine: Arc<GpuEngine>,
    probers: Probers,
}

/// A row with its figures.
#[derive(Debug, Clone)]
pub struct TableRow {
    pub row: Row,
    pub errors: Vec<ViewErrors>,
    pub costs: RowCosts,
}

impl Stage {
    /// # Errors
    /// The scene cannot be used, or the device fails.
    pub fn new(engine: &Arc<GpuEngine>, subject: Subject) -> anyhow::Result<Self> {
        let args = SceneArgs { lighting: subject.lighting, ..SceneArgs::new(fixtures::spec(subject.scene)?) };
        let setup = args.load()?;
        engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
        Ok(Self { subject, args, setup, engine: engine.clone(), probers: Probers::new(engine.clone()) })
    }

    /// A view from the middle of the cell.
    ///
    /// # Errors
    /// The scene has no sample cameras.
    pub fn typical_view(&self) -> anyhow::Result<PinholeCamera> {
        let cell = ViewCell::between(&self.setup.around).context("no sample cameras")?;
        Ok(cell.camera_at(Vec2::ZERO, self.subject.size_px))
    }

    /// A cluster of one node with the scene.
    ///
    /// # Errors
    /// The device fails.
    pub fn experiment(&self, device: DevicePreference) -> anyhow::Result<Experiment> {
        Experiment::start(self.args.clone(), self.args.load()?, device, 1)
    }

    /// A plan that has measured nothing yet.
    ///
    /// # Errors
    /// The scene has no sample cameras, or the device fails.
    pub fn plan(&self, budget: Budget, demand: Demand, number: u64) -> anyhow::Result<BudgetPlan> {
        let typical_view = self.typical_view()?;
        let antialias = Antialias::of(4).context("four samples are offered")?;
        let lighting = self.subject.lighting;
        PlannedViews { budget, typical_view, antialias, lighting, demand, number }
            .begin(&self.setup, self.engine.as_ref())
    }

    /// A device that knows nothing of the table's measurements.
    pub fn probers_of_its_own(&self) -> Probers {
        Probers::new(self.engine.clone())
    }

    /// Measures all rows; calls `done` after each measurement.
    ///
    /// # Errors
    /// The device fails.
    pub fn table(&self, mut done: impl FnMut()) -> anyhow::Result<Vec<TableRow>> {
        let demand = Demand { nodes: 1, cells: 1, views_a_set: 1 };
        let plan = self.plan("flip 1".parse()?, demand, HELD_OUT)?;
        let rows = plan.planner.request().rows.iter();
        let mut table: Vec<TableRow> =
            rows.map(|row| TableRow { row: row.clone(), errors: Vec::new(), costs: RowCosts::default() }).collect();
        let mut times: Vec<Vec<RowCosts>> = vec![Vec::new(); table.len()];
        for _ in 0..TIMES {
            for (row, times) in times.iter_mut().enumerate() {
                times.push(self.probed(&plan, row, vec![ProbeView::Common(0)])?.1);
                done();
            }
        }
        for (row, measured) in table.iter_mut().enumerate() {
            for first in (0..VIEWS).step_by(VIEWS_A_PROBE as usize) {
                let views = (first..first + VIEWS_A_PROBE).map(ProbeView::Fresh).collect();
                measured.errors.extend(self.probed(&plan, row, views)?.0);
            }
            measured.costs = median_costs(&times[row]);
            done();
        }
        Ok(table)
    }

    /// The number of times that [`Self::table`] calls `done`, for so many rows.
    pub fn steps(rows: usize) -> usize {
        (1 + TIMES) * rows
    }

    fn probed(
        &self,
        plan: &BudgetPlan,
        row: usize,
        views: Vec<ProbeView>,
    ) -> anyhow::Result<(Vec<ViewErrors>, RowCosts)> {
        let probe = Probe { id: ProbeId { plan: HELD_OUT, number: 0 }, row, views };
        let request = plan.measurement(&probe).context("there is no such row")?;
        let budget = request.budget.clone().context("no measurement for a budget")?;
        let measured = self.probers.probe(&request, &budget).map_err(|status| anyhow::anyhow!("{status}"))?;
        let probed = measured.probed(probe.id);
        Ok((probed.views, probed.costs))
    }
}

impl TableRow {
    /// The price on one node.
    pub fn price_s(&self, views_a_set: usize) -> f64 {
        Demand { nodes: 1, cells: 1, views_a_set }.price_s(&self.row, &self.costs)
    }

    pub fn error_ratio(&self, budget: &Budget) -> f64 {
        ViewErrors::mean_error(&self.errors, budget)
    }
}

fn median_costs(times: &[RowCosts]) -> RowCosts {
    RowCosts {
        sample_image_s: median_of(times, |costs| costs.sample_image_s),
        load_set_s: median_of(times, |costs| costs.load_set_s),
        view_s: median_of(times, |costs| costs.view_s),
    }
}
