//! The device's loop: batch by batch, while the frames of the batch before are encoded and sent.

use std::sync::Arc;
use std::thread::available_parallelism;
use std::time::Instant;

use codec::{StageTimes, encode_view};
use depth_image::View;
use node::{DirectWork, Engine, NodeMetrics, Operation, ViewWork, blocking};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tonic::Status;

use crate::arrivals::Arrivals;
use crate::batch::{Source, Waiting};
use crate::outbox::Output;

/// Batches that are being encoded while the device makes the next.
const BATCHES_BEHIND: usize = 2;

/// Runs until it is aborted.
pub(crate) async fn render_loop(engine: Arc<dyn Engine>, arrivals: Arc<Arrivals>, metrics: NodeMetrics) {
    let encoders = Arc::new(Semaphore::new(available_parallelism().map_or(1, usize::from)));
    let behind = Arc::new(Semaphore::new(BATCHES_BEHIND));
    loop {
        // Before the batch is chosen: views that arrive while frames wait for encoders are newer.
        let Ok(place) = behind.clone().acquire_owned().await else {
            return;
        };
        let mut batch = arrivals.next_batch().await;
        batch.retain(|view| still_wanted(view, &metrics));
        if !batch.is_empty() {
            render(&engine, batch, encoders.clone(), place, &metrics).await;
        }
    }
}

fn still_wanted(view: &Waiting, metrics: &NodeMetrics) -> bool {
    let wanted = !view.reply.outbox().is_gone();
    if !wanted {
        metrics.drop_view("client gone");
    }
    wanted
}

async fn render(
    engine: &Arc<dyn Engine>,
    batch: Vec<Waiting>,
    encoders: Arc<Semaphore>,
    place: OwnedSemaphorePermit,
    metrics: &NodeMetrics,
) {
    let start = Instant::now();
    match make(engine, &batch).await {
        Ok(views) => {
            let batch_s = start.elapsed().as_secs_f64();
            metrics.done.add(operation(&batch), batch.len() as f64, batch_s);
            metrics.views.inc_by(batch.len() as u64);
            for view in &batch {
                metrics.view_s.observe(batch_s / batch.len() as f64);
                metrics.queue_s.observe(start.saturating_duration_since(view.waits.queued).as_secs_f64());
            }
            tokio::spawn(encode_all(batch, views, (start, batch_s), encoders, place, metrics.clone()));
        }
        Err(status) => {
            for view in batch {
                metrics.drop_view("device failed");
                view.reply.send(Err(status.clone()));
            }
        }
    }
}

fn operation(batch: &[Waiting]) -> Operation {
    match batch.first().map(|view| &view.source) {
        Some(Source::Scene { .. }) => Operation::DirectView,
        _ => Operation::ReconstructView,
    }
}

async fn make(engine: &Arc<dyn Engine>, batch: &[Waiting]) -> Result<Vec<View>, Status> {
    let Some(first) = batch.first() else {
        return Ok(Vec::new());
    };
    let (engine, source, key) = (engine.clone(), first.source.clone(), first.key.clone());
    let cameras: Vec<_> = batch.iter().map(|waiting| waiting.view.camera).collect();
    let count = cameras.len();
    let views = blocking(move || match source {
        Source::Set(set) => {
            engine.reconstruct(set.set.as_ref(), &ViewWork { cameras, method: key.method, planes: key.planes })
        }
        Source::Scene { scene_hash, lighting, scene_time_s } => {
            engine.draw_direct(&DirectWork { scene_hash, cameras, lighting, scene_time_s, planes: key.planes })
        }
    })
    .await?;
    if views.len() == count {
        Ok(views)
    } else {
        Err(Status::internal(format!("{} views were made for {count} cameras", views.len())))
    }
}

async fn encode_all(
    batch: Vec<Waiting>,
    views: Vec<View>,
    (start, batch_s): (Instant, f64),
    encoders: Arc<Semaphore>,
    place: OwnedSemaphorePermit,
    metrics: NodeMetrics,
) {
    let count = batch.len();
    let mut encodings = tokio::task::JoinSet::new();
    for (waiting, view) in batch.into_iter().zip(views) {
        let Ok(encoder) = encoders.clone().acquire_owned().await else {
            return;
        };
        let times = stage_times(&waiting, start, batch_s, count);
        let metrics = metrics.clone();
        encodings.spawn(async move {
            encode_and_send(waiting, view, times, &metrics).await;
            drop(encoder);
        });
    }
    while encodings.join_next().await.is_some() {}
    drop(place);
}

/// The stage times of a view in a batch of `count` views that was begun at `start`.
fn stage_times(waiting: &Waiting, start: Instant, batch_s: f64, count: usize) -> StageTimes {
    let times = StageTimes {
        set_wait_s: waiting.waits.set_wait_s,
        credit_wait_s: waiting.waits.credit_wait_s(),
        queue_s: start.saturating_duration_since(waiting.waits.queued).as_secs_f64(),
        batch_s,
        reconstruct_s: batch_s / count as f64,
        set_age_s: waiting.source.age_s(start),
        batch_count: count as u32,
        ..StageTimes::default()
    };
    let (stream, frame) = (waiting.reply.stream(), waiting.view.frame);
    let StageTimes { queue_s, batch_count, .. } = times;
    tracing::debug!(stream, frame, set = %waiting.key.sample_set_id, queue_s, batch_s, batch_count, "reconstructed");
    times
}

async fn encode_and_send(waiting: Waiting, view: View, mut times: StageTimes, metrics: &NodeMetrics) {
    let Waiting { key, view: requested, codec, waits, reply, credit, .. } = waiting;
    let encoded = blocking(move || {
        let start = Instant::now();
        let encoded = encode_view(&view, codec).map_err(|error| Status::internal(format!("encoding: {error}")))?;
        Ok::<_, Status>((encoded, start.elapsed().as_secs_f64()))
    });
    let output = encoded.await.map(|(encoded, encode_s)| {
        times.encode_s = encode_s;
        metrics.done.add(Operation::EncodeView, 1.0, encode_s);
        metrics.frame_bytes.inc_by(encoded.data.len() as u64);
        let header = encoded.header(key.sample_set_id, requested.camera, times);
        Output { frame: requested.frame, header, data: encoded.data, arrived: waits.arrived, credit }
    });
    reply.send(output);
}
