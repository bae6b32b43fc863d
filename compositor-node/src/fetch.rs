//! One complete sample set: pulled from all its samplers at once, or from a compositor that passes it on.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use cluster::{FetchImages, SamplerShare};
use codec::{Chunk, DecodeLimits, Reassembler, SampleSetId};
use depth_image::DepthImage;
use node::{CellPlan, Connections, Deadlines, SampleSet};
use tokio::task::JoinSet;
use tonic::{Code, Status};
use wire::rpc::{Messages, SamplerClient};

use crate::incoming::{Incoming, check, check_visibility, decode, whole};
use crate::passing::Passing;
use crate::reports::NotFetched;

/// Before a sampler is asked again for what it has already made.
const PAUSES: [Duration; 2] = [Duration::from_millis(50), Duration::from_millis(200)];
/// Who took longer than this to fail would do so again.
const SOON: Duration = Duration::from_secs(2);

/// How long a relay may be silent: samplers are asked then, who have sampled by that time or not.
const RELAY_PATIENCE: Duration = Duration::from_secs(3);

/// What fetches sets for one compositor.
#[derive(Debug)]
pub(crate) struct Fetcher {
    node_name: String,
    connections: Connections,
    deadlines: Deadlines,
    /// The plan whose relay has failed this node: samplers are asked from then on.
    failed_relay_epoch: AtomicU64,
}

/// A set, and what fetching it took.
#[derive(Debug)]
pub(crate) struct Fetched {
    pub(crate) set: SampleSet,
    pub(crate) took: Took,
}

/// Of one fetch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Took {
    /// Decoding, of all images.
    pub(crate) decode_s: f64,
    /// Waiting for bytes after the first, and how many they were.
    pub(crate) transfer_s: f64,
    pub(crate) bytes: usize,
}

impl Took {
    fn add(&mut self, other: Self) {
        self.decode_s += other.decode_s;
        self.transfer_s += other.transfer_s;
        self.bytes += other.bytes;
    }
}

type Images = Vec<(u32, DepthImage)>;

/// Whom to ask for which images.
#[derive(Debug, Clone)]
struct Ask {
    share: SamplerShare,
    /// Until it answers: a sampler does so when it has sampled.
    answer_within: Duration,
    /// From then on to the first chunk.
    first_within: Duration,
}

impl Fetcher {
    pub(crate) fn new(node_name: &str, deadlines: Deadlines) -> Self {
        let (node_name, connections) = (node_name.to_owned(), Connections::default());
        Self { node_name, connections, deadlines, failed_relay_epoch: AtomicU64::new(0) }
    }

    /// Every image of a set, whole and decoded. They are passed on as they come.
    pub(crate) async fn fetch(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
        passing: Option<&Passing>,
    ) -> Result<Fetched, NotFetched> {
        let fetched = self.fetch_images(plan, set_index, passing).await;
        if let Some(passing) = passing {
            passing.end(fetched.as_ref().map(drop).map_err(|failed| failed.status.clone()));
        }
        let (images, took) = fetched?;
        let workload = &plan.workload;
        let set = SampleSet {
            images: whole(plan, images).await?,
            volume: workload.volume,
            background_linear: workload.background_linear,
            illumination: workload.illumination.clone(),
            lighting: workload.lighting.clone(),
        };
        Ok(Fetched { set, took })
    }

    /// All that is sampled of a set, in its order.
    async fn fetch_images(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
        passing: Option<&Passing>,
    ) -> Result<(Vec<DepthImage>, Took), NotFetched> {
        let mut images: Vec<Option<DepthImage>> = vec![None; plan.image_count()];
        let mut took = Took::default();
        if let Some(relay) = self.relay(plan) {
            match self.fetch_all(plan, set_index, vec![relay], passing).await {
                Ok(came) => keep(&mut images, &mut took, came),
                Err(NotFetched { status, .. }) => {
                    tracing::info!(
                        plan_epoch = plan.plan_epoch,
                        reason = status.message(),
                        "samplers in place of a relay"
                    );
                    self.failed_relay_epoch.store(plan.plan_epoch, Ordering::Relaxed);
                }
            }
        }
        let missing = self.asks(plan, set_index, &images);
        keep(&mut images, &mut took, self.fetch_all(plan, set_index, missing, passing).await?);
        let complete = images.into_iter().collect::<Option<_>>();
        let complete = complete.ok_or_else(|| Status::data_loss(format!("sample set {set_index} is not complete")))?;
        Ok((complete, took))
    }

    fn relay(&self, plan: &CellPlan) -> Option<Ask> {
        let has_failed = self.failed_relay_epoch.load(Ordering::Relaxed) == plan.plan_epoch;
        let relay = plan.relay_of(&self.node_name).filter(|_| !has_failed)?;
        let image_indices = (0..plan.image_count() as u32).collect();
        let share = SamplerShare { node_name: relay.node_name.clone(), address: relay.address.clone(), image_indices };
        Some(Ask { share, answer_within: RELAY_PATIENCE, first_within: RELAY_PATIENCE })
    }

    fn asks(&self, plan: &CellPlan, set_index: u32, have: &[Option<DepthImage>]) -> Vec<Ask> {
        let ask = |share: &SamplerShare| {
            let is_missing = |index: &u32| have.get(*index as usize).is_some_and(Option::is_none);
            let image_indices = share.image_indices.iter().copied().filter(is_missing).collect();
            let Deadlines { work, chunk, .. } = self.deadlines;
            let share = SamplerShare { image_indices, ..share.clone() };
            Ask { share, answer_within: work, first_within: chunk }
        };
        let asks = plan.samplers_of(set_index).iter().map(ask);
        asks.filter(|ask| !ask.share.image_indices.is_empty()).collect()
    }

    async fn fetch_all(
        self: &Arc<Self>,
        plan: &CellPlan,
        set_index: u32,
        asks: Vec<Ask>,
        passing: Option<&Passing>,
    ) -> Result<Vec<(Images, Took)>, NotFetched> {
        let mut fetches = JoinSet::new();
        for ask in asks {
            let (fetcher, plan, passing) = (self.clone(), plan.clone(), passing.cloned());
            fetches.spawn(async move {
                let images = fetcher.fetch_again(&plan, set_index, &ask, passing.as_ref()).await;
                images.map_err(|status| not_fetched(ask.share, &status))
            });
        }
        let mut all = Vec::new();
        while let Some(share) = fetches.join_next().await {
            all.push(share.map_err(|error| Status::internal(error.to_string()))??);
        }
        Ok(all)
    }

    /// A share, asked for again where a fault may have been the network's.
    async fn fetch_again(
        &self,
        plan: &CellPlan,
        set_index: u32,
        ask: &Ask,
        passing: Option<&Passing>,
    ) -> Result<(Images, Took), Status> {
        for pause in PAUSES {
            let start = Instant::now();
            match self.fetch_share(plan, set_index, ask, passing).await {
                Err(status) if may_pass(&status, start.elapsed()) => tokio::time::sleep(pause).await,
                done => return done,
            }
        }
        self.fetch_share(plan, set_index, ask, passing).await
    }

    async fn fetch_share(
        &self,
        plan: &CellPlan,
        set_index: u32,
        ask: &Ask,
        passing: Option<&Passing>,
    ) -> Result<(Images, Took), Status> {
        let share = &ask.share;
        let id = SampleSetId { plan_epoch: plan.plan_epoch, index: set_index.into() };
        let mut incoming = Incoming::new(self.call(plan, id, ask).await?, ask.first_within, self.deadlines.chunk);
        let mut reassembler = Reassembler::new(DecodeLimits::default(), id);
        let cameras = plan.sampled_cameras();
        let (mut images, mut decode_s) = (Vec::new(), 0.0);
        while let Some(chunk) = incoming.next().await? {
            let Some(whole) =
                reassembler.push(chunk).map_err(|error| Status::data_loss(format!("chunk is corrupt: {error}")))?
            else {
                continue;
            };
            check(&whole, id, share, &images)?;
            let (index, encoded) = (whole.image_index, whole.image.clone());
            let start = Instant::now();
            let image = decode(&cameras, whole).await?;
            decode_s += start.elapsed().as_secs_f64();
            check_visibility(plan, index, &image)?;
            passing.into_iter().for_each(|passing| passing.add(index, encoded.clone()));
            images.push((index, image));
        }
        if images.len() < share.image_indices.len() {
            let (came, wanted) = (images.len(), share.image_indices.len());
            return Err(Status::data_loss(format!("{came} images came of {wanted}")));
        }
        Ok((images, Took { decode_s, transfer_s: incoming.transfer_s, bytes: incoming.bytes }))
    }

    async fn call(&self, plan: &CellPlan, id: SampleSetId, ask: &Ask) -> Result<Messages<Chunk>, Status> {
        let client = SamplerClient::new(self.connections.to(&ask.share.address).await?);
        let image_indices = ask.share.image_indices.clone();
        let SampleSetId { plan_epoch, index } = id;
        let request = FetchImages { plan_epoch, set_index: index as u32, cell: plan.cell(), image_indices };
        let answer = tokio::time::timeout(ask.answer_within, client.fetch_sample_images(request)).await;
        answer.map_err(|_| Status::deadline_exceeded("no images in time"))?
    }
}

fn not_fetched(share: SamplerShare, status: &Status) -> NotFetched {
    let text = format!("sampler {} at {}: {}", share.node_name, share.address, status.message());
    // A refusal says which plan is in force: this node may not hear the coordinator, nor may its client.
    let status = Status::with_metadata(status.code(), text, status.metadata().clone());
    NotFetched { sampler: Some(share.node_name), status }
}

fn may_pass(status: &Status, took: Duration) -> bool {
    let network = [Code::Unavailable, Code::Unknown, Code::Internal, Code::Cancelled, Code::OutOfRange];
    status.code() == Code::DataLoss || (network.contains(&status.code()) && took < SOON)
}

fn keep(images: &mut [Option<DepthImage>], took: &mut Took, came: Vec<(Images, Took)>) {
    for (of_one, took_one) in came {
        took.add(took_one);
        for (index, image) in of_one {
            images[index as usize] = Some(image);
        }
    }
}

#[cfg(test)]
#[path = "fetch_tests.rs"]
mod tests;
