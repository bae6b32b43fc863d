//! The coordinator's service: it asks the schedule and does what it says.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use cluster::{
    ChangeSession, ClusterStatus, Costs, FetchScene, JoinCluster, MeasureCosts, SamplerReport, ScenePart, SessionEvent,
    SessionRequest, Timeline, Welcome, WorkReport,
};
use codec::MAX_CHUNK_BYTES;
use glam::{Quat, Vec3};
use node::{Connections, ServeError, health, until_drained, with_guard, with_reflection};
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use tonic::{Status, async_trait};
use wire::rpc::{Coordinator, Messages, coordinator_server};

use crate::carrying_out::{Commands, carry_out, refusal};
use crate::leaving_out::probe;
use crate::opening::{Events, open};
use crate::reports::Reports;
use crate::schedule::{Event, Scheduler};
use crate::seats::Seats;
use crate::{CoordinatorConfig, Observers, SceneOffer};

/// Events that a session's client has not read yet.
const SESSION_EVENTS: usize = 64;
type SessionEvents = mpsc::Receiver<Result<SessionEvent, Status>>;

/// How often the schedule looks again though nothing has happened.
const TICK: Duration = Duration::from_millis(250);

/// Serves until `shutdown`; then ends its streams and returns when connections have ended, after 10 s at
/// most.
///
/// # Errors
/// Where the address is not allowed or the transport fails.
pub async fn serve(
    listener: TcpListener,
    config: CoordinatorConfig,
    offer: SceneOffer,
    observers: Observers,
    shutdown: CancellationToken,
) -> Result<(), ServeError> {
    let inner = Arc::new(Inner {
        config,
        offer,
        connections: Connections::default(),
        measuring: tokio::sync::Mutex::default(),
        started: Instant::now(),
        schedule: Mutex::new((Scheduler::default(), observers)),
        commands: Commands::default(),
        seats: Seats::default(),
        joining: Mutex::default(),
        reports: Reports::default(),
        sessions: Mutex::default(),
        costs: Mutex::default(),
        counter: AtomicU64::new(1),
    });
    let mut running = JoinSet::new();
    running.spawn(carry_out(inner.clone()));
    running.spawn(tick(inner.clone()));
    running.spawn(probe(inner.clone()));
    let service = CoordinatorService { inner, shutdown: shutdown.clone() };
    let routes = Routes::new(health(&["coordinator"]).await).add_service(coordinator_server(service));
    node::serve(listener, with_reflection(routes, config.reflection)?, config.insecure_bind, shutdown).await
}

async fn tick(inner: Arc<Inner>) {
    let mut ticks = tokio::time::interval(TICK);
    loop {
        ticks.tick().await;
        inner.step(Event::Tick);
    }
}

/// What all calls share.
pub(crate) struct Inner {
    pub(crate) config: CoordinatorConfig,
    pub(crate) offer: SceneOffer,
    pub(crate) connections: Connections,
    pub(crate) measuring: tokio::sync::Mutex<()>,
    started: Instant,
    schedule: Mutex<(Scheduler, Observers)>,
    pub(crate) commands: Commands,
    pub(crate) seats: Seats,
    /// One at a time: the schedule hears of nodes in the order in which they are seated.
    joining: Mutex<()>,
    pub(crate) reports: Reports,
    sessions: Mutex<HashMap<u64, Events>>,
    /// Of each device and what was measured, the oldest first.
    costs: Mutex<Vec<(String, MeasureCosts, Costs)>>,
    counter: AtomicU64,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Inner {
    /// Tells the schedule; what follows is carried out in its order.
    pub(crate) fn step(&self, event: Event) {
        let mut schedule = locked(&self.schedule);
        let (scheduler, observers) = &mut *schedule;
        let now = self.started.elapsed();
        observers.note(now, &event);
        let is_tick = matches!(event, Event::Tick);
        let commands = scheduler.step(now, event);
        // Nodes report often, and gauges are read seldom.
        if is_tick || !commands.is_empty() {
            observers.metrics.show(&scheduler.status(), &commands);
        }
        self.commands.add(commands);
    }

    /// Room for one more session, before anything is done for it.
    fn admit(&self) -> Result<(u64, Events, SessionEvents), Status> {
        let (mut sessions, most) = (locked(&self.sessions), self.config.max_sessions);
        if sessions.len() >= most {
            return Err(Status::resource_exhausted(format!("quota max_sessions: {most} sessions are open")));
        }
        let (session, (events, stream)) = (self.next_number(), mpsc::channel(SESSION_EVENTS));
        // There is room: it is the first.
        let _ = events.try_send(Ok(SessionEvent::Opened { session }));
        sessions.insert(session, events.clone());
        Ok((session, events, stream))
    }

    /// Ends a session that cannot be.
    pub(crate) fn refuse(&self, session: u64, status: Status) {
        tracing::warn!(session, reason = status.message(), "session refused");
        if let Some(events) = locked(&self.sessions).remove(&session) {
            let _ = events.try_send(Err(status));
        }
        self.step(Event::Closed { session });
    }

    pub(crate) fn end(&self, session: u64, reason: &str) {
        tracing::warn!(session, reason, "session ended");
        self.say(session, SessionEvent::Ended { reason: reason.to_owned() });
        self.forget(session);
    }

    /// To a client that does not read what it is told nothing more is said: its session ends.
    pub(crate) fn say(&self, session: u64, event: SessionEvent) {
        let full = locked(&self.sessions).get(&session).is_some_and(|events| events.try_send(Ok(event)).is_err());
        if full {
            self.forget(session);
            self.step(Event::Closed { session });
        }
    }

    pub(crate) fn forget(&self, session: u64) {
        locked(&self.sessions).remove(&session);
    }

    /// The cluster as it is.
    pub(crate) fn status(&self) -> ClusterStatus {
        locked(&self.schedule).0.status()
    }

    pub(crate) fn kept_costs(&self, device: &str, measure: &MeasureCosts) -> Option<Costs> {
        locked(&self.costs)
            .iter()
            .find(|(kept, what, _)| kept == device && *what == kind_of(measure))
            .map(|(_, _, costs)| *costs)
    }

    pub(crate) fn keep_costs(&self, device: String, measure: MeasureCosts, costs: Costs, most: usize) {
        let mut kept = locked(&self.costs);
        if kept.len() >= most {
            kept.remove(0);
        }
        kept.push((device, kind_of(&measure), costs));
    }

    fn next_number(&self) -> u64 {
        self.counter.fetch_add(1, Ordering::Relaxed)
    }
}

/// What costs are kept for: they do not depend on the scene's time nor, as far as sessions are concerned, on where a view
/// stands, and are those of finished pictures.
fn kind_of(measure: &MeasureCosts) -> MeasureCosts {
    let mut measure = measure.clone();
    measure.workload.timeline = Timeline::still(0.0);
    measure.workload.refinement_steps = 1;
    for view in &mut measure.typical_views {
        (view.eye_in_world, view.world_from_camera) = (Vec3::ZERO, Quat::IDENTITY);
    }
    measure
}

/// Says that something ended when its stream is dropped.
struct Guard {
    inner: Arc<Inner>,
    event: Option<Event>,
}

impl Drop for Guard {
    fn drop(&mut self) {
        let Some(event) = self.event.take() else { return };
        match &event {
            Event::Closed { session } => self.inner.forget(*session),
            Event::Left { incarnation, node_name } => self.inner.seats.leave(node_name, *incarnation),
            _ => (),
        }
        self.inner.step(event);
    }
}

struct CoordinatorService {
    inner: Arc<Inner>,
    shutdown: CancellationToken,
}

#[async_trait]
impl Coordinator for CoordinatorService {
    async fn join_cluster(&self, request: JoinCluster) -> Result<Messages<Welcome>, Status> {
        let (inner, node_name, incarnation) =
            (self.inner.clone(), request.node.node_name.clone(), self.inner.next_number());
        let welcome = Welcome { scenes: vec![inner.offer.scene()] };
        let _one = locked(&self.inner.joining);
        let told = inner.seats.take(&request.node, incarnation, welcome)?;
        tracing::info!(node = node_name, address = request.node.address, device = request.node.device_name, "joined");
        inner.step(Event::Joined { incarnation, join: request });
        let guard = Guard { inner, event: Some(Event::Left { incarnation, node_name }) };
        Ok(with_guard(until_drained(Box::pin(ReceiverStream::new(told)), self.shutdown.clone()), guard))
    }

    async fn open_session(&self, request: SessionRequest) -> Result<Messages<SessionEvent>, Status> {
        let (session, events, stream) = self.inner.admit()?;
        tokio::spawn(open(self.inner.clone(), session, request, events));
        let guard = Guard { inner: self.inner.clone(), event: Some(Event::Closed { session }) };
        Ok(with_guard(until_drained(Box::pin(ReceiverStream::new(stream)), self.shutdown.clone()), guard))
    }

    async fn change_session(&self, request: ChangeSession) -> Result<(), Status> {
        let ChangeSession { session, views_per_set, frames_per_s, viewpoints } = request;
        let (views_per_set, frames_per_s) = (views_per_set as usize, frames_per_s.unwrap_or(0.0));
        if !locked(&self.inner.sessions).contains_key(&session) {
            return Err(Status::not_found(format!("session_number: no session {session} is open")));
        }
        {
            let scheduler = &locked(&self.inner.schedule).0;
            if !scheduler.has_session(session) {
                return Err(Status::unavailable(format!("session_number: session {session} is still being opened")));
            }
            let admitted = scheduler.admits(session, views_per_set, frames_per_s);
            admitted.map_err(|error| refusal(&error))?;
            if let Some(viewpoints) = &viewpoints {
                scheduler.admits_views(session, viewpoints).map_err(|error| refusal(&error))?;
            }
        }
        self.inner.step(Event::Demanded { session, views_per_set, frames_per_s });
        if let Some(viewpoints) = viewpoints {
            self.inner.step(Event::Looked { session, viewpoints });
        }
        Ok(())
    }

    async fn report_work(&self, request: WorkReport) -> Result<(), Status> {
        let WorkReport { node_name, plan_epoch, costs, busy_s, views, dropped_views } = request;
        self.inner.step(Event::Measured { node_name, plan_epoch, costs, busy_s, views, dropped_views });
        Ok(())
    }

    async fn fetch_scene(&self, request: FetchScene) -> Result<Messages<ScenePart>, Status> {
        let offer = &self.inner.offer;
        if request.hash != offer.hash {
            return Err(Status::not_found(format!("scene_hash: the scene on offer is {}", offer.hash)));
        }
        let start = usize::try_from(request.offset_bytes).unwrap_or(usize::MAX);
        if start > offer.package.len() {
            return Err(Status::invalid_argument(format!(
                "offset_bytes is {start}, the package has {}",
                offer.package.len()
            )));
        }
        let package = offer.package.clone();
        let part = move |start: usize| ScenePart {
            offset_bytes: start as u64,
            data: package.slice(start..package.len().min(start + MAX_CHUNK_BYTES)),
        };
        let parts = (start..offer.package.len()).step_by(MAX_CHUNK_BYTES).map(part).map(Ok);
        Ok(until_drained(Box::pin(tokio_stream::iter(parts)), self.shutdown.clone()))
    }

    async fn status(&self) -> Result<ClusterStatus, Status> {
        Ok(ClusterStatus { offer: Some(self.inner.offer.status()), ..self.inner.status() })
    }

    async fn report_sampler(&self, report: SamplerReport) -> Result<(), Status> {
        self.inner.hear(&report)
    }
}
