//! Requests of the planning for a budget to nodes and to the store of measurements.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::{MeasureCosts, Measured};
use node::blocking;
use planner::{
    Event as PlannerEvent, Kept, KeptKey, MAX_PROBE_VIEWS, ProbeId, Probed, RowCosts, Timed, median_costs,
    shortened_reason,
};
use tokio::sync::mpsc;
use tonic::{Code, Status};
use wire::rpc::NodeClient;

use crate::grpc_status::{of_node, within};
use crate::measuring::known_or_measured;
use crate::schedule::{Event, ViewProbe};
use crate::shared::Shared;

/// How long a node may measure, waits for other work included.
const PROBED_WITHIN: Duration = Duration::from_secs(300);
/// Measurements of earlier plans with more bytes are not used: events are logged whole.
const MOST_RECALLED_BYTES: usize = 8 << 20;

const _: () = assert!(MAX_PROBE_VIEWS <= cluster::limits::MAX_PROBE_VIEWS, "a planner's probe is one call");

/// Finds the measurements of earlier plans.
pub(crate) async fn recall(shared: Arc<Shared>, workload_number: u64, key: KeptKey) {
    let store = shared.config.plans.clone();
    let nothing = Kept::empty(key.clone());
    let found = blocking(move || {
        let kept = store.map(|store| store.read(&key));
        Ok::<_, Status>(kept.filter(|kept| kept.to_json().is_ok_and(|json| json.len() <= MOST_RECALLED_BYTES)))
    });
    let _one = shared.keeping.lock().await;
    let kept = found.await.ok().flatten().unwrap_or(nothing);
    planned(&shared, workload_number, PlannerEvent::Remembered(kept));
}

/// Keeps what was measured. The plan is made, whether a later one can use it or not.
pub(crate) async fn keep(shared: Arc<Shared>, kept: Kept) {
    let Some(store) = shared.config.plans.clone() else { return };
    let _one = shared.keeping.lock().await;
    let written = blocking(move || store.write(&kept).map_err(|error| Status::internal(error.to_string()))).await;
    if let Err(status) = written {
        tracing::warn!(reason = status.message(), "measurements are not kept");
    }
}

/// Has a node measure views.
pub(crate) async fn probe_views(shared: Arc<Shared>, probe: ViewProbe) {
    let workload_number = probe.workload_number;
    let id = probe.id;
    let start = Instant::now();
    let asking = tokio::spawn({
        let shared = shared.clone();
        async move { probed(&shared, probe).await }
    });
    // Whatever becomes of the task, the schedule hears of it.
    let answer = asking.await.unwrap_or_else(|error| Err(Status::unavailable(error.to_string())));
    match answer {
        Ok(event) => planned(&shared, workload_number, event),
        Err(status) => {
            let reason = shortened_reason(status.message());
            let busy_s = start.elapsed().as_secs_f64();
            match status.code() {
                // The node answered, and would answer the same again.
                Code::InvalidArgument | Code::Unimplemented | Code::OutOfRange => {
                    planned(&shared, workload_number, PlannerEvent::Failed { id, reason, busy_s });
                }
                _ => shared.step(Event::ProbeLost { workload_number, id, reason }),
            }
        }
    }
}

/// Has the costs of a chosen representation measured on a node of each device.
pub(crate) async fn represent(shared: Arc<Shared>, workload_number: u64, choice: u64, measurement: MeasureCosts) {
    // Nobody reads how the measuring goes on.
    let (events, _progress) = mpsc::channel(1);
    match known_or_measured(&shared, &measurement, &events).await {
        Ok(measured) => {
            let costs = measured.costs;
            let planes = measured.planes;
            shared.step(Event::Represented { workload_number, choice, costs, planes });
        }
        Err(status) => {
            let reason = shortened_reason(status.message());
            shared.step(Event::Unrepresented { workload_number, choice, reason });
        }
    }
}

fn planned(shared: &Shared, workload_number: u64, event: PlannerEvent) {
    shared.step(Event::Planned { workload_number, event: Box::new(event) });
}

async fn probed(shared: &Shared, probe: ViewProbe) -> Result<PlannerEvent, Status> {
    let ViewProbe { id, address, views, requests, repeats, .. } = probe;
    let node = NodeClient::new(shared.connections.to(&address).await?);
    let mut answers = vec![Vec::with_capacity(repeats); requests.len()];
    for _ in 0..repeats {
        for ((_, request), answers) in requests.iter().zip(&mut answers) {
            answers.push(ask(&node, request, &address).await?);
        }
    }
    let busy_s = answers.iter().flatten().map(|answer| answer.busy_s).sum();
    if views.is_empty() {
        let rows = requests.iter().zip(&answers).map(|((row, _), answers)| {
            let costs: Vec<RowCosts> = answers.iter().map(row_costs).collect();
            (*row, median_costs(&costs))
        });
        return Ok(check(id, PlannerEvent::Timed(Timed { id, rows: rows.collect(), busy_s })));
    }
    let (Some((row, _)), Some([answer])) = (requests.first(), answers.first().map(Vec::as_slice)) else {
        return Err(Status::out_of_range("a comparison is of one row"));
    };
    let views = views.into_iter().zip(answer.views.iter().copied()).collect();
    let probed = Probed { id, row: *row, views, costs: row_costs(answer), busy_s };
    Ok(check(id, PlannerEvent::Probed(probed)))
}

async fn ask(node: &NodeClient, request: &MeasureCosts, address: &str) -> Result<Measured, Status> {
    let answer = within(PROBED_WITHIN, "measuring views", node.measure_costs(request.clone())).await;
    let answer = answer.map_err(|status| of_node(address, &status))?;
    let is_compared = request.budget.as_ref().is_some_and(|budget| budget.compared_lighting.is_some());
    let wanted = if is_compared { request.typical_views.len() } else { 0 };
    match answer.views.len() {
        count if count == wanted => Ok(answer),
        count => Err(Status::out_of_range(format!("{address} has compared {count} views, not {wanted}"))),
    }
}

/// An answer that no planner takes is a failure.
fn check(id: ProbeId, event: PlannerEvent) -> PlannerEvent {
    match event.validate() {
        Ok(()) => event,
        Err(error) => PlannerEvent::Failed { id, reason: shortened_reason(&error.to_string()), busy_s: 0.0 },
    }
}

fn row_costs(answer: &Measured) -> RowCosts {
    let costs = &answer.costs;
    RowCosts {
        sample_image_s: costs.sample_image_s,
        load_set_s: costs.load_set_s,
        reconstruct_view_s: costs.reconstruct_view_s,
    }
}
