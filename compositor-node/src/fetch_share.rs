//! One node's share of a set's images: requested, received, checked and decoded.

use std::time::{Duration, Instant};

use cluster::{FetchImages, SamplerShare};
use codec::{Chunk, DecodeLimits, Reassembler, SampleSetId};
use depth_image::DepthImage;
use node::{CellPlan, Connections};
use tonic::{Code, Status};
use wire::rpc::{Backoff, Messages, SamplerClient};

use crate::chunk_stream::{ChunkStream, check_image, check_visibility, decode};
use crate::relay_buffer::RelayBuffer;

/// Retries of a sampler, for images that it has already made.
const MAX_RETRIES: usize = 2;
const BACKOFF: Backoff = Backoff::new(Duration::from_millis(50), 4, Duration::from_millis(200));
/// A call that failed later than this is not repeated: it would fail as late again.
const FAILED_SOON: Duration = Duration::from_secs(2);

/// The share to fetch from one node, and the deadlines of its answer.
#[derive(Debug, Clone)]
pub(crate) struct ShareRequest {
    pub(crate) share: SamplerShare,
    /// The time until the answer: a sampler answers when it has sampled.
    pub(crate) answer_within: Duration,
    /// The time from the answer to the first chunk.
    pub(crate) first_within: Duration,
    /// The time between chunks.
    pub(crate) chunk_within: Duration,
}

/// The times of a fetch, and its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct FetchTimes {
    /// Decoding of all images.
    pub(crate) decode_s: f64,
    /// Waiting for the bytes after the first chunk.
    pub(crate) transfer_s: f64,
    /// The bytes that were waited for.
    pub(crate) bytes: usize,
}

impl FetchTimes {
    pub(crate) fn add(&mut self, other: Self) {
        self.decode_s += other.decode_s;
        self.transfer_s += other.transfer_s;
        self.bytes += other.bytes;
    }
}

/// The decoded images of a share, with their indices.
#[derive(Debug, Default)]
pub(crate) struct FetchedShare {
    pub(crate) images: Vec<(u32, DepthImage)>,
    pub(crate) times: FetchTimes,
}

/// Fetches a share, again where a fault may have been the network's. Images go to `relay` as they arrive.
pub(crate) async fn fetch_share(
    connections: &Connections,
    plan: &CellPlan,
    set_index: u32,
    request: &ShareRequest,
    relay: Option<&RelayBuffer>,
) -> Result<FetchedShare, Status> {
    let mut backoff = BACKOFF;
    for _ in 0..MAX_RETRIES {
        let start = Instant::now();
        match fetch_once(connections, plan, set_index, request, relay).await {
            Err(status) if is_transient(&status, start.elapsed()) => {
                tokio::time::sleep(backoff.next_delay()).await;
            }
            done => return done,
        }
    }
    fetch_once(connections, plan, set_index, request, relay).await
}

fn is_transient(status: &Status, after: Duration) -> bool {
    let network = [Code::Unavailable, Code::Unknown, Code::Internal, Code::Cancelled, Code::OutOfRange];
    status.code() == Code::DataLoss || (network.contains(&status.code()) && after < FAILED_SOON)
}

async fn fetch_once(
    connections: &Connections,
    plan: &CellPlan,
    set_index: u32,
    request: &ShareRequest,
    relay: Option<&RelayBuffer>,
) -> Result<FetchedShare, Status> {
    let share = &request.share;
    let id = SampleSetId { plan_epoch: plan.plan_epoch, index: set_index.into() };
    let chunks = call(connections, plan, set_index, request).await?;
    let mut chunks = ChunkStream::new(chunks, request.first_within, request.chunk_within);
    let mut reassembler = Reassembler::new(DecodeLimits::default(), id);
    let cameras = plan.sampled_cameras();
    let mut fetched = FetchedShare::default();
    while let Some(chunk) = chunks.next().await? {
        let pushed = reassembler.push(chunk);
        let Some(whole) = pushed.map_err(|error| Status::data_loss(format!("chunk is corrupt: {error}")))? else {
            continue;
        };
        check_image(&whole, id, share, &fetched.images)?;
        let (index, encoded) = (whole.image_index, whole.image.clone());
        let start = Instant::now();
        let image = decode(&cameras, whole).await?;
        fetched.times.decode_s += start.elapsed().as_secs_f64();
        check_visibility(plan, index, &image)?;
        relay.into_iter().for_each(|relay| relay.add(index, encoded.clone()));
        fetched.images.push((index, image));
    }
    if fetched.images.len() < share.image_indices.len() {
        let (received, requested) = (fetched.images.len(), share.image_indices.len());
        return Err(Status::data_loss(format!("{received} of {requested} images were received")));
    }
    (fetched.times.transfer_s, fetched.times.bytes) = (chunks.transfer_s, chunks.bytes);
    Ok(fetched)
}

async fn call(
    connections: &Connections,
    plan: &CellPlan,
    set_index: u32,
    request: &ShareRequest,
) -> Result<Messages<Chunk>, Status> {
    let client = SamplerClient::new(connections.to(&request.share.address).await?);
    let image_indices = request.share.image_indices.clone();
    let images = FetchImages { plan_epoch: plan.plan_epoch, set_index, cell: plan.cell(), image_indices };
    let answer = tokio::time::timeout(request.answer_within, client.fetch_sample_images(images)).await;
    answer.map_err(|_| Status::deadline_exceeded("no images in time"))?
}
