//! Views asked of a cluster as any client asks, and the time until all have arrived.

use std::time::Instant;

use client::{Client, Frame, Session, ViewRequest};
use cluster::limits::MAX_VIEWPOINTS;
use cluster::{OfferSettings, OfferStatus, PolicyChoice, Quality, SessionPlan, SessionRequest, Timeline};
use depth_image::{PinholeCamera, ViewPlanes};
use reconstruction::ReconstructionMethod;
use render::Lighting;
use sampling::SamplingMethod;

use crate::exit::BadInput;
use crate::fallbacks;

/// Settings of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionSettings {
    /// The reconstruction method, named as on the command line.
    pub method: String,
    /// The sampling method, named as on the command line.
    pub sampling: String,
    /// The lighting, named as on the command line.
    pub lighting: String,
    /// The codec of frames, named as on the command line.
    pub codec: String,
    /// The policy, or the coordinator's choice.
    pub policy: PolicyChoice,
    /// Planes beside colour.
    pub planes: ViewPlanes,
    /// Tiles of a sample image; `None` for as many as are predicted to be fastest.
    pub tiles: Option<u32>,
    /// Steps in which the light of a static scene is refined; 1 for all of it at once.
    pub refinement_steps: u32,
    /// Pictures a second; `None` for as many as possible.
    pub frames_per_s: Option<f64>,
    /// Fallbacks under overload.
    pub fallbacks: Vec<Quality>,
    /// Scene times; every set has the same views.
    pub timeline: Timeline,
    /// Viewpoints that sample cameras are placed around; empty for the cameras of the scene.
    pub viewpoints: Vec<PinholeCamera>,
}

impl SessionSettings {
    /// Finished pictures of a still scene, without other planes, by the policy that is predicted to be fastest.
    #[must_use]
    pub fn new(method: String, sampling: String, lighting: String) -> Self {
        Self {
            method,
            sampling,
            lighting,
            codec: "lz4".to_owned(),
            policy: PolicyChoice::Auto,
            planes: ViewPlanes::default(),
            tiles: None,
            refinement_steps: 1,
            frames_per_s: None,
            fallbacks: Vec::new(),
            timeline: Timeline::still(0.0),
            viewpoints: Vec::new(),
        }
    }

    /// The same, with the settings that the coordinator offers.
    #[must_use]
    pub fn offered(offer: &OfferStatus) -> Self {
        let or = |offered: &Option<String>, default: String| offered.clone().unwrap_or(default);
        let OfferSettings { method, sampling, lighting } = &offer.settings;
        Self::new(
            or(method, ReconstructionMethod::default().to_string()),
            or(sampling, SamplingMethod::default().to_string()),
            or(lighting, Lighting::default().to_string()),
        )
    }

    /// The same at a rate, with fallbacks under overload.
    #[must_use]
    pub fn at_rate(self, frames_per_s: f64) -> Self {
        Self { frames_per_s: Some(frames_per_s), fallbacks: fallbacks::ladder(&self.lighting, &self.method), ..self }
    }
}

/// Delivered views.
#[derive(Debug)]
pub struct Delivered {
    /// The coordinator's plan, and the costs that it measured.
    pub plan: SessionPlan,
    /// Seconds from the request to the last frame, decoded and checksummed.
    pub seconds: f64,
    /// Frames by number: set by set, and view by view in each.
    pub frames: Vec<Frame>,
}

/// Opens a session for `views` a set.
///
/// # Errors
/// The coordinator refuses, or there are no views.
pub async fn open(client: &Client, settings: &SessionSettings, views: &[PinholeCamera]) -> anyhow::Result<Session> {
    let typical_view = *views.first().ok_or_else(|| BadInput("no views are asked for".to_owned()))?;
    let request = SessionRequest {
        scene: None,
        method: settings.method.clone(),
        sampling: settings.sampling.clone(),
        lighting: settings.lighting.clone(),
        codec: settings.codec.clone(),
        sample_cameras: Vec::new(),
        sample_size_px: None,
        volume: None,
        typical_view,
        views_per_set: u32::try_from(views.len())?,
        planes: settings.planes,
        timeline: settings.timeline,
        policy: settings.policy,
        forced_sampler_count: None,
        refinement_steps: settings.refinement_steps,
        frames_per_s: settings.frames_per_s,
        fallbacks: settings.fallbacks.clone(),
        forced_tile_count: settings.tiles,
        viewpoints: settings.viewpoints.clone(),
    };
    let told = |event: &_| tracing::info!(?event, "session");
    Ok(client.open_session(request, told).await?)
}

/// The views evenly thinned to as many as a session may name.
#[must_use]
pub fn viewpoints(views: &[PinholeCamera]) -> Vec<PinholeCamera> {
    views.iter().step_by(views.len().div_ceil(MAX_VIEWPOINTS).max(1)).copied().collect()
}

/// Asks for all views of all sets and waits for them; `arrived` is called for each.
///
/// # Errors
/// The cluster fails, or frames are missing.
pub async fn receive(
    session: &Session,
    views: &[PinholeCamera],
    mut arrived: impl FnMut(&Frame),
) -> anyhow::Result<Delivered> {
    let start = Instant::now();
    let sets = session.plan().assignment.workload.timeline.set_count;
    let request =
        |(frame, (set_index, camera)): (u64, (u32, &PinholeCamera))| ViewRequest { frame, set_index, camera: *camera };
    let all = (0..sets).flat_map(|set| views.iter().map(move |camera| (set, camera)));
    let mut incoming = session.render_views((0..).zip(all).map(request).collect())?;
    let mut frames = Vec::with_capacity(views.len() * sets as usize);
    while let Some(frame) = incoming.next().await {
        let frame = frame?;
        arrived(&frame);
        frames.push(frame);
    }
    let seconds = start.elapsed().as_secs_f64();
    frames.sort_by_key(|frame| frame.request.frame);
    Ok(Delivered { plan: session.plan(), seconds, frames })
}
