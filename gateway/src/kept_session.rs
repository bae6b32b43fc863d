//! A session that is open while somebody needs it, and opened again when it fails.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::http::StatusCode;
use client::{Client, ClientError, Session};
use cluster::{SessionEvent, SessionRequest, SessionStage, Timeline};
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::task::JoinSet;

use crate::protocol::Waiting;
use crate::responses::Refusal;
use crate::visits::Visits;

/// The delays between attempts to reach the coordinator.
pub(crate) const FIRST_DELAY: Duration = Duration::from_millis(250);
pub(crate) const LONGEST_DELAY: Duration = Duration::from_secs(4);
/// The lowest rate that a session is opened with, in pictures a second.
const LEAST_RATE: f64 = 0.05;
/// A session stays open after its last visit: a visitor who comes back soon finds the samples that were there.
const LINGERS: Duration = Duration::from_secs(60);
/// The interval at which the session's demand follows the visitors.
const FOLLOW: Duration = Duration::from_secs(1);

/// The longest wait of a single view for its session.
const OPEN_WITHIN: Duration = Duration::from_secs(60);
/// Single views that are made at a time: slow ones hold up no other session's.
const SINGLE_VIEWS: usize = 4;

/// A kept session, or why it is not open.
pub(crate) type SessionState = Result<Arc<Session>, Waiting>;

/// A session that all visitors of a scene share.
pub(crate) struct KeptSession {
    pub(crate) visits: Arc<Visits>,
    /// Steps in which the light of its pictures is refined.
    pub(crate) light_steps: u32,
    /// The moments of its sample sets.
    pub(crate) timeline: Timeline,
    /// Places of single views that are made.
    pub(crate) single_views: Semaphore,
    pub(crate) state: watch::Receiver<SessionState>,
    failures: mpsc::Sender<Arc<Session>>,
    /// Ends with the session.
    _keeper: JoinSet<()>,
}

impl KeptSession {
    /// The session is opened at its first visit, or `at_once`: its costs are then known before anybody comes.
    pub(crate) fn start(coordinator: &str, request: SessionRequest, at_once: bool) -> Self {
        let waiting = Waiting { stage: "connecting", detail: "the gateway connects".to_owned() };
        let (changes, state) = watch::channel(Err(waiting));
        let (failures, failed) = mpsc::channel(16);
        let light_steps = request.refinement_steps.max(1);
        let timeline = request.timeline;
        let visits = Arc::new(Visits::default());
        let coordinator = coordinator.to_owned();
        let keeper = Keeper { coordinator, request, visits: visits.clone(), changes, failed };
        let mut tasks = JoinSet::new();
        tasks.spawn(keeper.run(at_once));
        let single_views = Semaphore::new(SINGLE_VIEWS);
        Self { visits, light_steps, timeline, single_views, state, failures, _keeper: tasks }
    }

    /// The session, once it is open.
    pub(crate) async fn opened(&self) -> Result<Arc<Session>, Refusal> {
        let mut state = self.state.clone();
        let opened = state.wait_for(Result::is_ok);
        let _ = tokio::time::timeout(OPEN_WITHIN, opened).await;
        match &*self.state.borrow() {
            Ok(session) => Ok(session.clone()),
            Err(Waiting { stage, detail }) => {
                let reason = format!("the scene's session is not open yet: {stage}: {detail}");
                Err(Refusal(StatusCode::SERVICE_UNAVAILABLE, reason))
            }
        }
    }

    /// Has a session opened again that delivers nothing any more.
    pub(crate) fn has_failed(&self, session: Arc<Session>, error: &ClientError) {
        // A picture that has no room, or takes too long, is no fault of the session.
        if !matches!(error, ClientError::Exhausted { .. } | ClientError::Invalid { .. }) {
            // Where there is no room, others have told of it.
            let _ = self.failures.try_send(session);
        }
    }
}

/// Opens and closes the session.
struct Keeper {
    coordinator: String,
    request: SessionRequest,
    visits: Arc<Visits>,
    changes: watch::Sender<SessionState>,
    failed: mpsc::Receiver<Arc<Session>>,
}

impl Keeper {
    async fn run(mut self, mut is_wanted: bool) {
        let usual_rate = self.request.frames_per_s;
        let mut delay = FIRST_DELAY;
        loop {
            if !is_wanted {
                self.visits.somebody().await;
                delay = FIRST_DELAY;
            }
            is_wanted = true;
            match self.opened().await {
                Ok(session) => {
                    let opened_at = Instant::now();
                    let session = Arc::new(session);
                    let _ = self.changes.send_replace(Ok(session.clone()));
                    if self.follow(&session).await {
                        self.wait("preparing", "the scene's session is opened");
                        is_wanted = false;
                        self.request.frames_per_s = usual_rate;
                        continue;
                    }
                    self.wait("reconnecting", "the session is opened again");
                    if opened_at.elapsed() > LONGEST_DELAY {
                        delay = FIRST_DELAY;
                    }
                }
                // A slow device has no room for the usual rate: visitors get fewer pictures.
                Err(ClientError::Exhausted { .. }) if self.halve_rate() => continue,
                Err(error) => self.tell_failure(&error),
            }
            tokio::time::sleep(delay).await;
            delay = (delay * 2).min(LONGEST_DELAY);
        }
    }

    /// Asks for half the rate from now on; false where there is none, or it is low already.
    fn halve_rate(&mut self) -> bool {
        let half = self.request.frames_per_s.map(|rate| rate / 2.0).filter(|&half| half >= LEAST_RATE);
        if half.is_some() {
            self.request.frames_per_s = half;
        }
        half.is_some()
    }

    fn wait(&self, stage: &'static str, detail: &str) {
        let _ = self.changes.send_replace(Err(Waiting { stage, detail: detail.to_owned() }));
    }

    /// Warns of a failure once, however often it is met.
    fn tell_failure(&self, error: &ClientError) {
        let detail = error.to_string();
        if !matches!(&*self.changes.borrow(), Err(known) if known.detail == detail) {
            tracing::warn!(scene = self.request.scene, %error, "no session");
        }
        self.wait("connecting", &detail);
    }

    async fn opened(&self) -> Result<Session, ClientError> {
        let client = Client::connect(&self.coordinator).await?;
        client.open_session(self.request.clone(), |event| self.tell(event)).await
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

    /// Has the session's demand follow the visitors, until it fails or they have left. Returns whether they have left.
    async fn follow(&mut self, session: &Arc<Session>) -> bool {
        let mut ticks = tokio::time::interval(FOLLOW);
        let mut told = 1;
        loop {
            tokio::select! {
                failed = self.failed.recv() => if failed.is_none_or(|failed| Arc::ptr_eq(&failed, session)) {
                    return false;
                },
                _ = ticks.tick() => {
                    if self.visits.is_left(Instant::now(), LINGERS) {
                        return true;
                    }
                    let active = self.visits.active(Instant::now()).max(1) as u32;
                    // A session without a rate follows nobody.
                    if active == told || self.request.frames_per_s.is_none() {
                        continue;
                    }
                    match session.change(active, self.request.frames_per_s).await {
                        Ok(()) => told = active,
                        Err(error) => tracing::debug!(active, %error, "the demand is not changed"),
                    }
                }
            }
        }
    }
}
