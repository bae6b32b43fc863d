//! Probing as a service of a node.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use cluster::{BudgetMeasurement, Costs, DIRECT, MeasureCosts, Measured, SamplePlanes};
use depth_image::{PinholeCamera, VIEW_REACH_PX};
use metrics::FLIP_REACH_PX;
use node::{Engine, MadeView, Turn, ViewAudit, ViewProbes, WorkClass, own_time, push_latest};
use parking_lot::Mutex;
use planner::ViewErrors;
use tonic::Status;

use crate::errors_of_views::view_errors;
use crate::prober::{Prober, internal};

/// A part of a view depends on so much around it. Views are made in tiles of 8 pixels a side, and parts begin with whole ones.
const SURROUNDINGS_PX: u32 = (VIEW_REACH_PX + FLIP_REACH_PX).next_multiple_of(8);
/// Scenes whose true views and sets stay in memory.
const MAX_SUBJECTS: usize = 2;

/// Measures views on a node's device, after all its other work. One request is served at a time.
pub struct Probers {
    engine: Arc<dyn Engine>,
    /// Probers by the hash of their scene, the latest last.
    probers: Mutex<VecDeque<(String, Prober)>>,
}

impl Probers {
    /// Without scenes.
    #[must_use]
    pub fn new(engine: Arc<dyn Engine>) -> Self {
        Self { engine, probers: Mutex::default() }
    }

    fn turn() -> Turn {
        Turn { class: WorkClass::Background, flow: Turn::next_flow() }
    }
}

impl ViewProbes for Probers {
    fn probe(&self, request: &MeasureCosts, budget: &BudgetMeasurement) -> Result<Measured, Status> {
        let mut probers = self.probers.lock();
        // Work that arrives meanwhile goes between slices of a measurement that nobody waits for.
        let _cut = self.engine.live_stream();
        let scene = request.workload.scene.hash.to_string();
        let found = probers.iter().position(|(other, _)| *other == scene).and_then(|place| probers.remove(place));
        let (_, mut prober) = found.unwrap_or_else(|| (scene.clone(), Prober::new(self.engine.clone(), Self::turn())));
        let (measured, busy_s) = own_time(self.engine.as_ref(), || of_cells(&mut prober, request, budget));
        push_latest(&mut probers, (scene, prober), MAX_SUBJECTS);
        let (views, costs) = measured?;
        let is_direct = request.method == DIRECT;
        let planes = if is_direct { SamplePlanes::default() } else { self.engine.sample_planes(&request.method)? };
        Ok(Measured { costs, views, busy_s, planes, ..Measured::default() })
    }

    fn audit(&self, audit: ViewAudit) -> Result<(ViewErrors, f64), Status> {
        let _cut = self.engine.live_stream();
        let (errors, busy_s) = own_time(self.engine.as_ref(), || audited(self.engine.as_ref(), Self::turn(), audit));
        Ok((errors?, busy_s))
    }
}

/// The set is needed for the view alone: the time until it is drawn directly may be long.
fn audited(engine: &dyn Engine, turn: Turn, audit: ViewAudit) -> Result<ViewErrors, Status> {
    let ViewAudit { made, camera, part, mut truth } = audit;
    let outer = part.surrounded(SURROUNDINGS_PX, camera.size_px);
    let camera = camera.part(&outer);
    let made = match made {
        MadeView::FromSet { set, pinned, mut view } => {
            view.cameras = vec![camera];
            let made = engine.reconstruct(set.as_ref(), &view, turn)?;
            drop((set, pinned));
            made
        }
        MadeView::Direct(mut view) => {
            view.cameras = vec![camera];
            engine.draw_direct(&view, turn)?
        }
    };
    truth.cameras = vec![camera];
    let truths = engine.draw_direct(&truth, turn)?;
    let ([made], [truth]) = (&made[..], &truths[..]) else { return Err(internal("an audit is of one view")) };
    let part: Vec<bool> = part.mask_within(&outer).collect();
    view_errors(&camera, truth, made, Some(&part)).map_err(internal)
}

/// The errors of the views in their order, and the mean costs of their cells.
fn of_cells(
    prober: &mut Prober,
    request: &MeasureCosts,
    budget: &BudgetMeasurement,
) -> Result<(Vec<ViewErrors>, Costs), Status> {
    let mut of_cells: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (place, view) in request.typical_views.iter().enumerate() {
        of_cells.entry(request.workload.cell_of(view)).or_default().push(place);
    }
    let mut errors = vec![None; request.typical_views.len()];
    let mut costs = Costs::default();
    for (cell, places) in of_cells {
        let cameras: Vec<PinholeCamera> = places.iter().map(|&place| request.typical_views[place]).collect();
        let workload = request.workload.of_cell(cell as usize);
        let workload =
            workload.ok_or_else(|| Status::invalid_argument(format!("views: there is no view cell {cell}")))?;
        let (own_errors, own) = prober.probe(request, budget, &workload, &cameras)?;
        let share = cameras.len() as f64 / request.typical_views.len() as f64;
        costs.sample_image_s += share * own.sample_image_s;
        costs.load_set_s += share * own.load_set_s;
        costs.reconstruct_view_s += share * own.reconstruct_view_s;
        places.iter().zip(own_errors).for_each(|(&place, own)| errors[place] = Some(own));
    }
    Ok((errors.into_iter().flatten().collect(), costs))
}
