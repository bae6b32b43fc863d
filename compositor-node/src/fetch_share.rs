//! One node's share of a set's images: requested, received, checked and decoded.

use std::time::{Duration, Instant};

use cluster::{Assignment, FetchImages, SamplerShare};
use codec::{Chunk, DecodeLimits, Reassembled, Reassembler, SampleSetId, decode_sample_image};
use depth_image::{LightPlanes, SampleImage, SpecularPlanes};
use node::{CellPlan, Connections, blocking, next_within};
use tonic::{Code, Status};
use wire::rpc::{Backoff, Messages, SamplerClient};

use crate::relay_buffer::RelayBuffer;

/// Retries of a sampler, for images that it has already made.
const MAX_RETRIES: usize = 2;
const BACKOFF: Backoff = Backoff::new(Duration::from_millis(50), 4, Duration::from_millis(200));
/// A call that failed later than this is not repeated: it would fail as late again.
const FAILED_SOON: Duration = Duration::from_secs(2);

/// A set to fetch.
#[derive(Debug, Clone)]
pub(crate) struct SetRequest {
    pub(crate) plan: CellPlan,
    pub(crate) set_index: u32,
    /// Images go to it as they arrive.
    pub(crate) relay: Option<RelayBuffer>,
}

/// The share to fetch from one node, and the deadlines of its answer.
#[derive(Debug, Clone)]
pub(crate) struct ShareRequest {
    pub(crate) share: SamplerShare,
    /// The time until the answer.
    pub(crate) answer_within: Duration,
    /// The time from the answer to the first chunk: a sampler samples in between.
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
#[derive(Debug)]
pub(crate) struct FetchedShare {
    pub(crate) images: Vec<(u32, SampleImage)>,
    pub(crate) times: FetchTimes,
}

/// Fetches a share, again where a fault may have been the network's.
pub(crate) async fn fetch_share(
    connections: &Connections,
    set: &SetRequest,
    request: &ShareRequest,
) -> Result<FetchedShare, Status> {
    let mut backoff = BACKOFF;
    for _ in 0..MAX_RETRIES {
        let start = Instant::now();
        match fetch_once(connections, set, request).await {
            Err(status) if is_transient(&status, start.elapsed()) => {
                tokio::time::sleep(backoff.next_delay()).await;
            }
            done => return done,
        }
    }
    fetch_once(connections, set, request).await
}

fn is_transient(status: &Status, after: Duration) -> bool {
    let network = [Code::Unavailable, Code::Unknown, Code::Internal, Code::Cancelled, Code::OutOfRange];
    status.code() == Code::DataLoss || (network.contains(&status.code()) && after < FAILED_SOON)
}

async fn fetch_once(
    connections: &Connections,
    set: &SetRequest,
    request: &ShareRequest,
) -> Result<FetchedShare, Status> {
    let plan = &set.plan;
    let share = &request.share;
    let id = SampleSetId { plan_epoch: plan.plan_epoch, index: set.set_index.into() };
    let mut chunks = call(connections, set, request).await?;
    let mut reassembler = Reassembler::new(DecodeLimits::default(), id);
    let cameras = plan.sampled_cameras();
    let mut images = Vec::new();
    while let Some(chunk) = chunks.next().await? {
        let pushed = reassembler.push(chunk);
        let Some(whole) = pushed.map_err(|error| Status::data_loss(format!("chunk is corrupt: {error}")))? else {
            continue;
        };
        check_image(&whole, id, share, &images)?;
        let index = whole.image_index;
        let encoded = whole.image.clone();
        let start = Instant::now();
        let camera = cameras.get(index as usize).copied();
        let camera = camera.ok_or_else(|| Status::data_loss(format!("image {index} has no camera")))?;
        let decoding = blocking(move || {
            decode_sample_image(&whole.image.header, &camera, &whole.image.payload, &DecodeLimits::default())
                .map_err(|error| Status::data_loss(error.to_string()))
        });
        let image = decoding.await?;
        chunks.times.decode_s += start.elapsed().as_secs_f64();
        check_planes(plan, index, &image)?;
        set.relay.iter().for_each(|relay| relay.add(index, encoded.clone()));
        images.push((index, image));
    }
    if images.len() < share.image_indices.len() {
        let received = images.len();
        let requested = share.image_indices.len();
        return Err(Status::data_loss(format!("{received} of {requested} images were received")));
    }
    Ok(FetchedShare { images, times: chunks.times })
}

async fn call(connections: &Connections, set: &SetRequest, request: &ShareRequest) -> Result<ChunkStream, Status> {
    let client = SamplerClient::new(connections.to(&request.share.address).await?);
    let images = FetchImages {
        plan_epoch: set.plan.plan_epoch,
        workload_number: set.plan.workload_number,
        set_index: set.set_index,
        cell: set.plan.cell,
        image_indices: request.share.image_indices.clone(),
    };
    let answer = tokio::time::timeout(request.answer_within, client.fetch_sample_images(images)).await;
    let chunks = answer.map_err(|_| Status::deadline_exceeded("no images in time"))??;
    let &ShareRequest { first_within, chunk_within, .. } = request;
    Ok(ChunkStream { chunks, first_within: Some(first_within), chunk_within, times: FetchTimes::default() })
}

/// The chunks of one call, and their times.
struct ChunkStream {
    chunks: Messages<Chunk>,
    first_within: Option<Duration>,
    chunk_within: Duration,
    times: FetchTimes,
}

impl ChunkStream {
    async fn next(&mut self) -> Result<Option<Chunk>, Status> {
        let start = Instant::now();
        let first_within = self.first_within.take();
        let within = first_within.unwrap_or(self.chunk_within);
        let chunk = next_within(&mut self.chunks, within, "chunks").await?;
        if first_within.is_none() {
            self.times.transfer_s += start.elapsed().as_secs_f64();
            self.times.bytes += chunk.as_ref().map_or(0, Chunk::data_len);
        }
        Ok(chunk)
    }
}

/// Checks that an image belongs to the set, was requested and is new.
fn check_image(
    whole: &Reassembled,
    id: SampleSetId,
    share: &SamplerShare,
    have: &[(u32, SampleImage)],
) -> Result<(), Status> {
    let index = whole.image_index;
    if whole.sample_set_id != id {
        return Err(Status::data_loss(format!("an image of sample set {} was sent for {id}", whole.sample_set_id)));
    }
    if !share.image_indices.contains(&index) || have.iter().any(|(other, _)| *other == index) {
        return Err(Status::data_loss(format!("image {index} was not requested, or was sent twice")));
    }
    Ok(())
}

/// Checks that images have light in place of colour where the plan says so, and nowhere else. A lamp's visibility, and its
/// share of the light, are found by its place: there are planes for all lamps, or none at all.
fn check_planes(plan: &Assignment, index: u32, image: &SampleImage) -> Result<(), Status> {
    let lights = plan.workload.illumination.lights.len();
    let visibilities = image.specular().map_or(0, |specular| specular.visibility8.len());
    let light = match image {
        SampleImage::Depth(image) => image.light.as_ref(),
        SampleImage::Layered(_) | SampleImage::LightField(_) => None,
    };
    let shares = light.map_or(0, |light| light.share8.len());
    let fault = if ![0, SpecularPlanes::visibility_planes(lights)].contains(&visibilities) {
        format!("{visibilities} planes of visibility for {lights} lights")
    } else if light.is_some() && !plan.workload.planes.light {
        "light where colour is needed".to_owned()
    } else if light.is_none() && plan.workload.planes.light {
        "colour where light is needed".to_owned()
    } else if ![0, LightPlanes::share_planes(lights)].contains(&shares) {
        format!("{shares} planes of shares for {lights} lamps")
    } else {
        return Ok(());
    };
    Err(Status::data_loss(format!("image {index} has {fault}")))
}
