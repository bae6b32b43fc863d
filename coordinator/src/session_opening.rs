//! Session opening: the costs of a requested session are measured.

use std::sync::Arc;

use cluster::{Costs, MeasureCosts, Measured, SessionRequest, SessionStage, SharedLightCosts, Workload};
use depth_image::{ToneMapping, ViewPlanes};
use tonic::Status;

use crate::config::SceneOffer;
use crate::light_samples::{LightSamples, SetDemand};
use crate::measuring::{known, known_or_measured, send_progress};
use crate::schedule::{Budgeted, Event, Opening, PolicyOverride};
use crate::session_budget::budgeted;
use crate::sessions::EventSender;
use crate::shared::Shared;
use crate::workload::{chooses_light_samples, workload_of};

/// Views of one measured call: as in a batch of real work, since fewer views cost more each. A slow device must not take minutes.
const MEASURED_BATCH: u32 = 32;

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
    let full = workload_of(&request, offer, LightSamples::FULL)?;
    let budgeted = budgeted(&request, &full, offer, &shared.config)?;
    let is_free = chooses_light_samples(&request, offer) && budgeted.is_none();
    let all = if is_free { LightSamples::all(&request) } else { Vec::new() };
    let open = open_samples(shared, &request, offer, &all);
    let admitted = workload_of(&request, offer, open.unwrap_or(LightSamples::FULL))?;
    let measured = measured_workload(shared, &request, &full, &admitted, budgeted.as_ref(), events).await?;
    let demand = SetDemand::of(&request, shared.status().nodes.len());
    let cameras = full.of_one_view().view_camera_count();
    // Others have opened their workloads meanwhile.
    let samples = open_samples(shared, &request, offer, &all);
    let samples = samples.unwrap_or_else(|| LightSamples::cheapest(&all, &measured, cameras, demand));
    let workload = workload_of(&request, offer, samples)?;
    let measured = samples.predicted(&measured, cameras);
    let Measured { costs, planes, auto_exposure, traced_pixel_count, shared_light, .. } = measured;
    let note = samples.in_words(demand);
    let last_view_time_ratio = last_view_time_ratio(&request, &costs, shared_light.as_ref());
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
        last_view_time_ratio,
        shared_light,
        note,
    })
}

/// The samples of an open workload that a session can share: another set would cost more than its own best samples save.
fn open_samples(
    shared: &Shared,
    request: &SessionRequest,
    offer: &SceneOffer,
    all: &[LightSamples],
) -> Option<LightSamples> {
    let follows_viewers = !request.viewpoints.is_empty();
    let mut all = all.iter().copied();
    all.find(|&samples| {
        let workload = workload_of(request, offer, samples);
        workload.is_ok_and(|workload| shared.with_scheduler(|s| s.has_workload(&workload, follows_viewers)))
    })
}

/// The costs of a workload, once the one that is to be opened is admitted: known ones, else they are measured, one session at
/// a time. A session that would not be admitted is not measured for. A measurement that was begun ends, and its costs are
/// kept, though its client may leave meanwhile.
async fn measured_workload(
    shared: &Arc<Shared>,
    request: &SessionRequest,
    workload: &Workload,
    admitted: &Workload,
    budgeted: Option<&Budgeted>,
    events: &EventSender,
) -> Result<Measured, Status> {
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
        budget: None,
    };
    let follows_viewers = !request.viewpoints.is_empty() && !workload.samples_cube();
    let admits = || shared.with_scheduler(|scheduler| scheduler.admits_workload(admitted, budgeted, follows_viewers));
    admits()?;
    if let Some(known) = known(shared, &measurement) {
        return Ok(known);
    }
    let one = shared.measuring.clone().lock_owned().await;
    // Others have opened their workloads meanwhile, or measured the same.
    admits()?;
    let shared = shared.clone();
    let events = events.clone();
    let measuring = tokio::spawn(async move {
        let _one = one;
        known_or_measured(&shared, &measurement, &events).await
    });
    measuring.await.map_err(|error| Status::internal(format!("measuring failed: {error}")))?
}

/// The time of a view at the last fallback over that of one as it is asked for: light has the lowest quality there. 1 where the parts
/// of a view are not known.
fn last_view_time_ratio(request: &SessionRequest, costs: &Costs, light: Option<&SharedLightCosts>) -> f64 {
    let has_coarser = request.fallbacks.iter().any(|fallback| fallback.method != request.method);
    let Some(light) = light.filter(|_| has_coarser) else { return 1.0 };
    let ratio = (light.surfaces_s + light.look_up_s) / costs.reconstruct_view_s;
    if ratio > 0.0 { ratio.min(1.0) } else { 1.0 }
}
