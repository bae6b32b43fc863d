//! One complete sample set, pulled from all its samplers at once.

use std::sync::Arc;

use depth_image::{DepthImage, SpecularPlanes};
use node::{Connections, Deadlines, SampleSet, blocking, next_within};
use tokio::task::JoinSet;
use tonic::Status;
use wire::rpc::SamplerClient;
use wire::{
    Assignment, DecodeLimits, FetchImages, Reassembled, Reassembler, SampleSetId, SamplerShare, WireError,
    decode_depth_image,
};

/// Fetches and decodes every image of a set.
pub(crate) async fn fetch_set(
    plan: &Arc<Assignment>,
    set_index: u32,
    connections: &Arc<Connections>,
    deadlines: Deadlines,
) -> Result<SampleSet, Status> {
    let mut fetches = JoinSet::new();
    for share in plan.samplers_of(set_index).iter().cloned() {
        let (plan, connections) = (plan.clone(), connections.clone());
        fetches.spawn(async move {
            let images = fetch_share(&plan, set_index, &share, &connections, deadlines).await;
            images.map_err(|status| {
                Status::new(
                    status.code(),
                    format!("sampler {} at {}: {}", share.node_name, share.address, status.message()),
                )
            })
        });
    }
    let mut images: Vec<Option<DepthImage>> = vec![None; plan.workload.sample_cameras.len()];
    while let Some(share) = fetches.join_next().await {
        for (index, image) in share.map_err(|error| Status::internal(error.to_string()))?? {
            images[index as usize] = Some(image);
        }
    }
    let complete = images
        .into_iter()
        .collect::<Option<_>>()
        .ok_or_else(|| Status::data_loss(format!("sample set {set_index} is not complete")))?;
    Ok(SampleSet {
        images: complete,
        volume: plan.workload.volume,
        background_linear: plan.workload.background_linear,
        illumination: plan.workload.illumination.clone(),
        lighting: plan.workload.lighting.clone(),
    })
}

async fn fetch_share(
    plan: &Arc<Assignment>,
    set_index: u32,
    share: &SamplerShare,
    connections: &Connections,
    deadlines: Deadlines,
) -> Result<Vec<(u32, DepthImage)>, Status> {
    let client = SamplerClient::new(connections.to(&share.address).await?);
    let request = FetchImages { plan_epoch: plan.plan_epoch, set_index, image_indices: share.image_indices.clone() };
    let answer = tokio::time::timeout(deadlines.work, client.fetch_sample_images(request)).await;
    let mut chunks = answer.map_err(|_| Status::deadline_exceeded("no images in time"))??;
    let id = SampleSetId { plan_epoch: plan.plan_epoch, index: set_index.into() };
    let mut reassembler = Reassembler::new(DecodeLimits::default(), id);
    let mut images = Vec::new();
    while let Some(chunk) = next_within(&mut chunks, deadlines.chunk, "chunks").await? {
        let Some(whole) = reassembler.push(chunk).map_err(WireError::from)? else {
            continue;
        };
        check(&whole, id, share, &images)?;
        let index = whole.image_index;
        let image = decode(plan, whole).await?;
        check_visibility(plan, index, &image)?;
        images.push((index, image));
    }
    if images.len() == share.image_indices.len() {
        Ok(images)
    } else {
        Err(Status::data_loss(format!("{} images came of {}", images.len(), share.image_indices.len())))
    }
}

fn check(whole: &Reassembled, id: SampleSetId, share: &SamplerShare, have: &[(u32, DepthImage)]) -> Result<(), Status> {
    let index = whole.image_index;
    if whole.sample_set_id != id {
        return Err(Status::data_loss(format!("an image of sample set {} came for {id}", whole.sample_set_id)));
    }
    if !share.image_indices.contains(&index) || have.iter().any(|(other, _)| *other == index) {
        return Err(Status::data_loss(format!("image {index} was not asked for, or came twice")));
    }
    Ok(())
}

/// Highlights find a light's visibility by its place: there is a byte for every light, or none at all.
fn check_visibility(plan: &Assignment, index: u32, image: &DepthImage) -> Result<(), Status> {
    let lights = plan.workload.illumination.lights.len();
    let planes = image.specular.as_ref().map_or(0, |specular| specular.visibility8.len());
    if planes == 0 || planes == SpecularPlanes::visibility_planes(lights) {
        return Ok(());
    }
    Err(Status::data_loss(format!("image {index} has {planes} planes of visibility for {lights} lights")))
}

async fn decode(plan: &Arc<Assignment>, whole: Reassembled) -> Result<DepthImage, Status> {
    let camera = plan.workload.sample_cameras.get(whole.image_index as usize).copied();
    let camera = camera.ok_or_else(|| Status::data_loss(format!("image {} has no camera", whole.image_index)))?;
    let decode =
        move || decode_depth_image(&whole.image.header, camera, &whole.image.payload, &DecodeLimits::default());
    blocking(move || decode().map_err(|error| Status::data_loss(error.to_string()))).await
}

#[cfg(test)]
#[path = "fetch_tests.rs"]
mod tests;
