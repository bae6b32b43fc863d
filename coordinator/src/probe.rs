//! Probes: whether a node serves, and whether a sampler's images arrive whole.

use std::sync::Arc;

use cluster::FetchImages;
use codec::{DecodeLimits, Reassembler, SampleSetId, decode_sample_image};
use node::blocking;
use tokio_stream::StreamExt as _;
use tonic::{Code, Status};
use wire::rpc::{Backoff, SamplerClient, is_serving};

use crate::grpc_status::within;
use crate::schedule::{Event, Probe, ProbedImage};
use crate::shared::Shared;

/// A single failure may be the network's.
const ATTEMPTS: usize = 3;

/// Probes a node and tells the schedule.
pub(crate) async fn probe(shared: Arc<Shared>, probe: Probe) {
    let failed = within(probe.deadline, "an answer", attempts(&shared, &probe)).await.err();
    let failure = failed.map(|status| match &probe.image {
        None => format!("at {} does not answer: {}", probe.address, status.message()),
        Some(_) => status.message().to_owned(),
    });
    let kind = probe.kind();
    let Probe { plan_epoch, node_name, incarnation, .. } = probe;
    shared.step(Event::Probed { plan_epoch, node_name, incarnation, kind, failure });
}

async fn attempts(shared: &Shared, probe: &Probe) -> Result<(), Status> {
    let mut backoff = Backoff::reconnect();
    for _ in 1..ATTEMPTS {
        if attempt(shared, probe).await.is_ok() {
            return Ok(());
        }
        tokio::time::sleep(backoff.next_delay()).await;
    }
    attempt(shared, probe).await
}

async fn attempt(shared: &Shared, probe: &Probe) -> Result<(), Status> {
    if let Some(image) = &probe.image {
        return check_image(shared, &probe.address, image).await;
    }
    // A node without a health service, or with too much work, answers as well.
    let served = [Code::Unimplemented, Code::NotFound, Code::ResourceExhausted];
    match is_serving(&probe.address, "").await {
        Err(status) if !served.contains(&status.code()) => Err(status),
        _ => Ok(()),
    }
}

/// Fetches an image and decodes it, as a compositor does.
async fn check_image(shared: &Shared, address: &str, image: &ProbedImage) -> Result<(), Status> {
    let FetchImages { plan_epoch, set_index, image_indices, .. } = &image.request;
    let id = SampleSetId { plan_epoch: *plan_epoch, index: u64::from(*set_index) };
    let client = SamplerClient::new(shared.connections.to(address).await?);
    let mut chunks = client.fetch_sample_images(image.request.clone()).await?;
    let mut reassembler = Reassembler::new(DecodeLimits::default(), id);
    while let Some(chunk) = chunks.next().await {
        if let Some(whole) = reassembler.push(chunk?).map_err(data_loss)? {
            if whole.sample_set_id != id || !image_indices.contains(&whole.image_index) {
                let got = whole.image_index;
                let set = whole.sample_set_id;
                return Err(Status::data_loss(format!("image {got} of sample set {set} came for {id}")));
            }
            let camera = image.camera;
            let limits = DecodeLimits::default();
            return blocking(move || {
                let image = decode_sample_image(&whole.image.header, &camera, &whole.image.payload, &limits);
                image.map(drop).map_err(data_loss)
            })
            .await;
        }
    }
    Err(Status::data_loss("no whole image came"))
}

fn data_loss(error: impl ToString) -> Status {
    Status::data_loss(error.to_string())
}
