//! One complete sample set: fetched from all its samplers at once, or from a compositor that relays it.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use cluster::limits::MAX_WORKLOADS;
use cluster::{Assignment, SamplerShare, SetContent};
use depth_image::SampleImage;
use node::{CellPlan, Connections, Deadlines, PlansInForce, SampleSet, beyond_timeline, blocking, has_set};
use parking_lot::Mutex;
use tokio::task::JoinSet;
use tonic::{Code, Status};

use crate::fetch_share::{FetchTimes, FetchedShare, SetRequest, ShareRequest, fetch_share};
use crate::reports::NotFetched;

/// The time that a relay may be silent. The samplers are asked then, and have the images or not.
const RELAY_TIMEOUT: Duration = Duration::from_secs(3);

/// Fetches sets for one compositor.
#[derive(Debug)]
pub(crate) struct Fetcher {
    plans: PlansInForce,
    connections: Connections,
    deadlines: Deadlines,
    /// The last plans whose relay has failed this node: samplers are asked from then on.
    failed_relay_epochs: Mutex<BTreeSet<u64>>,
}

/// The images of a set that have been fetched so far.
struct Gathered {
    images: Vec<Option<SampleImage>>,
    times: FetchTimes,
}

impl Fetcher {
    pub(crate) fn new(plans: PlansInForce, deadlines: Deadlines) -> Self {
        Self { plans, connections: Connections::default(), deadlines, failed_relay_epochs: Mutex::default() }
    }

    /// A set with every image whole and decoded, and the times of its fetch.
    pub(crate) async fn fetch(self: &Arc<Self>, set: &SetRequest) -> Result<(SampleSet, FetchTimes), NotFetched> {
        let gathered = self.gather(set).await;
        if let Some(relay) = &set.relay {
            relay.end(gathered.as_ref().map(drop).map_err(|failed| failed.status.clone()));
        }
        let (images, times) = gathered?;
        let images = join_tiles(&set.plan, images).await?;
        let first = SampleSet::of(&set.plan.workload, images, set.plan.is_common);
        let first = first.map_err(|error| Status::data_loss(error.to_string()))?;
        let scene_time_s = set.plan.workload.timeline.time_s(set.set_index);
        let scene_time_s = scene_time_s.ok_or_else(|| beyond_timeline(set.set_index))?;
        Ok((SampleSet { scene_time_s, ..first }, times))
    }

    /// All images of a set, or their tiles, in their order.
    async fn gather(self: &Arc<Self>, set: &SetRequest) -> Result<(Vec<SampleImage>, FetchTimes), NotFetched> {
        let plan = &set.plan;
        let mut gathered = Gathered { images: vec![None; plan.image_count()], times: FetchTimes::default() };
        if let Some(request) = self.request_to_relay(plan)
            && let Err(NotFetched { status, .. }) = self.fetch_all(set, vec![request], &mut gathered).await
        {
            tracing::info!(plan_epoch = plan.plan_epoch, reason = status.message(), "samplers in place of a relay");
            // A relay that refuses one set may relay the next.
            if status.code() != Code::FailedPrecondition {
                let mut failed = self.failed_relay_epochs.lock();
                failed.insert(plan.plan_epoch);
                while failed.len() > MAX_WORKLOADS {
                    failed.pop_first();
                }
            }
        }
        let missing = self.requests_to_samplers(set, &gathered.images);
        self.fetch_all(set, missing, &mut gathered).await?;
        let Some(images) = gathered.images.into_iter().collect() else {
            return Err(Status::data_loss(format!("sample set {} is not complete", set.set_index)).into());
        };
        Ok((images, gathered.times))
    }

    /// All images, from the relay of this compositor; `None` without one, or where it has failed.
    fn request_to_relay(&self, plan: &CellPlan) -> Option<ShareRequest> {
        let has_failed = self.failed_relay_epochs.lock().contains(&plan.plan_epoch);
        let relay = plan.relay_of(&self.plans.node_name).filter(|_| !has_failed)?;
        let image_indices = (0..plan.image_count() as u32).collect();
        Some(ShareRequest {
            share: SamplerShare { node_name: relay.node_name.clone(), address: relay.address.clone(), image_indices },
            answer_within: RELAY_TIMEOUT,
            first_within: RELAY_TIMEOUT,
            chunk_within: self.deadlines.chunk,
        })
    }

    /// The missing images, from their samplers.
    fn requests_to_samplers(&self, set: &SetRequest, images: &[Option<SampleImage>]) -> Vec<ShareRequest> {
        let Deadlines { work, chunk, .. } = self.deadlines;
        let requests = set.plan.samplers_of(set.set_index).iter().map(|share| {
            let mut share = share.clone();
            share.image_indices.retain(|index| images.get(*index as usize).is_some_and(Option::is_none));
            ShareRequest { share, answer_within: chunk, first_within: work, chunk_within: chunk }
        });
        requests.filter(|request| !request.share.image_indices.is_empty()).collect()
    }

    /// Resolves when a plan is in force that has no such set, or no place for the node that it is fetched from: that node
    /// may be lost without a word. A set outlives every other plan.
    async fn in_vain(&self, set: &SetRequest, content: &SetContent, share: &SamplerShare) {
        let ends = self.plans.until(set.plan.workload_number, |plan| {
            let Some(plan) = plan else { return true };
            let samples = plan.samplers.iter().any(|sampler| sampler.node_name == share.node_name);
            plan.plan_epoch != set.plan.plan_epoch
                && !((plan.composites(&share.node_name) || samples) && has_set(plan, content, set.set_index))
        });
        ends.await;
    }

    /// Fetches all shares at the same time.
    async fn fetch_all(
        self: &Arc<Self>,
        set: &SetRequest,
        requests: Vec<ShareRequest>,
        gathered: &mut Gathered,
    ) -> Result<(), NotFetched> {
        let content = set.plan.set_content(set.set_index).ok_or_else(|| beyond_timeline(set.set_index))?;
        let mut fetches = JoinSet::new();
        for request in requests {
            let fetcher = self.clone();
            let set = set.clone();
            fetches.spawn(async move {
                tokio::select! {
                    fetched = fetch_share(&fetcher.connections, &set, &request) => {
                        fetched.map_err(|status| not_fetched(request.share, &status))
                    }
                    () = fetcher.in_vain(&set, &content, &request.share) => {
                        let Assignment { plan_epoch, workload_number, .. } = &*set.plan;
                        let replaced = format!("plan_epoch {plan_epoch} of workload {workload_number} was replaced");
                        Err(Status::failed_precondition(replaced).into())
                    }
                }
            });
        }
        while let Some(share) = fetches.join_next().await {
            let FetchedShare { images, times } = share.map_err(|error| Status::internal(error.to_string()))??;
            gathered.times.add(times);
            images.into_iter().for_each(|(index, image)| gathered.images[index as usize] = Some(image));
        }
        Ok(())
    }
}

/// The images of a set from those that were sampled: the same, or joined from tiles.
async fn join_tiles(plan: &CellPlan, sampled: Vec<SampleImage>) -> Result<Vec<SampleImage>, Status> {
    if plan.tile_count == 1 {
        return Ok(sampled);
    }
    let plan = plan.clone();
    blocking(move || {
        let mut sampled = sampled.into_iter();
        let images = plan.workload.sample_cameras.iter().map(|camera| {
            let tiles = sampled.by_ref().take(plan.tile_count as usize).collect();
            SampleImage::from_tiles(camera, tiles).map_err(|error| Status::data_loss(error.to_string()))
        });
        images.collect()
    })
    .await
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
