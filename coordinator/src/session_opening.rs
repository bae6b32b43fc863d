//! Session opening: the costs of a requested session are measured.

use std::sync::Arc;

use cluster::{MeasureCosts, Measured, SessionRequest, SessionStage, SharedLightCosts, Workload};
use depth_image::{ToneMapping, ViewPlanes};
use tonic::Status;

use crate::grpc_status::refusal;
use crate::measuring::{known, measured_on_present_nodes, send_progress};
use crate::schedule::{Budgeted, Event, MEASURED_BATCH, Opening, PolicyOverride};
use crate::session_budget::budgeted;
use crate::sessions::EventSender;
use crate::shared::Shared;
use crate::workload::{LIGHT_DENSITIES, chooses_light_density, workload_of};

/// The longest time of a device for a set of light in full density.
const LONGEST_LIGHT_SET_S: f64 = 10.0;

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
    let mut densities = LIGHT_DENSITIES.into_iter();
    let mut finest_set_s = None;
    let (workload, budgeted, measured) = loop {
        let density = densities.next().unwrap_or(1.0);
        let workload = workload_of(&request, offer, density)?;
        let budgeted = budgeted(&request, &workload, offer, &shared.config)?;
        let measured = measured_workload(shared, &request, &workload, budgeted.as_ref(), events).await?;
        let set_s = measured.costs.sample_image_s * workload.of_one_view().view_camera_count() as f64;
        if set_s <= LONGEST_LIGHT_SET_S || densities.len() == 0 || !chooses_light_density(&request, offer) {
            break (workload, budgeted, measured);
        }
        finest_set_s.get_or_insert(set_s);
    };
    let Measured { costs, planes, auto_exposure, traced_pixel_count, shared_light } = measured;
    let density = LIGHT_DENSITIES[LIGHT_DENSITIES.len() - 1 - densities.len()];
    let note =
        shared_light.map_or_else(String::new, |light| light_note(&request.method, &light, density, finest_set_s));
    let has_coarser = request.fallbacks.iter().any(|fallback| fallback.method != request.method);
    let coarsest_s = shared_light.filter(|_| has_coarser).map(|light| light.surfaces_s + light.look_up_s);
    let last_view_time_ratio = coarsest_s.map_or(1.0, |seconds| seconds / costs.reconstruct_view_s);
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
        last_view_time_ratio: if last_view_time_ratio > 0.0 { last_view_time_ratio.min(1.0) } else { 1.0 },
        note,
    })
}

/// The costs of a workload, once it is admitted.
async fn measured_workload(
    shared: &Arc<Shared>,
    request: &SessionRequest,
    workload: &Workload,
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
    };
    let admits = || {
        let follows_viewers = !request.viewpoints.is_empty() && !workload.samples_cube();
        let admitted =
            shared.with_scheduler(|scheduler| scheduler.admits_workload(workload, budgeted, follows_viewers));
        admitted.map_err(|error| refusal(&error))
    };
    costs_of(shared, measurement, events, admits).await
}

/// What the reason of a plan says of light that views share.
fn light_note(method: &str, light: &SharedLightCosts, density: f32, finest_set_s: Option<f64>) -> String {
    let ms = |seconds: f64| format!("{:.0} ms", seconds * 1e3);
    let of_density = finest_set_s.map_or_else(String::new, |set_s| {
        format!(" Samples have {density} times the density of views: in full density a set would take {set_s:.0} s.")
    });
    format!(
        " By {method}, samples know the light of {:.0} % of a view's points; surfaces take {}, the look-up {}, and the other \
         points {}.{of_density}",
        light.known_ratio * 100.0,
        ms(light.surfaces_s),
        ms(light.look_up_s),
        ms(light.unknown_s),
    )
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
