//! The scenes on offer that were visited, each with the sessions that its visitors share.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::http::StatusCode;
use client::{Client, ClientError};
use cluster::{ClusterStatus, OfferStatus, SessionRequest, Timeline};
use depth_image::LightCacheQuality;
use glam::UVec2;
use parking_lot::Mutex;

use crate::camera::{PageCamera, ViewSpace};
use crate::config::GatewayConfig;
use crate::kept_session::{FIRST_DELAY, KeptSession, LONGEST_DELAY};
use crate::responses::Refusal;

/// The size of pictures in motion that costs are measured on.
pub(crate) const TYPICAL_PX: UVec2 = UVec2::new(640, 360);

/// Moments of a scene that moves.
const MOMENTS_PER_S: f64 = 12.0;
const MAX_MOMENTS: f64 = 120.0;

/// A status is told for this time.
const STATUS_FOR: Duration = Duration::from_millis(500);

/// All scenes that were visited.
pub(crate) struct Scenes {
    config: GatewayConfig,
    known: Mutex<Known>,
    /// Whoever asks for it within a moment is told the same.
    status: tokio::sync::Mutex<Option<(Instant, Arc<ClusterStatus>)>>,
}

#[derive(Default)]
struct Known {
    /// The names on offer, in their order.
    names: Vec<String>,
    scenes: BTreeMap<String, Arc<SceneSessions>>,
}

/// A scene, and its sessions.
pub(crate) struct SceneSessions {
    pub(crate) offer: OfferStatus,
    pub(crate) space: ViewSpace,
    pub(crate) home: PageCamera,
    /// Views for visitors.
    pub(crate) shown: KeptSession,
    /// Views of a scene that moves, for visitors who see it move. At rest, many views share a sample set.
    pub(crate) moving: Option<KeptSession>,
    /// The quality of shared light in stills for which no other is asked.
    pub(crate) quality: LightCacheQuality,
}

impl Scenes {
    pub(crate) fn new(config: GatewayConfig) -> Self {
        Self { config, known: Mutex::default(), status: tokio::sync::Mutex::default() }
    }

    /// The cluster's status. Requests that wait for it share one.
    pub(crate) async fn status(&self) -> Result<Arc<ClusterStatus>, ClientError> {
        let mut last = self.status.lock().await;
        if let Some((_, status)) = last.as_ref().filter(|(at, _)| at.elapsed() < STATUS_FOR) {
            return Ok(status.clone());
        }
        let status = Arc::new(Client::connect(&self.config.coordinator).await?.status().await?);
        *last = Some((Instant::now(), status.clone()));
        Ok(status)
    }

    /// The names of the scenes on offer, as last heard of.
    pub(crate) fn names(&self) -> Vec<String> {
        self.known.lock().names.clone()
    }

    /// A scene by its name; the first on offer where there is none. A name that is not on offer is refused as not found.
    pub(crate) async fn visit(&self, name: Option<&str>) -> Result<Arc<SceneSessions>, Refusal> {
        // A scene whose session is not open may be on offer no more.
        if let Some(scene) = self.find(name).filter(|scene| scene.shown.state.borrow().is_ok()) {
            return Ok(scene);
        }
        self.add(name, false).await
    }

    async fn add(&self, name: Option<&str>, at_once: bool) -> Result<Arc<SceneSessions>, Refusal> {
        let status = self.status().await;
        let offers =
            &status.map_err(|error| Refusal::unserved(format!("the coordinator does not answer: {error}")))?.offers;
        let names: Vec<String> = offers.iter().map(|offer| offer.name.clone()).collect();
        let offered = names.join(", ");
        self.known.lock().names = names;
        let offer = offers.iter().find(|offer| name.is_none_or(|name| name == offer.name)).ok_or_else(|| {
            let name = name.unwrap_or("(the first)");
            Refusal(StatusCode::NOT_FOUND, format!("scene {name:?} is not on offer: {offered}"))
        })?;
        let mut known = self.known.lock();
        if let Some(scene) = known.scenes.get(&offer.name).filter(|scene| scene.offer == *offer) {
            return Ok(scene.clone());
        }
        let scene = SceneSessions::start(offer.clone(), &self.config, at_once);
        let scene = Arc::new(scene.map_err(|error| Refusal::unserved(format!("the scene cannot be viewed: {error}")))?);
        known.scenes.insert(offer.name.clone(), scene.clone());
        Ok(scene)
    }

    fn find(&self, name: Option<&str>) -> Option<Arc<SceneSessions>> {
        let known = self.known.lock();
        let name = name.or(known.names.first().map(String::as_str))?;
        known.scenes.get(name).cloned()
    }

    /// Opens the first scene's session as soon as the coordinator answers.
    pub(crate) async fn prepare(&self) {
        let mut delay = FIRST_DELAY;
        while let Err(error) = self.add(None, true).await {
            tracing::debug!(error = error.1, "no scene yet");
            tokio::time::sleep(delay).await;
            delay = (delay * 2).min(LONGEST_DELAY);
        }
    }
}

impl SceneSessions {
    fn start(offer: OfferStatus, config: &GatewayConfig, at_once: bool) -> Result<Self, String> {
        let space = ViewSpace::of(&offer);
        let home = space.home(&offer);
        let shown = (config.request_of)(&offer, space.camera(&home, TYPICAL_PX)?);
        let moving = offer.period_s.map(|period_s| moving(shown.clone(), period_s));
        let offered = offer.settings.method.as_deref().and_then(config.methods.quality_of);
        let quality = config.quality.or(offered).unwrap_or(LightCacheQuality::Fine);
        Ok(Self {
            shown: KeptSession::start(&config.coordinator, shown, at_once),
            moving: moving.map(|request| KeptSession::start(&config.coordinator, request, false)),
            offer,
            space,
            home,
            quality,
        })
    }

    /// The timeline of a scene that moves, or of one moment.
    pub(crate) fn timeline(&self) -> Timeline {
        self.moving.as_ref().map_or(Timeline::still(0.0), |moving| moving.timeline)
    }

    /// The session that shows a moment of the scene: the first is that of the scene at rest.
    pub(crate) fn session_of(&self, moment: u32) -> &KeptSession {
        self.moving.as_ref().filter(|_| moment > 0).unwrap_or(&self.shown)
    }
}

/// The same views of a scene that moves, over its period. Its light is finished at once.
fn moving(request: SessionRequest, period_s: f64) -> SessionRequest {
    let moments = (period_s * MOMENTS_PER_S).round().clamp(2.0, MAX_MOMENTS);
    let timeline = Timeline { start_s: 0.0, step_s: period_s / moments, set_count: moments as u32 };
    SessionRequest { timeline, refinement_steps: 1, ..request }
}
