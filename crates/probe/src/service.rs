//! Probing as a service of a node.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use cluster::{BudgetMeasurement, Costs, MeasureCosts, Measured};
use depth_image::{PinholeCamera, VIEW_REACH_PX, ViewPlanes};
use metrics::FLIP_REACH_PX;
use node::{Engine, EngineError, Turn, ViewAudit, ViewProbes, WorkClass, own_time, push_latest};
use parking_lot::Mutex;
use planner::ViewErrors;
use tonic::Status;

use crate::errors_of_views::view_errors;
use crate::prober::{ProbeError, Prober};
use crate::subject::{Light, Representation, Subject};

/// A part of a view depends on so much around it. Views are made in tiles of 8 pixels a side, and parts begin with whole ones.
const SURROUNDINGS_PX: u32 = (VIEW_REACH_PX + FLIP_REACH_PX).next_multiple_of(8);
/// Subjects whose true views and sets stay in memory.
const MAX_SUBJECTS: usize = 2;

/// Measures views on a node's device, after all its other work. One request is served at a time.
pub struct Probers {
    engine: Arc<dyn Engine>,
    /// The last used is the last.
    probers: Mutex<VecDeque<Prober>>,
}

impl Probers {
    /// Without subjects.
    #[must_use]
    pub fn new(engine: Arc<dyn Engine>) -> Self {
        Self { engine, probers: Mutex::default() }
    }

    /// A prober of the subject, as it was left or anew.
    fn taken(&self, probers: &mut VecDeque<Prober>, subject: Subject) -> Prober {
        let found = probers.iter().position(|prober| *prober.subject() == subject);
        let turn = Turn { class: WorkClass::Background, flow: Turn::next_flow() };
        found.and_then(|place| probers.remove(place)).unwrap_or_else(|| Prober::new(self.engine.clone(), subject, turn))
    }
}

impl ViewProbes for Probers {
    fn probe(&self, request: &MeasureCosts, budget: &BudgetMeasurement) -> Result<Measured, Status> {
        let mut probers = self.probers.lock();
        // Work that arrives meanwhile goes between slices of a measurement that nobody waits for.
        let _cut = self.engine.live_stream();
        let mut prober = self.taken(&mut probers, subject_of(request, budget));
        let (measured, busy_s) = own_time(self.engine.as_ref(), || measured(&mut prober, request, budget));
        push_latest(&mut probers, prober, MAX_SUBJECTS);
        let (views, costs) = measured?;
        Ok(Measured { costs, views, busy_s, ..Measured::default() })
    }

    fn audit(&self, audit: ViewAudit) -> Result<(ViewErrors, f64), Status> {
        let _cut = self.engine.live_stream();
        let turn = Turn { class: WorkClass::Background, flow: Turn::next_flow() };
        let (errors, busy_s) = own_time(self.engine.as_ref(), || audited(self.engine.as_ref(), turn, audit));
        Ok((errors.map_err(status)?, busy_s))
    }
}

/// The set is needed for the view alone: the time until it is drawn directly may be long.
fn audited(engine: &dyn Engine, turn: Turn, audit: ViewAudit) -> Result<ViewErrors, ProbeError> {
    let ViewAudit { set, sample_images, pinned, mut view, part, mut direct } = audit;
    let [camera] = view.cameras[..] else { return Err(not_one_view()) };
    let outer = part.surrounded(SURROUNDINGS_PX, camera.size_px);
    let camera = camera.part(&outer);
    (view.cameras, direct.cameras) = (vec![camera], vec![camera]);
    let made = engine.reconstruct(set.as_ref(), &view, turn)?;
    drop((set, pinned));
    let truths = engine.draw_direct(&direct, turn)?;
    let ([made], [truth]) = (&made[..], &truths[..]) else { return Err(not_one_view()) };
    let part: Vec<bool> = part.mask_within(&outer).collect();
    Ok(view_errors(&camera, truth, made, &sample_images, Some(&part))?)
}

fn not_one_view() -> ProbeError {
    EngineError::Device("an audit is of one view".to_owned()).into()
}

/// The errors of the views in their order, and the mean costs of their cells.
fn measured(
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
        let of = representation(request, cell)?;
        let (own_errors, own) = if budget.compared_lighting.is_some() {
            prober.probe(&of, Light::Screening, &cameras).map_err(status)?
        } else {
            (Vec::new(), prober.time(&of, &cameras).map_err(status)?)
        };
        let share = cameras.len() as f64 / request.typical_views.len() as f64;
        costs.sample_image_s += share * own.sample_image_s;
        costs.load_set_s += share * own.load_set_s;
        costs.reconstruct_view_s += share * own.reconstruct_view_s;
        places.iter().zip(own_errors).for_each(|(&place, own)| errors[place] = Some(own));
    }
    Ok((errors.into_iter().flatten().collect(), costs))
}

fn representation(request: &MeasureCosts, cell: u32) -> Result<Representation, Status> {
    let workload = request.workload.of_cell(cell as usize);
    let workload = workload.ok_or_else(|| Status::invalid_argument(format!("views: there is no view cell {cell}")))?;
    let sample_cameras = workload.sample_cameras.iter().map(|camera| camera.depth().copied());
    let Some(sample_cameras) = sample_cameras.collect() else {
        return Err(Status::invalid_argument("sample_cameras: budgets choose among depth images alone"));
    };
    Ok(Representation { sampling: workload.sampling, method: request.method.clone(), sample_cameras })
}

fn subject_of(request: &MeasureCosts, budget: &BudgetMeasurement) -> Subject {
    let workload = &request.workload;
    Subject {
        scene_hash: workload.scene.hash.to_string(),
        volume: workload.volume,
        background: workload.background,
        illumination: workload.illumination.clone(),
        lighting: workload.lighting.clone(),
        screening_lighting: budget.compared_lighting.as_ref().unwrap_or(&workload.lighting).clone(),
        scene_time_s: workload.timeline.start_s as f32,
        planes: ViewPlanes { antialias: request.planes.antialias, ..ViewPlanes::COLOR },
    }
}

fn status(error: ProbeError) -> Status {
    match error {
        ProbeError::Engine(error) => EngineError::into(error),
        other => Status::internal(other.to_string()),
    }
}
