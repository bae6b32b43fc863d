//! A stream on which every view is made.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use cluster::{Assignment, RenderViews, RequestedView};
use node::next_within;
use tokio::sync::Semaphore;
use tokio::task::JoinSet;
use tonic::{Code, Status};
use wire::rpc::Messages;

use crate::batch::{Loaded, MAX_BATCH, Waiting};
use crate::outbox::Reply;
use crate::queue::Lane;
use crate::quota::{Credit, closed};
use crate::shared::ClientStream;

/// Pixels of one stream's views that are waiting or not sent yet.
const STREAM_PIXELS: u32 = 128 << 20;
/// Views of one stream that are waiting or not sent yet.
const STREAM_VIEWS: u32 = 256;
/// View cells of one request whose sets are fetched at once: others wait behind them for memory.
const CELLS_AHEAD: usize = 8;

pub(crate) struct BatchStream<'a> {
    client: &'a ClientStream,
    reply: Reply,
    credits: Arc<Semaphore>,
    /// Whether the node has accepted a view of it. From then on it waits for room: its client requests the rest of a batch
    /// only when it has received some of it.
    admitted: bool,
}

impl<'a> BatchStream<'a> {
    pub(crate) fn new(client: &'a ClientStream, reply: Reply) -> Self {
        Self { client, reply, credits: Arc::new(Semaphore::new(STREAM_PIXELS as usize)), admitted: false }
    }

    pub(crate) async fn answer(
        mut self,
        first: RenderViews,
        mut requests: Messages<RenderViews>,
    ) -> Result<(), Status> {
        let mut next = Some(first);
        while let Some(request) = next {
            if request.live.is_some() {
                return Err(Status::invalid_argument("live: the stream's first request was not"));
            }
            self.enqueue(request).await?;
            next = self.next(&mut requests).await?;
        }
        Ok(())
    }

    /// A client that waits for frames is not idle.
    async fn next(&self, requests: &mut Messages<RenderViews>) -> Result<Option<RenderViews>, Status> {
        let is_busy = || self.credits.available_permits() < STREAM_PIXELS as usize;
        loop {
            match next_within(requests, self.client.shared.deadlines.idle, "views").await {
                Err(status) if status.code() == Code::DeadlineExceeded && is_busy() => (),
                next => return next,
            }
        }
    }

    /// Enqueues the views of every view cell as its images arrive; those of several cells are fetched at once.
    async fn enqueue(&mut self, request: RenderViews) -> Result<(), Status> {
        let (arrived, shared) = (Instant::now(), &self.client.shared);
        let plan = shared
            .of_compositor(shared.plans.require(request.workload_number, request.plan_epoch)?, &request.method)?;
        let mut cells = BTreeMap::<u32, Vec<RequestedView>>::new();
        for view in &request.views {
            cells.entry(plan.cell_of(&view.camera)).or_default().push(*view);
        }
        let mut sources = JoinSet::new();
        let mut cells = cells.into_iter();
        let mut fetch_next = |sources: &mut JoinSet<_>| {
            let Some((cell, views)) = cells.next() else { return };
            let (shared, plan, set_index) = (shared.clone(), plan.clone(), request.set_index);
            sources.spawn(async move { (views, shared.source(&plan, set_index, cell).await) });
        };
        (0..CELLS_AHEAD).for_each(|_| fetch_next(&mut sources));
        // In the order of their arrival: a set that has arrived is in memory, where others may wait for room.
        while let Some(source) = sources.join_next().await {
            fetch_next(&mut sources);
            let (views, set) = source.map_err(|error| Status::internal(error.to_string()))?;
            self.enqueue_of_cell(&request, &plan, (views, set?), arrived).await?;
        }
        Ok(())
    }

    /// Hands over views in pieces of one batch, as credit allows.
    async fn enqueue_of_cell(
        &mut self,
        request: &RenderViews,
        plan: &Arc<Assignment>,
        (views, set): (Vec<RequestedView>, Loaded),
        arrived: Instant,
    ) -> Result<(), Status> {
        let (set_index, cell, mut set) = (request.set_index, set.place.cell, Some(set));
        for views in views.chunks(MAX_BATCH) {
            let mut batch = Vec::with_capacity(views.len());
            for view in views {
                let credit = match self.try_credit(view)? {
                    Some(credit) => credit,
                    None => {
                        // A view without credit must not keep back those with credit, nor a set in memory.
                        self.client.queue(Lane::Batch, std::mem::take(&mut batch));
                        set = None;
                        self.credit(view).await?
                    }
                };
                self.admitted = true;
                let loaded = match set.take() {
                    Some(loaded) => loaded,
                    None => self.client.shared.source(plan, set_index, cell).await?,
                };
                batch.push(Waiting::new((request, *view, arrived), &loaded, self.reply.clone(), credit));
                set = Some(loaded);
            }
            self.client.queue(Lane::Batch, batch);
        }
        Ok(())
    }

    /// `None` where the view must wait; an error where other streams have taken the node's room and this one has had none.
    fn try_credit(&self, view: &RequestedView) -> Result<Option<Credit>, Status> {
        let Ok(stream) = self.credits.clone().try_acquire_many_owned(price(view)) else {
            return Ok(None);
        };
        match self.client.shared.quota.try_view(&view.camera) {
            Ok(node) => Ok(Some(Credit { stream, _node: node })),
            Err(refused) if !self.admitted => {
                self.client.shared.metrics.drop_view("node full");
                Err(refused)
            }
            Err(_) => Ok(None),
        }
    }

    async fn credit(&self, view: &RequestedView) -> Result<Credit, Status> {
        let stream = self.credits.clone().acquire_many_owned(price(view)).await.map_err(closed)?;
        Ok(Credit { stream, _node: self.client.shared.quota.view(&view.camera).await? })
    }
}

/// The pixels of its stream that a view takes. Small views take more than they have, so that their number is bounded. A
/// view takes at most all, so that one larger than the bound still passes, alone.
fn price(view: &RequestedView) -> u32 {
    let pixels = u32::try_from(view.camera.pixel_count()).unwrap_or(STREAM_PIXELS);
    pixels.clamp(STREAM_PIXELS / STREAM_VIEWS, STREAM_PIXELS)
}
