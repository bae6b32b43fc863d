//! Deliveries of views from new sample sets, by the cluster of an experiment.

use std::sync::atomic::{AtomicU32, Ordering};

use app_core::delivery::request;
use app_core::experiment::{Delivered, Experiment};
use client::Frame;
use cluster::{PolicyChoice, SessionRequest, Timeline};
use reconstruction::ReconstructionMethod;
use render::{Choice, Lighting};

/// Scene time between runs: far less than any motion, but a new sample set, which no node has kept.
const RUN_STEP_S: f64 = 1e-4;

/// The number of deliveries of this process.
static RUNS: AtomicU32 = AtomicU32::new(0);

/// Settings of one delivery.
#[derive(Debug, Clone, Copy)]
pub struct DeliverySettings {
    /// How surfaces are lit.
    pub lighting: Lighting,
    /// Whether views are reconstructed or drawn directly.
    pub policy: PolicyChoice,
    /// How views are reconstructed.
    pub method: ReconstructionMethod,
    /// The number of views a set.
    pub views: usize,
    /// Sample sets of one moment, each with all views.
    pub sets: u32,
}

impl DeliverySettings {
    /// Settings for `views` of one set, with everything else from the scene's arguments.
    pub fn new(experiment: &Experiment, policy: PolicyChoice, views: usize) -> Self {
        let args = &experiment.args;
        Self { lighting: args.lighting, policy, method: args.method(), views, sets: 1 }
    }
}

/// Delivers views of a new sample set. The time excludes the coordinator's measurements.
///
/// # Errors
/// The cluster fails.
pub fn deliver(
    experiment: &Experiment,
    settings: DeliverySettings,
    arrived: impl FnMut(Frame),
) -> anyhow::Result<Delivered> {
    let run = RUNS.fetch_add(1, Ordering::Relaxed);
    let views = experiment.views(settings.views)?;
    let request = SessionRequest {
        method: settings.method.to_string(),
        lighting: settings.lighting.to_string(),
        timeline: Timeline { set_count: settings.sets, ..Timeline::still(f64::from(run) * RUN_STEP_S) },
        ..request(experiment.setup.offer.settings.clone(), settings.policy, &views)?
    };
    experiment.receive(request, &views, arrived)
}

/// The renderer's choice between triangles and rays for views of an experiment.
///
/// # Errors
/// The scene has left the device.
pub fn visibility(experiment: &Experiment) -> anyhow::Result<Choice> {
    let view = experiment.views(1)?;
    let scene = experiment.engine.scene(experiment.setup.offer.hash.as_str())?;
    Ok(experiment.engine.renderer.choice(&scene, &view[0], 0.0)?)
}
