//! A stream on which every view is made.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use cluster::{Assignment, RenderViews, RequestedView};
use depth_image::ViewPlanes;
use node::{next_within, view_bytes};
use tokio::sync::Semaphore;
use tonic::{Code, Status};
use wire::rpc::Messages;

use crate::batch::{MAX_BATCH, Waiting};
use crate::outbox::Reply;
use crate::quota::{Credit, closed};
use crate::shared::ClientStream;

/// Pixels of one stream's views that are waiting or not sent yet.
const STREAM_PIXELS: u32 = 128 << 20;
/// Views of one stream that are waiting or not sent yet.
const STREAM_VIEWS: u32 = 256;
/// View cells of one request whose sets are fetched at once, where memory has room.
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
        loop {
            let next = next_within(requests, self.client.shared.node.config.deadlines.idle, "views").await;
            let is_late = next.as_ref().is_err_and(|status| status.code() == Code::DeadlineExceeded);
            if !is_late || self.credits.available_permits() == STREAM_PIXELS as usize {
                return next;
            }
        }
    }

    /// Enqueues the views of one view cell after the other.
    async fn enqueue(&mut self, request: RenderViews) -> Result<(), Status> {
        let arrived = Instant::now();
        let shared = &self.client.shared;
        let plan = shared.node.plans.require(request.workload_number, request.plan_epoch)?;
        let plan = shared.of_compositor(plan, &request.method)?;
        shared.check_views(&plan, &request)?;
        let mut cells = BTreeMap::<u32, Vec<RequestedView>>::new();
        for view in &request.views {
            cells.entry(plan.cell_of(&view.camera)).or_default().push(*view);
        }
        let cells: Vec<_> = cells.into_iter().collect();
        for (at, (cell, views)) in cells.iter().enumerate() {
            // The sets of the next cells are fetched meanwhile, unpinned: one that is not needed yet must not keep out another.
            let next = cells[at..].iter().take(CELLS_AHEAD).map(|(cell, _)| *cell);
            shared.begin_to_load(&plan, request.set_index, next);
            self.enqueue_of_cell(&request, &plan, *cell, views, arrived).await?;
        }
        Ok(())
    }

    /// Hands over views in pieces of one batch, as credit allows. Without credit the stream keeps no set in memory, and
    /// without a set it waits with one credit at most: other streams never wait for one that waits.
    async fn enqueue_of_cell(
        &mut self,
        request: &RenderViews,
        plan: &Arc<Assignment>,
        cell: u32,
        views: &[RequestedView],
        arrived: Instant,
    ) -> Result<(), Status> {
        let shared = self.client.shared.clone();
        let mut left = views;
        let mut set = Some(shared.source(plan, request.set_index, cell).await?);
        while let Some(first) = left.first() {
            let mut credits = self.try_credits(request.planes, left)?;
            if credits.is_empty() {
                set = None;
                credits.push(self.credit(request.planes, first).await?);
            }
            let loaded = match set.take() {
                Some(loaded) => loaded,
                None => {
                    let loaded = shared.source(plan, request.set_index, cell).await?;
                    credits.extend(self.try_credits(request.planes, &left[1..])?);
                    loaded
                }
            };
            let (now, later) = left.split_at(credits.len());
            let waiting = now
                .iter()
                .zip(credits)
                .map(|(view, credit)| Waiting::new(request, *view, arrived, &loaded, self.reply.clone(), credit));
            self.client.queue(false, waiting.collect());
            (left, set) = (later, Some(loaded));
        }
        Ok(())
    }

    /// The credits of the first views, as many as there is room for and a batch can have.
    fn try_credits(&mut self, planes: ViewPlanes, views: &[RequestedView]) -> Result<Vec<Credit>, Status> {
        let mut credits = Vec::new();
        for view in views.iter().take(MAX_BATCH) {
            let Some(credit) = self.try_credit(planes, view)? else { break };
            self.admitted = true;
            credits.push(credit);
        }
        Ok(credits)
    }

    /// `None` where the view must wait; an error where other streams have taken the node's room and this one has had none.
    fn try_credit(&self, planes: ViewPlanes, view: &RequestedView) -> Result<Option<Credit>, Status> {
        let Ok(stream) = self.credits.clone().try_acquire_many_owned(price(view)) else {
            return Ok(None);
        };
        match self.client.shared.quota.try_view(view_bytes(&view.camera, planes)) {
            Ok(node) => Ok(Some(Credit { stream, _node: node })),
            Err(refused) if !self.admitted => {
                self.client.shared.node.metrics.drop_view("node full");
                Err(refused)
            }
            Err(_) => Ok(None),
        }
    }

    /// Waits until a part of the stream's room is free. A set that was evicted meanwhile is fetched again for several views.
    async fn credit(&self, planes: ViewPlanes, view: &RequestedView) -> Result<Credit, Status> {
        let part = price(view).max(STREAM_PIXELS / 4);
        let mut free = self.credits.clone().acquire_many_owned(part).await.map_err(closed)?;
        let stream = free.split(price(view) as usize).ok_or_else(|| closed(()))?;
        drop(free);
        let bytes = view_bytes(&view.camera, planes);
        Ok(Credit { stream, _node: self.client.shared.quota.view(bytes).await? })
    }
}

/// The pixels of its stream that a view takes. Small views take more than they have, so that their number is bounded. A
/// view takes at most all, so that one larger than the bound still passes, alone.
fn price(view: &RequestedView) -> u32 {
    let pixels = u32::try_from(view.camera.pixel_count()).unwrap_or(STREAM_PIXELS);
    pixels.clamp(STREAM_PIXELS / STREAM_VIEWS, STREAM_PIXELS)
}
