//! Session opening: the costs of a requested session are measured.

use std::sync::Arc;

use cluster::{MeasureCosts, Measured, SessionRequest, SessionStage, Workload};
use depth_image::{ToneMapping, ViewPlanes};
use tonic::Status;

use crate::grpc_status::refusal;
use crate::measuring::{known, measured_on_present_nodes, send_progress};
use crate::schedule::{Event, MEASURED_BATCH, Opening, PolicyOverride};
use crate::session_budget::budgeted;
use crate::sessions::EventSender;
use crate::shared::Shared;
use crate::workload::workload_of;

/// Measures the costs of a session, and hands it to the schedule; its plans come through `events`, as do refusals.
pub(crate) async fn open(shared: Arc<Shared>, session: u64, request: SessionRequest, events: EventSender) {
    let opened = tokio::select! {
        opened = measured_opening(&shared, session, request, &events) => opened,
        () = events.closed() => return,
    };
    match opened {
        Ok(opening) => {
            send_progress(&events, SessionStage::Planning, "choosing samplers and compositors".to_owned());
            shared.step(Event::Opened(Box::new(opening)));
            // A client that left before the schedule had heard of its session.
            if events.is_closed() {
                shared.step(Event::Closed { session });
            }
        }
        Err(status) => shared.sessions.refuse(session, status),
    }
}

async fn measured_opening(
    shared: &Arc<Shared>,
    session: u64,
    request: SessionRequest,
    events: &EventSender,
) -> Result<Opening, Status> {
    let offer = shared.offers.find(request.scene.as_deref())?;
    let workload = workload_of(&request, offer)?;
    let budgeted = budgeted(&request, &workload, offer, &shared.config)?;
    let measurement = MeasureCosts {
        // Costs are those of one image, and of one view, which is made from the images of one view cell.
        workload: workload.of_one_view(),
        method: request.method.clone(),
        codec: request.codec.clone(),
        typical_views: vec![request.typical_view],
        batch_count: request.views_per_set.min(MEASURED_BATCH),
        // Every tone costs the same.
        planes: ViewPlanes { tone: ToneMapping::NONE, ..request.planes },
        in_background: false,
    };
    let admits = || {
        let follows_viewers = !request.viewpoints.is_empty() && !workload.samples_cube();
        let admitted =
            shared.with_scheduler(|scheduler| scheduler.admits_workload(&workload, budgeted.as_ref(), follows_viewers));
        admitted.map_err(|error| refusal(&error))
    };
    let Measured { costs, planes, auto_exposure, traced_pixel_count } =
        costs_of(shared, measurement, events, admits).await?;
    // A cube serves views from anywhere: there are no cells to follow viewers.
    let viewpoints = if workload.samples_cube() { Vec::new() } else { request.viewpoints };
    Ok(Opening {
        session,
        workload: Workload { planes, traced_pixel_count, ..workload },
        method: request.method,
        views_per_set: request.views_per_set as usize,
        frames_per_s: request.frames_per_s,
        policy_override: PolicyOverride {
            policy: request.policy,
            forced_samplers: request.forced_sampler_count.map(|count| count as usize),
            forced_tiles: request.forced_tile_count.map(|count| count as usize),
        },
        // A promise holds for all views: there is no lower quality.
        fallbacks: if budgeted.is_some() { Vec::new() } else { request.fallbacks },
        costs,
        auto_exposure,
        viewpoints,
        budgeted,
    })
}

/// Known costs; else they are measured, one session at a time. A session that would not be admitted is not measured for.
/// A measurement that was begun ends, and its costs are kept, though its client may leave meanwhile.
async fn costs_of(
    shared: &Arc<Shared>,
    measurement: MeasureCosts,
    events: &EventSender,
    admits: impl Fn() -> Result<(), Status>,
) -> Result<Measured, Status> {
    admits()?;
    if let Some(known) = known(shared, &measurement) {
        return Ok(known);
    }
    let one = shared.measuring.clone().lock_owned().await;
    // Others have opened their workloads meanwhile, or measured the same.
    admits()?;
    let (shared, events) = (shared.clone(), events.clone());
    let measuring = tokio::spawn(async move {
        let _one = one;
        match known(&shared, &measurement) {
            Some(known) => Ok(known),
            None => measured_on_present_nodes(&shared, &measurement, &events).await,
        }
    });
    measuring.await.map_err(|error| Status::internal(format!("measuring failed: {error}")))?
}
