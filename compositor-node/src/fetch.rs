//! One complete sample set: fetched from all its samplers at once, or from a compositor that relays it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use cluster::SamplerShare;
use depth_image::DepthImage;
use node::{CellPlan, Connections, Deadlines, SampleSet};
use tokio::task::JoinSet;
use tonic::Status;

use crate::chunk_stream::join_tiles;
use crate::fetch_share::{FetchTimes, FetchedShare, ShareRequest, fetch_share};
use crate::relay_buffer::RelayBuffer;
use crate::reports::NotFetched;

/// The time that a relay may be silent. The samplers are asked then, and have the images or not.
const RELAY_TIMEOUT: Duration = Duration::from_secs(3);

/// Fetches sets for one compositor.
#[derive(Debug)]
pub(crate) struct Fetcher {
    node_name: String,
    connections: Connections,
    deadlines: Deadlines,
    /// The plan whose relay has failed this node: samplers are asked from then on.
    failed_relay_epoch: AtomicU64,
}

/// A set, and the times of its fetch.
#[derive(Debug)]
pub(crate) struct Fetched {
    pub(crate) set: SampleSet,
    pub(crate) times: FetchTimes,
}

/// The images of a set that have been fetched so far.
struct Gathered {
    images: Vec<Option<DepthImage>>,
    times: FetchTimes,
}

impl Gathered {
    fn add(&mut self, shares: Vec<FetchedShare>) {
        for share in shares {
            self.times.add(share.times);
            for (index, image) in share.images {
                self.images[index as usize] = Some(image);
            }
        }
    }
}

impl Fetcher {
    pub(crate) fn new(node_name: &str, deadlines: Deadlines) -> Self {
        let (node_name, connections) = (node_name.to_owned(), Connections::default());
        Self { node_name, connections, deadlines, failed_relay_epoch: AtomicU64::new(0) }
    }

    /// Every image of a set, whole and decoded. They go to `relay` as they arrive.
    pub(crate) async fn fetch(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
        relay: Option<&RelayBuffer>,
    ) -> Result<Fetched, NotFetched> {
        let fetched = self.fetch_images(plan, set_index, relay).await;
        if let Some(relay) = relay {
            relay.end(fetched.as_ref().map(drop).map_err(|failed| failed.status.clone()));
        }
        let (images, times) = fetched?;
        let workload = &plan.workload;
        let set = SampleSet {
            images: join_tiles(plan, images).await?,
            volume: workload.volume,
            background_linear: workload.background_linear,
            illumination: workload.illumination.clone(),
            lighting: workload.lighting.clone(),
        };
        Ok(Fetched { set, times })
    }

    /// All images of a set, or their tiles, in their order.
    async fn fetch_images(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
        relay: Option<&RelayBuffer>,
    ) -> Result<(Vec<DepthImage>, FetchTimes), NotFetched> {
        let mut gathered = Gathered { images: vec![None; plan.image_count()], times: FetchTimes::default() };
        if let Some(request) = self.request_to_relay(plan) {
            match self.fetch_all(plan, set_index, vec![request], relay).await {
                Ok(shares) => gathered.add(shares),
                Err(NotFetched { status, .. }) => {
                    let (plan_epoch, reason) = (plan.plan_epoch, status.message());
                    tracing::info!(plan_epoch, reason, "samplers in place of a relay");
                    self.failed_relay_epoch.store(plan.plan_epoch, Ordering::Relaxed);
                }
            }
        }
        let missing = self.requests_to_samplers(plan, set_index, &gathered.images);
        gathered.add(self.fetch_all(plan, set_index, missing, relay).await?);
        let complete = gathered.images.into_iter().collect::<Option<_>>();
        let complete = complete.ok_or_else(|| Status::data_loss(format!("sample set {set_index} is not complete")))?;
        Ok((complete, gathered.times))
    }

    /// All images, from the relay of this compositor; `None` without one, or where it has failed.
    fn request_to_relay(&self, plan: &CellPlan) -> Option<ShareRequest> {
        let has_failed = self.failed_relay_epoch.load(Ordering::Relaxed) == plan.plan_epoch;
        let relay = plan.relay_of(&self.node_name).filter(|_| !has_failed)?;
        let image_indices = (0..plan.image_count() as u32).collect();
        Some(ShareRequest {
            share: SamplerShare { node_name: relay.node_name.clone(), address: relay.address.clone(), image_indices },
            answer_within: RELAY_TIMEOUT,
            first_within: RELAY_TIMEOUT,
            chunk_within: self.deadlines.chunk,
        })
    }

    /// The missing images, from their samplers.
    fn requests_to_samplers(
        &self,
        plan: &CellPlan,
        set_index: u32,
        images: &[Option<DepthImage>],
    ) -> Vec<ShareRequest> {
        let Deadlines { work, chunk, .. } = self.deadlines;
        let request = |share: &SamplerShare| {
            let is_missing = |index: &u32| images.get(*index as usize).is_some_and(Option::is_none);
            let image_indices = share.image_indices.iter().copied().filter(is_missing).collect();
            let share = SamplerShare { image_indices, ..share.clone() };
            ShareRequest { share, answer_within: work, first_within: chunk, chunk_within: chunk }
        };
        let requests = plan.samplers_of(set_index).iter().map(request);
        requests.filter(|request| !request.share.image_indices.is_empty()).collect()
    }

    /// Fetches all shares at the same time.
    async fn fetch_all(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
        requests: Vec<ShareRequest>,
        relay: Option<&RelayBuffer>,
    ) -> Result<Vec<FetchedShare>, NotFetched> {
        let mut fetches = JoinSet::new();
        for request in requests {
            let (fetcher, plan, relay) = (self.clone(), plan.clone(), relay.cloned());
            fetches.spawn(async move {
                let fetched = fetch_share(&fetcher.connections, &plan, set_index, &request, relay.as_ref()).await;
                fetched.map_err(|status| not_fetched(request.share, &status))
            });
        }
        let mut shares = Vec::new();
        while let Some(share) = fetches.join_next().await {
            shares.push(share.map_err(|error| Status::internal(error.to_string()))??);
        }
        Ok(shares)
    }
}

fn not_fetched(share: SamplerShare, status: &Status) -> NotFetched {
    let text = format!("sampler {} at {}: {}", share.node_name, share.address, status.message());
    // The status keeps the plan in force that a refusal names: this node, and its client, may not reach the coordinator.
    let status = Status::with_metadata(status.code(), text, status.metadata().clone());
    NotFetched { sampler: Some(share.node_name), status }
}

#[cfg(test)]
#[path = "fetch_tests.rs"]
mod tests;
