//! Chunks from a sampler, and the images that are checked and decoded from them.

use std::time::{Duration, Instant};

use cluster::{Assignment, SamplerShare};
use codec::{Chunk, DecodeLimits, Reassembled, SampleSetId, decode_depth_image};
use depth_image::{Camera, DepthImage, SpecularPlanes};
use node::{CellPlan, blocking, next_within};
use tonic::Status;
use wire::rpc::Messages;

/// The chunks of one call, and the time spent waiting for them after the first.
pub(crate) struct ChunkStream {
    chunks: Messages<Chunk>,
    first_within: Option<Duration>,
    chunk_within: Duration,
    pub(crate) transfer_s: f64,
    pub(crate) bytes: usize,
}

impl ChunkStream {
    pub(crate) fn new(chunks: Messages<Chunk>, first_within: Duration, chunk_within: Duration) -> Self {
        Self { chunks, first_within: Some(first_within), chunk_within, transfer_s: 0.0, bytes: 0 }
    }

    pub(crate) async fn next(&mut self) -> Result<Option<Chunk>, Status> {
        let (start, first_within) = (Instant::now(), self.first_within.take());
        let within = first_within.unwrap_or(self.chunk_within);
        let chunk = next_within(&mut self.chunks, within, "chunks").await?;
        if first_within.is_none() {
            self.transfer_s += start.elapsed().as_secs_f64();
            self.bytes += chunk.as_ref().map_or(0, Chunk::data_len);
        }
        Ok(chunk)
    }
}

/// Checks that an image belongs to the set, was requested and is new.
pub(crate) fn check_image(
    whole: &Reassembled,
    id: SampleSetId,
    share: &SamplerShare,
    have: &[(u32, DepthImage)],
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

/// Checks the planes of visibility. Highlights find a light's visibility by its place: there is a byte for every light, or
/// none at all.
pub(crate) fn check_visibility(plan: &Assignment, index: u32, image: &DepthImage) -> Result<(), Status> {
    let lights = plan.workload.illumination.lights.len();
    let planes = image.specular.as_ref().map_or(0, |specular| specular.visibility8.len());
    if planes == 0 || planes == SpecularPlanes::visibility_planes(lights) {
        return Ok(());
    }
    Err(Status::data_loss(format!("image {index} has {planes} planes of visibility for {lights} lights")))
}

pub(crate) async fn decode(cameras: &[Camera], whole: Reassembled) -> Result<DepthImage, Status> {
    let camera = cameras.get(whole.image_index as usize).copied();
    let camera = camera.ok_or_else(|| Status::data_loss(format!("image {} has no camera", whole.image_index)))?;
    let decode =
        move || decode_depth_image(&whole.image.header, camera, &whole.image.payload, &DecodeLimits::default());
    blocking(move || decode().map_err(|error| Status::data_loss(error.to_string()))).await
}

/// The images of a set from those that were sampled: the same, or joined from tiles.
pub(crate) async fn join_tiles(plan: &CellPlan, sampled: Vec<DepthImage>) -> Result<Vec<DepthImage>, Status> {
    if plan.tile_count == 1 {
        return Ok(sampled);
    }
    let plan = plan.clone();
    blocking(move || {
        let mut sampled = sampled.into_iter();
        let mut joined = |camera: &Camera| {
            let tiles = sampled.by_ref().take(plan.tile_count as usize).collect();
            DepthImage::from_tiles(*camera, tiles).map_err(|error| Status::data_loss(error.to_string()))
        };
        plan.workload.sample_cameras.iter().map(&mut joined).collect()
    })
    .await
}
