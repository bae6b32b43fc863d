//! One session for all visitors of a scene. It is opened before anybody comes where the scene is the first on offer, and at
//! its first visitor otherwise, and opened again when it fails.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use client::{Client, ClientError, Session};
use cluster::{OfferStatus, SessionEvent, SessionStage};
use glam::UVec2;
use parking_lot::Mutex;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;

use crate::camera::{PageCamera, ViewSpace};
use crate::config::{GatewayConfig, RequestOf};
use crate::visits::Visits;

/// The size of pictures in motion that costs are measured on.
const TYPICAL_PX: UVec2 = UVec2::new(640, 360);
/// The delays between attempts to reach the coordinator.
const FIRST_DELAY: Duration = Duration::from_millis(250);
const LONGEST_DELAY: Duration = Duration::from_secs(4);
/// The interval at which the session's demand follows the visitors.
const FOLLOW: Duration = Duration::from_secs(1);

/// All scenes that were visited.
pub(crate) struct Scenes {
    config: GatewayConfig,
    known: Mutex<Known>,
}

#[derive(Default)]
struct Known {
    /// The names on offer, in their order.
    names: Vec<String>,
    scenes: BTreeMap<String, Arc<SceneSession>>,
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
}

/// What a scene's session is doing.
#[derive(Debug, Clone)]
pub(crate) enum SessionState {
    /// It is being opened.
    Waiting {
        /// As in [`crate::protocol::ToPage::Waiting`].
        stage: &'static str,
        /// A sentence.
        detail: String,
    },
    /// It is open.
    Open(Arc<Session>),
}

/// A scene, and its session.
pub(crate) struct SceneSession {
    pub(crate) offer: OfferStatus,
    pub(crate) space: ViewSpace,
    pub(crate) home: PageCamera,
    pub(crate) visits: Arc<Visits>,
    state: watch::Receiver<SessionState>,
    failures: mpsc::Sender<Arc<Session>>,
    /// Ends with the scene.
    _keeper: JoinSet<()>,
}

impl Scenes {
    pub(crate) fn new(config: GatewayConfig) -> Self {
        Self { config, known: Mutex::default() }
    }

    /// A client of the coordinator.
    pub(crate) async fn client(&self) -> Result<Client, ClientError> {
        Client::connect(&self.config.coordinator).await
    }

    /// The names of the scenes on offer, as last heard of.
    pub(crate) fn names(&self) -> Vec<String> {
        self.known.lock().names.clone()
    }

    /// A scene by its name; the first on offer where there is none.
    pub(crate) async fn visit(&self, name: Option<&str>) -> Result<Arc<SceneSession>, SceneError> {
        if let Some(scene) = self.find(name) {
            return Ok(scene);
        }
        let offers = self.client().await?.status().await?.offers;
        let names: Vec<String> = offers.iter().map(|offer| offer.name.clone()).collect();
        let offered = names.join(", ");
        self.known.lock().names = names;
        let is_wanted = |offer: &OfferStatus| name.is_none_or(|name| name == offer.name);
        let unknown = || SceneError::Unknown { name: name.unwrap_or("(the first)").to_owned(), offered };
        let offer = offers.into_iter().find(is_wanted).ok_or_else(unknown)?;
        let mut known = self.known.lock();
        let open = || Arc::new(SceneSession::open(offer.clone(), &self.config));
        Ok(known.scenes.entry(offer.name.clone()).or_insert_with(open).clone())
    }

    fn find(&self, name: Option<&str>) -> Option<Arc<SceneSession>> {
        let known = self.known.lock();
        let name = name.or(known.names.first().map(String::as_str))?;
        known.scenes.get(name).cloned()
    }

    /// Opens the first scene's session as soon as the coordinator answers.
    pub(crate) async fn prepare(&self) {
        let mut delay = FIRST_DELAY;
        while let Err(error) = self.visit(None).await {
            tracing::debug!(%error, "no scene yet");
            tokio::time::sleep(delay).await;
            delay = (delay * 2).min(LONGEST_DELAY);
        }
    }
}

impl SceneSession {
    fn open(offer: OfferStatus, config: &GatewayConfig) -> Self {
        let waiting = SessionState::Waiting { stage: "connecting", detail: "the gateway connects".to_owned() };
        let (changes, state) = watch::channel(waiting);
        let (failures, failed) = mpsc::channel(16);
        let (space, visits) = (ViewSpace::of(&offer), Arc::new(Visits::default()));
        let home = space.home(&offer);
        let mut keeper = JoinSet::new();
        keeper.spawn(
            Keeper {
                coordinator: config.coordinator.clone(),
                request_of: config.request_of.clone(),
                offer: offer.clone(),
                visits: visits.clone(),
                changes,
                failed,
            }
            .run(),
        );
        Self { offer, space, home, visits, state, failures, _keeper: keeper }
    }

    /// The session's states, the present one first.
    pub(crate) fn states(&self) -> watch::Receiver<SessionState> {
        let mut states = self.state.clone();
        states.mark_changed();
        states
    }

    /// Has a session opened again that delivers nothing any more.
    pub(crate) fn has_failed(&self, session: Arc<Session>) {
        // Where there is no room, others have told of it.
        let _ = self.failures.try_send(session);
    }
}

/// Keeps a scene's session open.
struct Keeper {
    coordinator: String,
    request_of: RequestOf,
    offer: OfferStatus,
    visits: Arc<Visits>,
    changes: watch::Sender<SessionState>,
    failed: mpsc::Receiver<Arc<Session>>,
}

impl Keeper {
    async fn run(mut self) {
        let mut delay = FIRST_DELAY;
        loop {
            match self.opened().await {
                Ok((session, rate)) => {
                    let opened_at = Instant::now();
                    let session = Arc::new(session);
                    self.changes.send_replace(SessionState::Open(session.clone()));
                    self.follow(&session, rate).await;
                    self.wait("reconnecting", "the session is opened again");
                    if opened_at.elapsed() > LONGEST_DELAY {
                        delay = FIRST_DELAY;
                    }
                }
                Err(error) => {
                    tracing::warn!(scene = self.offer.name, %error, "no session");
                    self.wait("connecting", &error.to_string());
                }
            }
            tokio::time::sleep(delay).await;
            delay = (delay * 2).min(LONGEST_DELAY);
        }
    }

    fn wait(&self, stage: &'static str, detail: &str) {
        self.changes.send_replace(SessionState::Waiting { stage, detail: detail.to_owned() });
    }

    /// Opens a session; gives its rate, too.
    async fn opened(&self) -> Result<(Session, Option<f64>), ClientError> {
        let client = Client::connect(&self.coordinator).await?;
        let space = ViewSpace::of(&self.offer);
        let invalid =
            |error: crate::camera::BadView| ClientError::Invalid { field: "camera", reason: error.to_string() };
        let typical = space.camera(&space.home(&self.offer), TYPICAL_PX).map_err(invalid)?;
        let request = (self.request_of)(&self.offer, typical);
        let rate = request.frames_per_s;
        Ok((client.open_session(request, |event| self.tell(event)).await?, rate))
    }

    fn tell(&self, event: &SessionEvent) {
        if let SessionEvent::Progress { stage, detail } = event {
            let stage = match stage {
                SessionStage::Measuring => "measuring",
                SessionStage::Planning => "planning",
                SessionStage::Preparing => "preparing",
            };
            self.wait(stage, detail);
        }
    }

    /// Has the session's demand follow the visitors, until the session fails.
    async fn follow(&mut self, session: &Arc<Session>, rate: Option<f64>) {
        let (mut ticks, mut told) = (tokio::time::interval(FOLLOW), 1);
        loop {
            tokio::select! {
                failed = self.failed.recv() => if failed.is_none_or(|failed| Arc::ptr_eq(&failed, session)) {
                    return;
                },
                _ = ticks.tick() => {
                    let active = self.visits.active(Instant::now()).max(1) as u32;
                    if active != told {
                        match session.change(active, rate).await {
                            Ok(()) => told = active,
                            Err(error) => tracing::debug!(active, %error, "the demand is not changed"),
                        }
                    }
                }
            }
        }
    }
}
