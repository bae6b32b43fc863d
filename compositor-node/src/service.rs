//! Answers clients that ask for views.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use cluster::{Assignment, Policy, RenderViews};
use codec::{FramePart, SampleSetId};
use node::{CellPlan, CurrentPlan, Deadlines, Engine, NodeConfig, NodeMetrics, Relay, next_within, until_drained};
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;
use tonic::{Status, async_trait};
use wire::rpc::{Compositor, Messages};

use crate::arrivals::Arrivals;
use crate::batch::Source;
use crate::batch_stream::BatchStream;
use crate::live_stream::LiveStream;
use crate::outbox::{Outbox, Outgoing, Reply};
use crate::quota::NodeQuota;
use crate::render::render_loop;
use crate::sets::{SetRelay, Sets};

/// The compositor's role.
pub struct CompositorService {
    shared: Arc<Shared>,
    shutdown: CancellationToken,
    /// Ends with the service.
    _rendering: JoinSet<()>,
}

/// What all streams share.
pub(crate) struct Shared {
    pub(crate) plan: CurrentPlan,
    pub(crate) sets: Arc<Sets>,
    pub(crate) arrivals: Arc<Arrivals>,
    pub(crate) quota: NodeQuota,
    pub(crate) deadlines: Deadlines,
    pub(crate) metrics: NodeMetrics,
    streams: AtomicU64,
}

impl CompositorService {
    /// Of a node. Starts the device's loop, which ends with the service.
    #[must_use]
    pub fn new(
        engine: Arc<dyn Engine>,
        plan: CurrentPlan,
        config: &NodeConfig,
        metrics: NodeMetrics,
        shutdown: CancellationToken,
    ) -> Self {
        let arrivals = Arc::<Arrivals>::default();
        let mut rendering = JoinSet::new();
        rendering.spawn(render_loop(engine.clone(), arrivals.clone(), metrics.clone()));
        let sets = Arc::new(Sets::new(engine, plan.clone(), config, metrics.clone()));
        let quota = NodeQuota::new(config.quotas);
        let shared =
            Shared { plan, sets, arrivals, quota, deadlines: config.deadlines, metrics, streams: AtomicU64::new(1) };
        Self { shared: Arc::new(shared), shutdown, _rendering: rendering }
    }

    /// What passes on to other compositors the images that come to this one.
    #[must_use]
    pub fn relay(&self) -> Arc<dyn Relay> {
        Arc::new(SetRelay(self.shared.sets.clone()))
    }
}

#[async_trait]
impl Compositor for CompositorService {
    async fn render_views(&self, requests: Messages<RenderViews>) -> Result<Messages<FramePart>, Status> {
        let place = self.shared.quota.stream()?;
        let stream = self.shared.streams.fetch_add(1, Ordering::Relaxed);
        let outbox = Outbox::new(stream, self.shared.metrics.clone());
        let client = ClientStream { shared: self.shared.clone(), stream, outbox: outbox.clone() };
        let requests = until_drained(requests, self.shutdown.clone());
        tokio::spawn(async move {
            client.run(requests).await;
            drop(place);
        });
        Ok(until_drained(Box::pin(Outgoing::new(outbox)), self.shutdown.clone()))
    }
}

/// One client's call.
pub(crate) struct ClientStream {
    pub(crate) shared: Arc<Shared>,
    /// Its number, for the queue and in logs.
    pub(crate) stream: u64,
    pub(crate) outbox: Arc<Outbox>,
}

impl ClientStream {
    /// Until it ends from either side; a client that takes nothing of what is ready is cut off.
    async fn run(self, requests: Messages<RenderViews>) {
        self.shared.metrics.streams.inc();
        let stall = self.shared.deadlines.stall;
        tokio::select! {
            () = self.answer_and_send(requests) => (),
            () = self.outbox.gone() => (),
            () = self.outbox.stalled(stall) => self.cut_off(),
        }
        for view in self.shared.arrivals.withdraw(self.stream) {
            self.shared.metrics.drop_view("client gone");
            drop(view);
        }
        self.shared.metrics.streams.dec();
    }

    /// The frames that are under way are sent before it ends.
    async fn answer_and_send(&self, requests: Messages<RenderViews>) {
        // Until the end, so that no other way out of here ends the stream without a reason.
        let reply = Reply::new(self.outbox.clone());
        if let Err(status) = self.answer(requests, reply.clone()).await {
            tracing::debug!(stream = self.stream, reason = status.message(), "a client's stream ends");
            reply.send(Err(status));
        }
        drop(reply);
        self.outbox.gone().await;
    }

    async fn answer(&self, mut requests: Messages<RenderViews>, reply: Reply) -> Result<(), Status> {
        let idle = self.shared.deadlines.idle;
        match next_within(&mut requests, idle, "views").await? {
            None => Ok(()),
            Some(first) if first.live.is_some() => LiveStream::new(self, reply).answer(first, requests).await,
            Some(first) => BatchStream::new(self, reply).answer(first, requests).await,
        }
    }

    fn cut_off(&self) {
        let seconds = self.shared.deadlines.stall.as_secs_f64();
        tracing::warn!(stream = self.stream, seconds, "a client takes no frames: cut off");
        let reason = format!("frames: nothing was taken for {seconds:.1} s");
        self.outbox.cut(Status::deadline_exceeded(reason));
    }
}

impl Shared {
    /// A plan, if this node makes views in it.
    pub(crate) fn of_compositor(&self, plan: Arc<Assignment>) -> Result<Arc<Assignment>, Status> {
        if plan.composites(self.plan.node_name()) {
            return Ok(plan);
        }
        Err(Status::failed_precondition(format!(
            "{} makes no views in plan_epoch {}",
            self.plan.node_name(),
            plan.plan_epoch
        )))
    }

    /// What views of a cell's set are made from, as soon as it is there, and the seconds until then.
    pub(crate) async fn source(
        &self,
        plan: &Arc<Assignment>,
        (set_index, cell): (u32, u32),
    ) -> Result<(Source, SampleSetId, f64), Status> {
        let start = Instant::now();
        let beyond = || Status::invalid_argument(format!("set_index {set_index} is beyond the timeline"));
        let id = plan.sample_set_id(set_index).ok_or_else(beyond)?;
        let source = match plan.policy {
            Policy::Pipeline | Policy::TimeShare => {
                Source::Set(self.sets.get(&CellPlan::of(plan, cell)?, set_index).await?)
            }
            Policy::Direct => Source::Scene {
                scene_hash: plan.workload.scene.hash.to_string(),
                lighting: plan.workload.lighting.clone(),
                scene_time_s: plan.workload.timeline.time_s(set_index).ok_or_else(beyond)?,
            },
        };
        Ok((source, id, start.elapsed().as_secs_f64()))
    }
}
