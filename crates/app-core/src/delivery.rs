//! Views asked of a cluster as any client asks, and the time until they are all here.

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

/// How views shall come about.
#[derive(Debug, Clone, PartialEq)]
pub struct Wishes {
    /// Named as on the command line.
    pub method: String,
    /// Named as on the command line.
    pub sampling: String,
    /// Named as on the command line.
    pub lighting: String,
    /// Named as on the command line.
    pub codec: String,
    /// Who decides between pipeline and direct.
    pub policy: PolicyChoice,
    /// Planes beside colour.
    pub planes: ViewPlanes,
    /// Tiles of a sample image; `None`: as many as are predicted to be fastest.
    pub tiles: Option<u32>,
    /// Steps in which the light of a static scene grows; 1 for all of it at once.
    pub refinement_steps: u32,
    /// Pictures a second; `None`: as fast as they come.
    pub frames_per_s: Option<f64>,
    /// What the session makes do with under overload.
    pub fallbacks: Vec<Quality>,
    /// Scene times; every set has the same views.
    pub timeline: Timeline,
    /// From where it looks: sample cameras stand around them, in place of those that the scene came with. None: those.
    pub viewpoints: Vec<PinholeCamera>,
}

impl Wishes {
    /// Finished pictures of a still scene, without other planes, by whatever is predicted to be fastest.
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

    /// The same, as the coordinator offers its scene.
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

    /// So many pictures a second, or fewer under overload, after all else that can be given up.
    #[must_use]
    pub fn at_rate(self, frames_per_s: f64) -> Self {
        Self { frames_per_s: Some(frames_per_s), fallbacks: fallbacks::ladder(&self.lighting, &self.method), ..self }
    }
}

/// Views that came.
#[derive(Debug)]
pub struct Delivered {
    /// What the coordinator decided, and the costs that it measured.
    pub plan: SessionPlan,
    /// From the request to the last frame, decoded and checksummed.
    pub seconds: f64,
    /// In the order of their numbers: set by set, in each the views in their order.
    pub frames: Vec<Frame>,
}

/// Opens a session for `views` a set.
///
/// # Errors
/// The coordinator's, or no views.
pub async fn open(client: &Client, wishes: &Wishes, views: &[PinholeCamera]) -> anyhow::Result<Session> {
    let typical_view = *views.first().ok_or_else(|| BadInput("no views are asked for".to_owned()))?;
    let request = SessionRequest {
        scene: None,
        method: wishes.method.clone(),
        sampling: wishes.sampling.clone(),
        lighting: wishes.lighting.clone(),
        codec: wishes.codec.clone(),
        sample_cameras: Vec::new(),
        sample_size_px: None,
        volume: None,
        typical_view,
        views_per_set: u32::try_from(views.len())?,
        planes: wishes.planes,
        timeline: wishes.timeline,
        policy: wishes.policy,
        forced_sampler_count: None,
        refinement_steps: wishes.refinement_steps,
        frames_per_s: wishes.frames_per_s,
        fallbacks: wishes.fallbacks.clone(),
        forced_tile_count: wishes.tiles,
        viewpoints: wishes.viewpoints.clone(),
    };
    let told = |event: &_| tracing::info!(?event, "session");
    Ok(client.open_session(request, told).await?)
}

/// As many of the views as a session may name, evenly.
#[must_use]
pub fn viewpoints(views: &[PinholeCamera]) -> Vec<PinholeCamera> {
    views.iter().step_by(views.len().div_ceil(MAX_VIEWPOINTS).max(1)).copied().collect()
}

/// Asks for all views of all sets and waits for them; `arrived` hears of each.
///
/// # Errors
/// The cluster's, or frames that are missing.
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
