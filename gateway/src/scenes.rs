//! The scenes on offer that were visited, each with the sessions that its visitors share.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use client::{Client, ClientError};
use cluster::{ClusterStatus, OfferStatus, SessionRequest, Timeline};
use depth_image::LightCacheQuality;
use glam::UVec2;
use parking_lot::Mutex;

use crate::camera::{BadView, PageCamera, ViewSpace};
use crate::config::GatewayConfig;
use crate::kept_session::{FIRST_DELAY, FirstOpened, KeptSession, LONGEST_DELAY};

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

/// Why a scene cannot be visited.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SceneError {
    /// No scene has the name.
    #[error("scene {name:?} is not on offer: {offered}")]
    Unknown {
        /// As asked for.
        name: String,
        /// All names.
        offered: String,
    },
    /// The coordinator does not answer.
    #[error("the coordinator does not answer: {0}")]
    Away(#[from] ClientError),
    /// The scene on offer has no camera in front of it.
    #[error("the scene cannot be viewed: {0}")]
    Invalid(#[from] BadView),
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

    /// A scene by its name; the first on offer where there is none.
    pub(crate) async fn visit(&self, name: Option<&str>) -> Result<Arc<SceneSessions>, SceneError> {
        // A scene whose session is not open may be on offer no more.
        if let Some(scene) = self.find(name).filter(|scene| scene.shown.is_open()) {
            return Ok(scene);
        }
        self.add(name, FirstOpened::AtVisit).await
    }

    async fn add(&self, name: Option<&str>, first: FirstOpened) -> Result<Arc<SceneSessions>, SceneError> {
        let offers = &self.status().await?.offers;
        let names: Vec<String> = offers.iter().map(|offer| offer.name.clone()).collect();
        let offered = names.join(", ");
        self.known.lock().names = names;
        let offer = offers
            .iter()
            .find(|offer| name.is_none_or(|name| name == offer.name))
            .ok_or_else(|| SceneError::Unknown { name: name.unwrap_or("(the first)").to_owned(), offered })?;
        let mut known = self.known.lock();
        if let Some(scene) = known.scenes.get(&offer.name).filter(|scene| scene.offer == *offer) {
            return Ok(scene.clone());
        }
        let scene = Arc::new(SceneSessions::start(offer.clone(), &self.config, first)?);
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
        while let Err(error) = self.add(None, FirstOpened::AtOnce).await {
            tracing::debug!(%error, "no scene yet");
            tokio::time::sleep(delay).await;
            delay = (delay * 2).min(LONGEST_DELAY);
        }
    }
}

impl SceneSessions {
    fn start(offer: OfferStatus, config: &GatewayConfig, first: FirstOpened) -> Result<Self, BadView> {
        let space = ViewSpace::of(&offer);
        let home = space.home(&offer);
        let shown = (config.request_of)(&offer, space.camera(&home, TYPICAL_PX)?);
        let moving = offer.period_s.map(|period_s| moving(shown.clone(), period_s));
        let offered = offer.settings.method.as_deref().and_then(config.methods.quality_of);
        let quality = config.quality.or(offered).unwrap_or(LightCacheQuality::Fine);
        Ok(Self {
            shown: KeptSession::start(&config.coordinator, shown, first),
            moving: moving.map(|request| KeptSession::start(&config.coordinator, request, FirstOpened::AtVisit)),
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
