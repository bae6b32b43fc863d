//! The size of a sample image, and the time that its transfer takes.

use std::time::Instant;

use anyhow::Context as _;
use cluster::{Assignment, FetchImages};
use codec::ChunkBody;
use tokio_stream::StreamExt as _;
use wire::rpc::{SamplerClient, connect};

/// Images of one set, fetched as a compositor fetches them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fetched {
    /// Bytes of one encoded image, B.
    pub image_bytes: f64,
    /// Seconds an image from the request to the last byte; chunks are checked, not decoded.
    pub image_s: f64,
}

/// Fetches the first sampler's images of a set that has been sampled already.
///
/// # Errors
/// The sampler fails.
pub async fn fetch(plan: &Assignment, set_index: u32) -> anyhow::Result<Fetched> {
    let share = plan.samplers_of(set_index).first().context("nobody samples")?;
    let client = SamplerClient::new(connect(&share.address).await?);
    let image_indices = share.image_indices.clone();
    let images = image_indices.len().max(1) as f64;
    let start = Instant::now();
    let request = FetchImages {
        plan_epoch: plan.plan_epoch,
        workload_number: plan.workload_number,
        set_index,
        cell: 0,
        image_indices,
    };
    let mut chunks = client.fetch_sample_images(request).await?;
    let mut bytes = 0;
    while let Some(chunk) = chunks.next().await {
        if let ChunkBody::Data(data) = chunk?.body {
            bytes += data.len();
        }
    }
    Ok(Fetched { image_bytes: bytes as f64 / images, image_s: start.elapsed().as_secs_f64() / images })
}
