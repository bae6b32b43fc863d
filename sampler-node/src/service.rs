//! The service that compositors fetch images from.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::{Assignment, FetchImages, SetContent};
use codec::{Chunk, EncodedImage, SampleSetId, encode_sample_image, split_into_chunks};
use depth_image::SampleImage;
use node::{
    ByteCache, CellPlan, Engine, EngineError, NodeMetrics, NodeParts, Operation, Pinned, Relay, SampleWork, Turn,
};
use node::{WorkClass, beyond_timeline, blocking, most_image_bytes, own_time, until_drained, with_guard};
use parking_lot::Mutex;
use tokio::sync::mpsc;
use tokio_stream::StreamExt as _;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Status, async_trait};
use wire::rpc::{Messages, Sampler};

/// Chunks of images that are not sent yet.
const CHUNKS_AHEAD: usize = 4;

/// The content of a set, the number of tiles of an image, and the indices of images or tiles. Without the plan: a static
/// scene is not sampled again for another.
type Key = (SetContent, u32, Vec<u32>);

/// Packed images with their indices.
type PackedImages = Vec<(u32, EncodedImage)>;

/// Sets of one workload are sampled in the order of their requests: the one that is needed next comes first. Workloads do
/// not wait for each other; the device shares itself among them.
#[derive(Debug, Default)]
struct Turns(Mutex<HashMap<u64, Arc<tokio::sync::Mutex<()>>>>);

impl Turns {
    fn of(&self, workload_number: u64) -> Arc<tokio::sync::Mutex<()>> {
        let mut turns = self.0.lock();
        // One that is held or waited for has more owners.
        turns.retain(|_, turn| Arc::strong_count(turn) > 1);
        turns.entry(workload_number).or_default().clone()
    }
}

/// The sampler's role.
pub struct SamplerService {
    node: Arc<NodeParts>,
    cache: ByteCache<Key, PackedImages>,
    turns: Turns,
    relay: Relay,
}

impl SamplerService {
    /// The service of a node, which relays the images of `relay`.
    #[must_use]
    pub fn new(node: Arc<NodeParts>, relay: Relay) -> Self {
        // The other half is for sets on the device.
        let cache = ByteCache::new("packed sample images", node.config.set_memory_bytes / 2);
        let cached = cache.clone();
        node.monitor.add_memory(move || cached.free());
        Self { node, cache, turns: Turns::default(), relay }
    }

    /// All of this node's images of a set, made for the first request in one submission.
    fn images(
        &self,
        plan: &Assignment,
        set_index: u32,
    ) -> Result<impl Future<Output = Result<Pinned<PackedImages>, Status>> + Send + 'static, Status> {
        let content = plan.set_content(set_index).ok_or_else(|| beyond_timeline(set_index))?;
        let indices = plan.images_of(&self.node.plans.node_name, set_index).to_vec();
        let work = sample_work(plan, &indices, set_index)?;
        let node = self.node.clone();
        let scene = plan.workload.scene.clone();
        let own: Vec<_> = indices.iter().filter_map(|&tile| work.camera_of_tile(tile)).collect();
        let most_bytes = most_image_bytes(&plan.workload.illumination, &own);
        let key = (content, plan.tile_count, indices);
        let tiles = f64::from(plan.tile_count);
        let number = plan.workload_number;
        let turn = self.turns.of(number);
        let make = async move {
            let _one = turn.lock().await;
            // A later plan may be in force by now: its sets must not wait for sets that no plan has any more.
            if !node.plans.have_set(&content, set_index) {
                return Err(Status::failed_precondition(format!("no plan in force has this set {set_index}")));
            }
            let sampled = node.on_device(&scene, move |engine| sample(engine, &work)).await?;
            let images = blocking(move || pack(&sampled, tiles, number, &node.metrics)).await?;
            let bytes = images.iter().map(|(_, image)| image.payload.len()).sum();
            Ok((images, bytes))
        };
        let cache = self.cache.clone();
        Ok(async move { cache.get(key, most_bytes, make).await })
    }

    /// The wanted ones of `images` as chunks. The stream begins before there are images: expensive light takes longer than a
    /// receiver waits for a stream that is silent.
    fn send(
        &self,
        plan: &CellPlan,
        request: FetchImages,
        images: impl Future<Output = Result<Images, Status>> + Send + 'static,
    ) -> Messages<Chunk> {
        let id = SampleSetId { plan_epoch: plan.plan_epoch, index: request.set_index.into() };
        let (send, chunks) = mpsc::channel(CHUNKS_AHEAD);
        let wanted = request.image_indices;
        // A receiver that takes no chunk for so long is cut off: it keeps images in memory.
        let stall = self.node.config.deadlines.stall;
        tokio::spawn(async move {
            let send_all = async {
                match images.await {
                    Ok(images) => send_chunks(images, id, &wanted, &send, stall).await,
                    Err(status) => drop(send.send_timeout(Err(status), stall).await),
                }
            };
            tokio::select! {
                () = send_all => (),
                () = send.closed() => (),
            }
        });
        until_drained(Box::pin(ReceiverStream::new(chunks)), self.node.shutdown.clone())
    }
}

#[async_trait]
impl Sampler for SamplerService {
    async fn fetch_sample_images(&self, request: FetchImages) -> Result<Messages<Chunk>, Status> {
        let plan =
            CellPlan::of(&self.node.plans.remembered(request.workload_number, request.plan_epoch)?, request.cell)?;
        let name = &self.node.plans.node_name;
        let own = plan.images_of(name, request.set_index);
        if let Some(index) = request.image_indices.iter().find(|index| !own.contains(index)) {
            if plan.relays(name) {
                let images = (self.relay)(&plan, request.set_index)?;
                return Ok(self.send(&plan, request, std::future::ready(Ok(images))));
            }
            return Err(Status::invalid_argument(format!("image_indices: {index} is not sampled by {name}")));
        }
        let images = self.images(&plan, request.set_index)?;
        let shared = async move {
            let images = images.await?;
            // Payloads are shared, and stay in the cache until all have been sent.
            let shared: Images = Box::pin(tokio_stream::iter((*images).clone()).map(Ok));
            Ok(with_guard(shared, images))
        };
        Ok(self.send(&plan, request, shared))
    }
}

/// Images with their indices, of this node or of others as they arrive.
type Images = Messages<(u32, EncodedImage)>;

/// Sends the wanted images as chunks, until all are sent, one fails, or the receiver takes none for too long.
async fn send_chunks(
    mut images: Images,
    id: SampleSetId,
    wanted: &[u32],
    send: &mpsc::Sender<Result<Chunk, Status>>,
    stall: Duration,
) {
    while let Some(image) = images.next().await {
        let chunks = match image {
            Ok((index, _)) if !wanted.contains(&index) => continue,
            Ok((index, image)) => split_into_chunks(id, index, image),
            Err(status) => {
                let _ = send.send_timeout(Err(status), stall).await;
                return;
            }
        };
        for chunk in chunks {
            if send.send_timeout(Ok(chunk), stall).await.is_err() {
                return;
            }
        }
    }
}

/// The work of sampling a set.
fn sample_work(plan: &Assignment, indices: &[u32], set_index: u32) -> Result<SampleWork, Status> {
    let workload = &plan.workload;
    if indices.iter().any(|&index| index as usize >= plan.image_count()) {
        return Err(Status::internal("image_indices beyond the sample cameras"));
    }
    Ok(SampleWork {
        tile_count: plan.tile_count,
        wanted: indices.to_vec(),
        scene_time_s: workload.timeline.time_s(set_index).ok_or_else(|| beyond_timeline(set_index))?,
        refinement: workload.refinement(set_index),
        ..SampleWork::of(workload)
    })
}

/// Images, or one tile of each.
struct Sampled {
    images: Vec<SampleImage>,
    camera_indices: Vec<u32>,
    duration_s: f64,
}

fn sample(engine: &dyn Engine, work: &SampleWork) -> Result<Sampled, EngineError> {
    let (images, duration_s) = own_time(engine, || engine.sample(work, Turn::of(WorkClass::Batch)));
    let scene_time_s = work.scene_time_s;
    let refinement_step = work.refinement.step;
    tracing::debug!(images = work.wanted.len(), scene_time_s, refinement_step, duration_s, "sampled");
    Ok(Sampled { images: images?, camera_indices: work.wanted.clone(), duration_s })
}

/// Encodes images and counts the work; an image has so many tiles.
fn pack(sampled: &Sampled, tiles: f64, workload_number: u64, metrics: &NodeMetrics) -> Result<PackedImages, Status> {
    let encoding = Instant::now();
    let Sampled { images, camera_indices, duration_s } = sampled;
    if images.len() != camera_indices.len() {
        let message = format!("{} images were sampled for {} cameras", images.len(), camera_indices.len());
        return Err(Status::internal(message));
    }
    let mut encoded = Vec::with_capacity(images.len());
    for (&index, image) in camera_indices.iter().zip(images) {
        encoded.push((index, encode_sample_image(image).map_err(|error| Status::internal(error.to_string()))?));
    }
    let whole_images = images.len() as f64 / tiles;
    let total_s = duration_s + encoding.elapsed().as_secs_f64();
    let image_s = total_s / whole_images.max(f64::MIN_POSITIVE);
    images.iter().for_each(|_| metrics.image_s.observe(image_s));
    metrics.images_sampled.inc_by(images.len() as u64);
    metrics.done.add(workload_number, Operation::SampleImage, whole_images, total_s);
    metrics.done.encoded(workload_number, whole_images, encoded.iter().map(|(_, image)| image.payload.len()).sum());
    Ok(encoded)
}
