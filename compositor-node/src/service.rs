//! Answers clients that ask for views.

use std::sync::Arc;
use std::time::Instant;

use node::{CurrentPlan, Deadlines, Engine, NodeConfig, NodeMetrics, next_within, until_drained};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio_util::sync::CancellationToken;
use tonic::{Status, async_trait};
use wire::rpc::{Compositor, Messages};
use wire::{Assignment, FramePart, Policy, RenderViews, RequestedView, SampleSetId};

use crate::batch::{BatchKey, MAX_BATCH, Source, Waiting};
use crate::output::{Outgoing, Output};
use crate::render::render_loop;
use crate::sets::Sets;

/// Pixels of one stream's views that wait or are not sent yet.
const STREAM_PIXELS: u32 = 128 << 20;
/// Views of one stream that wait or are not sent yet.
const STREAM_VIEWS: u32 = 256;
/// Batches that may arrive before the device's loop looks.
const ARRIVALS: usize = 64;

/// The compositor's role.
pub struct CompositorService {
    shared: Arc<Shared>,
    shutdown: CancellationToken,
}

struct Shared {
    plan: CurrentPlan,
    sets: Arc<Sets>,
    arrivals: mpsc::Sender<Vec<Waiting>>,
    deadlines: Deadlines,
    metrics: NodeMetrics,
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
        let (arrivals, arriving) = mpsc::channel(ARRIVALS);
        tokio::spawn(render_loop(engine.clone(), arriving, metrics.clone()));
        let sets = Arc::new(Sets::new(engine, config.deadlines, metrics.clone()));
        let shared = Shared { plan, sets, arrivals, deadlines: config.deadlines, metrics };
        Self { shared: Arc::new(shared), shutdown }
    }
}

#[async_trait]
impl Compositor for CompositorService {
    async fn render_views(&self, requests: Messages<RenderViews>) -> Result<Messages<FramePart>, Status> {
        let (reply, frames) = mpsc::channel(STREAM_VIEWS as usize + 1);
        let stream = ClientStream {
            shared: self.shared.clone(),
            reply,
            credits: Arc::new(Semaphore::new(STREAM_PIXELS as usize)),
        };
        let requests = until_drained(requests, self.shutdown.clone());
        tokio::spawn(stream.run(requests));
        Ok(until_drained(Box::pin(Outgoing::new(frames)), self.shutdown.clone()))
    }
}

struct ClientStream {
    shared: Arc<Shared>,
    reply: mpsc::Sender<Result<Output, Status>>,
    credits: Arc<Semaphore>,
}

impl ClientStream {
    async fn run(self, mut requests: Messages<RenderViews>) {
        self.shared.metrics.streams.inc();
        let ended = tokio::select! {
            ended = self.answer(&mut requests) => ended,
            () = self.reply.closed() => Ok(()),
        };
        self.shared.metrics.streams.dec();
        if let Err(status) = ended {
            tracing::debug!(reason = status.message(), "a client's stream ends");
            // Full or gone: the client then sees the end without a reason.
            let _ = self.reply.try_send(Err(status));
        }
    }

    async fn answer(&self, requests: &mut Messages<RenderViews>) -> Result<(), Status> {
        while let Some(request) = self.next(requests).await? {
            self.enqueue(request).await?;
        }
        Ok(())
    }

    /// A client that waits for frames is not idle.
    async fn next(&self, requests: &mut Messages<RenderViews>) -> Result<Option<RenderViews>, Status> {
        loop {
            match next_within(requests, self.shared.deadlines.idle, "views").await {
                Err(status) if status.code() == tonic::Code::DeadlineExceeded && self.frames_are_due() => (),
                next => return next,
            }
        }
    }

    fn frames_are_due(&self) -> bool {
        self.credits.available_permits() < STREAM_PIXELS as usize
    }

    /// Hands over a request's views in pieces of one batch, as far as there is credit.
    async fn enqueue(&self, request: RenderViews) -> Result<(), Status> {
        let plan = self.shared.plan.require(request.plan_epoch)?;
        if !plan.composites(self.shared.plan.node_name()) {
            return Err(Status::failed_precondition(format!(
                "{} makes no views in plan_epoch {}",
                self.shared.plan.node_name(),
                plan.plan_epoch
            )));
        }
        let start = Instant::now();
        let (source, sample_set_id) = self.source(&plan, request.set_index).await?;
        let set_wait_s = start.elapsed().as_secs_f64();
        for views in request.views.chunks(MAX_BATCH) {
            let mut batch = Vec::with_capacity(views.len());
            for &view in views {
                // What holds no credit yet must not keep back what does: at the bound, hand over first.
                let credit = match self.try_credit(&view) {
                    Some(credit) => credit,
                    None => {
                        self.hand_over(std::mem::take(&mut batch)).await?;
                        self.credit(&view).await?
                    }
                };
                let key = BatchKey {
                    sample_set_id,
                    method: request.method.clone(),
                    planes: request.planes,
                    size_px: view.camera.size_px,
                };
                batch.push(Waiting {
                    key,
                    source: source.clone(),
                    view,
                    codec: request.codec,
                    set_wait_s,
                    since: Instant::now(),
                    reply: self.reply.clone(),
                    credit,
                });
            }
            self.hand_over(batch).await?;
        }
        Ok(())
    }

    async fn source(&self, plan: &Arc<Assignment>, set_index: u32) -> Result<(Source, SampleSetId), Status> {
        let beyond = || Status::invalid_argument(format!("set_index {set_index} is beyond the timeline"));
        let id = plan.sample_set_id(set_index).ok_or_else(beyond)?;
        let source = match plan.policy {
            Policy::Pipeline | Policy::TimeShare => Source::Set(self.shared.sets.get(plan, set_index).await?),
            Policy::Direct => Source::Scene {
                scene_hash: plan.workload.scene.hash.to_string(),
                lighting: plan.workload.lighting.clone(),
                scene_time_s: plan.workload.timeline.time_s(set_index).ok_or_else(beyond)?,
            },
        };
        Ok((source, id))
    }

    fn try_credit(&self, view: &RequestedView) -> Option<OwnedSemaphorePermit> {
        self.credits.clone().try_acquire_many_owned(price(view)).ok()
    }

    async fn credit(&self, view: &RequestedView) -> Result<OwnedSemaphorePermit, Status> {
        let credit = self.credits.clone().acquire_many_owned(price(view)).await;
        credit.map_err(|_| Status::internal("the stream's credits are closed"))
    }

    async fn hand_over(&self, batch: Vec<Waiting>) -> Result<(), Status> {
        if batch.is_empty() {
            return Ok(());
        }
        self.shared.arrivals.send(batch).await.map_err(|_| Status::internal("the device's loop has ended"))
    }
}

/// What a view takes of its stream's pixels: at least so much that the views are bounded too, at most
/// all, so that one view larger than the bound still passes, alone.
fn price(view: &RequestedView) -> u32 {
    let pixels = u32::try_from(view.camera.pixel_count()).unwrap_or(STREAM_PIXELS);
    pixels.clamp(STREAM_PIXELS / STREAM_VIEWS, STREAM_PIXELS)
}
