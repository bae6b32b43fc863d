//! The coordinator's service: calls become events of the schedule, and streams carry its answers.

use std::sync::Arc;
use std::time::Duration;

use cluster::{
    ChangeSession, ClusterStatus, FetchScene, JoinCluster, SamplerReport, ScenePart, SessionEvent, SessionRequest,
    Welcome, WorkReport,
};
use codec::MAX_CHUNK_BYTES;
use node::{Port, ServeError, health, until_drained, with_guard};
use tokio::task::JoinSet;
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use tonic::{Status, async_trait};
use wire::rpc::{Coordinator, Messages, coordinator_server};

use crate::config::{CoordinatorConfig, SceneOffer, SceneOffers};
use crate::executor::execute;
use crate::measuring::measure_when_idle;
use crate::observers::Observers;
use crate::schedule::Event;
use crate::session_opening::open;
use crate::shared::Shared;

/// The interval of ticks.
const TICK: Duration = Duration::from_millis(250);

/// Serves until `shutdown`; then ends its streams and returns when connections have ended, after 10 s at
/// most.
///
/// # Errors
/// Where the address is not allowed or the transport fails.
pub async fn serve(
    port: impl Into<Port>,
    config: CoordinatorConfig,
    offers: SceneOffers,
    observers: Observers,
    shutdown: CancellationToken,
) -> Result<(), ServeError> {
    let CoordinatorConfig { insecure_bind, max_workloads, audit_time_ratio, .. } = config;
    let shared = Arc::new(Shared::new(config, offers, observers));
    shared.step(Event::Limits { max_workloads, audit_time_ratio });
    let mut running = JoinSet::new();
    running.spawn(execute(shared.clone()));
    running.spawn(tick(shared.clone()));
    running.spawn(measure_when_idle(shared.clone()));
    let service = CoordinatorService { shared, shutdown: shutdown.clone() };
    let routes = Routes::new(health(&["coordinator"]).await).add_service(coordinator_server(service));
    node::serve(port, routes, insecure_bind, shutdown).await
}

async fn tick(shared: Arc<Shared>) {
    let mut ticks = tokio::time::interval(TICK);
    loop {
        ticks.tick().await;
        shared.step(Event::Tick);
    }
}

/// Tells the schedule that a stream has ended, when it is dropped.
struct Guard {
    shared: Arc<Shared>,
    event: Option<Event>,
}

impl Drop for Guard {
    fn drop(&mut self) {
        let Some(event) = self.event.take() else { return };
        match &event {
            Event::Closed { session } => self.shared.sessions.remove(*session),
            Event::Left { incarnation, node_name } => self.shared.membership.leave(node_name, *incarnation),
            _ => (),
        }
        self.shared.step(event);
    }
}

struct CoordinatorService {
    shared: Arc<Shared>,
    shutdown: CancellationToken,
}

#[async_trait]
impl Coordinator for CoordinatorService {
    async fn join_cluster(&self, request: JoinCluster) -> Result<Messages<Welcome>, Status> {
        let shared = self.shared.clone();
        let node_name = request.node.node_name.clone();
        let incarnation = shared.next_number();
        let welcome = Welcome { scenes: shared.offers.iter().map(SceneOffer::scene).collect() };
        let _one = self.shared.joining.lock();
        let stream = shared.membership.join(&request.node, incarnation, welcome)?;
        tracing::info!(node = node_name, address = request.node.address, device = request.node.device_name, "joined");
        shared.step(Event::Joined { incarnation, join: request });
        let guard = Guard { shared, event: Some(Event::Left { incarnation, node_name }) };
        Ok(with_guard(until_drained(Box::pin(ReceiverStream::new(stream)), self.shutdown.clone()), guard))
    }

    async fn open_session(&self, request: SessionRequest) -> Result<Messages<SessionEvent>, Status> {
        let shared = self.shared.clone();
        let session = shared.next_number();
        let (events, stream) = shared.sessions.admit(session, shared.config.max_sessions)?;
        tokio::spawn(open(shared.clone(), session, request, events));
        let guard = Guard { shared, event: Some(Event::Closed { session }) };
        Ok(with_guard(until_drained(Box::pin(ReceiverStream::new(stream)), self.shutdown.clone()), guard))
    }

    async fn change_session(&self, request: ChangeSession) -> Result<(), Status> {
        if !self.shared.sessions.contains(request.session) {
            return Err(Status::not_found(format!("session_number: no session {} is open", request.session)));
        }
        self.shared.change_session(request)
    }

    async fn report_work(&self, request: WorkReport) -> Result<(), Status> {
        let WorkReport { node_name, plan_epoch, workload_number, costs, busy_s, views, dropped_views, .. } = request;
        let WorkReport { viewpoints, audit, .. } = request;
        if self.shared.with_scheduler(|scheduler| scheduler.wants_viewpoints(workload_number)) {
            self.shared.step(Event::ViewersMoved { workload_number, node_name: node_name.clone(), viewpoints });
        }
        if let Some(report) = audit {
            self.shared.step(Event::Audited { workload_number, node_name: node_name.clone(), report });
        }
        self.shared.step(Event::Measured { node_name, plan_epoch, costs, busy_s, views, dropped_views });
        Ok(())
    }

    async fn fetch_scene(&self, request: FetchScene) -> Result<Messages<ScenePart>, Status> {
        let offer = self.shared.offers.find(Some(request.hash.as_str()))?;
        let start = usize::try_from(request.offset_bytes).unwrap_or(usize::MAX);
        let package = offer.package.clone();
        if start > package.len() {
            let length = package.len();
            return Err(Status::invalid_argument(format!("offset_bytes is {start}, the package has {length}")));
        }
        let parts = (start..package.len()).step_by(MAX_CHUNK_BYTES).map(move |start| {
            let data = package.slice(start..package.len().min(start + MAX_CHUNK_BYTES));
            Ok(ScenePart { offset_bytes: start as u64, data })
        });
        Ok(until_drained(Box::pin(tokio_stream::iter(parts)), self.shutdown.clone()))
    }

    async fn get_status(&self, (): ()) -> Result<ClusterStatus, Status> {
        Ok(ClusterStatus {
            offers: self.shared.offers.iter().map(SceneOffer::status).collect(),
            ..self.shared.status()
        })
    }

    async fn report_sampler(&self, report: SamplerReport) -> Result<(), Status> {
        if !self.shared.with_scheduler(|scheduler| scheduler.admits_report(&report)) {
            return Err(Status::failed_precondition(format!("plan_epoch {} gives no such roles", report.plan_epoch)));
        }
        self.shared.step(Event::Reported(report));
        Ok(())
    }
}
