//! The coordinator's service: it asks the schedule and does what it says.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use node::{Connections, ServeError, health, until_drained, with_guard};
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio_stream::StreamExt as _;
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use tonic::{Status, async_trait};
use wire::limits::PART_BYTES;
use wire::rpc::{Coordinator, Messages, coordinator_server};
use wire::{
    ClusterStatus, Costs, FetchScene, JoinCluster, MeasureCosts, ScenePart, SessionEvent, SessionRequest, Timeline,
    Welcome,
};

use crate::carrying_out::{Commands, carry_out};
use crate::opening::{Events, open};
use crate::schedule::{Event, Scheduler};
use crate::{CoordinatorConfig, Observers, SceneOffer};

/// Events that a session's client has not read yet.
const SESSION_EVENTS: usize = 64;
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
        sessions: Mutex::default(),
        costs: Mutex::default(),
        counter: AtomicU64::new(1),
    });
    let mut running = JoinSet::new();
    running.spawn(carry_out(inner.clone()));
    running.spawn(tick(inner.clone()));
    let service = CoordinatorService { inner, shutdown: shutdown.clone() };
    let routes = Routes::new(health(&["coordinator"]).await).add_service(coordinator_server(service));
    node::serve(listener, routes, config.insecure_bind, shutdown).await
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
        let commands = scheduler.step(now, event);
        observers.metrics.show(&scheduler.status(), &commands);
        self.commands.add(commands);
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
            .find(|(kept, what, _)| kept == device && *what == timeless(measure))
            .map(|(_, _, costs)| *costs)
    }

    pub(crate) fn keep_costs(&self, device: String, measure: MeasureCosts, costs: Costs, most: usize) {
        let mut kept = locked(&self.costs);
        if kept.len() >= most {
            kept.remove(0);
        }
        kept.push((device, timeless(&measure), costs));
    }

    fn next_number(&self) -> u64 {
        self.counter.fetch_add(1, Ordering::Relaxed)
    }
}

/// Costs do not depend on the scene's time, and are those of finished pictures.
fn timeless(measure: &MeasureCosts) -> MeasureCosts {
    let mut measure = measure.clone();
    measure.workload.timeline = Timeline::still(0.0);
    measure.workload.refinement_steps = 1;
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
        if let Event::Closed { session } = event {
            self.inner.forget(session);
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
        tracing::info!(node = node_name, address = request.node.address, device = request.node.device_name, "joined");
        inner.step(Event::Joined { incarnation, join: request });
        let welcome = Welcome { scenes: vec![inner.offer.scene()] };
        let stream = tokio_stream::once(Ok(welcome)).chain(tokio_stream::pending());
        let guard = Guard { inner, event: Some(Event::Left { incarnation, node_name }) };
        Ok(with_guard(until_drained(Box::pin(stream), self.shutdown.clone()), guard))
    }

    async fn open_session(&self, request: SessionRequest) -> Result<Messages<SessionEvent>, Status> {
        let session = self.inner.next_number();
        let (events, stream) = mpsc::channel(SESSION_EVENTS);
        locked(&self.inner.sessions).insert(session, events.clone());
        tokio::spawn(open(self.inner.clone(), session, request, events));
        let guard = Guard { inner: self.inner.clone(), event: Some(Event::Closed { session }) };
        Ok(with_guard(until_drained(Box::pin(ReceiverStream::new(stream)), self.shutdown.clone()), guard))
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
            data: package.slice(start..package.len().min(start + PART_BYTES)),
        };
        let parts = (start..offer.package.len()).step_by(PART_BYTES).map(part).map(Ok);
        Ok(until_drained(Box::pin(tokio_stream::iter(parts)), self.shutdown.clone()))
    }

    async fn status(&self) -> Result<ClusterStatus, Status> {
        Ok(ClusterStatus { offer: Some(self.inner.offer.status()), ..self.inner.status() })
    }
}
