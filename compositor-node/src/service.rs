//! The service that clients request views from.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use cluster::RenderViews;
use codec::FramePart;
use node::{CellPlan, NodeParts, Relay, ViewProbes, next_within, until_drained};
use parking_lot::Mutex;
use tokio::task::JoinSet;
use tonic::{Status, async_trait};
use wire::rpc::{Compositor, Messages};

use crate::auditor::Auditor;
use crate::batch_stream::BatchStream;
use crate::live_stream::LiveStream;
use crate::outbox::{Outbox, Outgoing, Reply};
use crate::queue::{Arrivals, Lane};
use crate::quota::NodeQuota;
use crate::render::Rendering;
use crate::sets::Sets;
use crate::shared::{ClientStream, Shared};
use crate::view_times::ViewTimes;

/// The compositor's role.
pub struct CompositorService {
    shared: Arc<Shared>,
    /// Ends with the service.
    _rendering: JoinSet<()>,
}

impl CompositorService {
    /// Starts the device's loops, which end with the service.
    #[must_use]
    pub fn new(node: Arc<NodeParts>, probes: Arc<dyn ViewProbes>) -> Self {
        let arrivals = Arc::<Arrivals>::default();
        let mut rendering = JoinSet::new();
        let times = Arc::new(ViewTimes::new(node.config.max_view_s));
        let auditor = Auditor { node: node.clone(), probes, schedule: Mutex::default() };
        let renderer = Rendering::new(Arc::new(auditor), times.clone());
        for lane in Lane::ALL {
            rendering.spawn(renderer.clone().run(arrivals.clone(), lane));
        }
        let sets = Arc::new(Sets::new(node.clone()));
        let cached = sets.cached.clone();
        node.monitor.add_memory(move || cached.free());
        let quota = NodeQuota::new(node.config.quotas);
        let shared = Shared { node, sets, arrivals, quota, times, stream_count: AtomicU64::new(1) };
        Self { shared: Arc::new(shared), _rendering: rendering }
    }

    /// Relays the images that this compositor fetches to other compositors.
    #[must_use]
    pub fn relay(&self) -> Relay {
        let sets = self.shared.sets.clone();
        Arc::new(move |plan: &CellPlan, set_index| sets.relay(plan, set_index))
    }
}

#[async_trait]
impl Compositor for CompositorService {
    async fn render_views(&self, requests: Messages<RenderViews>) -> Result<Messages<FramePart>, Status> {
        let place = self.shared.quota.stream()?;
        let stream = self.shared.stream_count.fetch_add(1, Ordering::Relaxed);
        let outbox = Outbox::new(stream, self.shared.node.metrics.clone());
        self.shared.node.metrics.streams.inc();
        let client = ClientStream { shared: self.shared.clone(), stream, outbox: outbox.clone() };
        let requests = until_drained(requests, self.shared.node.shutdown.clone());
        tokio::spawn(async move {
            client.run(requests).await;
            drop(place);
        });
        Ok(until_drained(Box::pin(Outgoing(outbox)), self.shared.node.shutdown.clone()))
    }
}

impl ClientStream {
    /// Runs until either side ends the stream; a client that takes no frames is cut off.
    async fn run(self, requests: Messages<RenderViews>) {
        let stream = self.stream;
        let stall = self.shared.node.config.deadlines.stall;
        tokio::select! {
            () = self.answer_and_send(requests) => (),
            () = self.outbox.gone.cancelled() => (),
            () = self.outbox.stalled(stall) => {
                let seconds = stall.as_secs_f64();
                tracing::warn!(stream, seconds, "a client takes no frames: cut off");
                self.outbox.cut(Status::deadline_exceeded(format!("frames: none was taken for {seconds:.1} s")));
            }
        }
    }

    /// Frames in flight are sent before the stream ends.
    async fn answer_and_send(&self, requests: Messages<RenderViews>) {
        // Kept to the end, so that no other way out of here ends the stream without a reason.
        let reply = Reply::new(self.outbox.clone());
        if let Err(status) = self.answer(requests, reply.clone()).await {
            tracing::debug!(stream = self.stream, reason = status.message(), "a client's stream ends");
            reply.send(Err(status));
        }
        drop(reply);
        self.outbox.gone.cancelled().await;
    }

    async fn answer(&self, mut requests: Messages<RenderViews>, reply: Reply) -> Result<(), Status> {
        let idle = self.shared.node.config.deadlines.idle;
        match next_within(&mut requests, idle, "views").await? {
            None => Ok(()),
            Some(first) if first.live.is_some() => LiveStream::new(self, reply).answer(first, requests).await,
            Some(first) => BatchStream::new(self, reply).answer(first, requests).await,
        }
    }
}
