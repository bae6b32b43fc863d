//! The budget of a session, and the rows among which it chooses.

use cluster::{DIRECT, PolicyChoice, SessionRequest, Workload};
use depth_image::{SampleCamera, ViewCell};
use planner::{Budget, Demand, Row};
use tonic::Status;

use crate::config::{CoordinatorConfig, SceneOffer};
use crate::light_samples::LightSamples;
use crate::schedule::{BudgetPlan, Budgeted};
use crate::workload::{light_size_px, workload_of};

/// The session's budget, else the coordinator's; `None` without either, and where the coordinator's is not for the session.
///
/// # Errors
/// The session's text is no budget, or the session decides what a budget would choose.
pub(crate) fn budgeted(
    request: &SessionRequest,
    workload: &Workload,
    offer: &SceneOffer,
    config: &CoordinatorConfig,
) -> Result<Option<Budgeted>, Status> {
    let own = request.budget.budget.as_deref().map(str::parse::<Budget>).transpose();
    let own = own.map_err(|error| Status::invalid_argument(format!("budget: {error}")))?;
    let Some(budget) = own.or(config.budget) else { return Ok(None) };
    match unsuitable(request, workload) {
        Some(reason) if own.is_some() => return Err(Status::invalid_argument(format!("budget: {reason}"))),
        Some(_) => return Ok(None),
        None => (),
    }
    let full_px = light_size_px(&offer.rig, &request.typical_view);
    let budgeted = Budgeted {
        budget,
        rows: (config.rows)(&request.lighting),
        full_px: full_px.unwrap_or_else(|| workload.sample_cameras[0].size_px()),
        typical_view: request.typical_view,
        antialias_samples: request.planes.antialias.samples(),
        codec: request.codec.clone(),
    };
    budgeted.validate().map_err(|error| Status::invalid_argument(format!("budget: {error}")))?;
    Ok(Some(budgeted))
}

/// The plan for the budget of a session that is alone, which [`serve`](crate::serve) would make. `number` chooses the views.
///
/// # Errors
/// As for the session, which must have a budget.
pub fn plan_for_session(
    number: u64,
    request: &SessionRequest,
    offer: &SceneOffer,
    rows: fn(&str) -> Vec<Row>,
    demand: Demand,
) -> Result<BudgetPlan, Status> {
    let config = CoordinatorConfig { rows, ..CoordinatorConfig::default() };
    let workload = workload_of(request, offer, LightSamples::FULL)?;
    let budgeted = budgeted(request, &workload, offer, &config)?;
    let budgeted = budgeted.ok_or_else(|| Status::invalid_argument("budget is missing"))?;
    let cells = ViewCell::between(&SampleCamera::references(&workload.sample_cameras)).into_iter().collect();
    BudgetPlan::new(number, budgeted, workload, cells, demand)
        .map_err(|error| Status::invalid_argument(error.to_string()))
}

/// Why no budget can be kept for a session.
fn unsuitable(request: &SessionRequest, workload: &Workload) -> Option<&'static str> {
    let is_depth = workload.sample_cameras.first().is_some_and(|camera| SampleCamera::depth(camera).is_some());
    let reasons = [
        (
            request.budget.names_method || request.method == DIRECT,
            "the reconstruction method is named, which it chooses",
        ),
        (request.policy != PolicyChoice::Auto, "the policy is named, which it chooses"),
        (request.sample_size_px.is_some(), "the size of sample images is named, which it chooses"),
        (workload.samples_cube() || !is_depth, "none can be kept for a layered cube"),
        (
            !workload.common_cells.is_empty(),
            "none can be kept for images of what mirrors show, and beside a base or blocks",
        ),
    ];
    reasons.into_iter().find_map(|(applies, reason)| applies.then_some(reason))
}
