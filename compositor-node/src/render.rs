//! The device's loop: batch by batch, while the frames of the batch before are encoded and sent.

use std::collections::VecDeque;
use std::sync::Arc;
use std::thread::available_parallelism;
use std::time::Instant;

use depth_image::View;
use node::{DirectWork, Engine, NodeMetrics, ViewWork, blocking};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tonic::Status;
use wire::{FramePart, StageTimes, encode_view};

use crate::batch::{Source, Waiting, take_batch};
use crate::output::Output;

/// Batches whose frames are being encoded while the device makes the next.
const BATCHES_BEHIND: usize = 2;

/// Runs until every sender is gone.
pub(crate) async fn render_loop(
    engine: Arc<dyn Engine>,
    mut arrivals: mpsc::Receiver<Vec<Waiting>>,
    metrics: NodeMetrics,
) {
    let encoders = Arc::new(Semaphore::new(available_parallelism().map_or(1, usize::from)));
    let behind = Arc::new(Semaphore::new(BATCHES_BEHIND));
    let mut waiting = VecDeque::new();
    loop {
        if waiting.is_empty() {
            let Some(views) = arrivals.recv().await else { return };
            waiting.extend(views);
        }
        // Bounded: every view that waits holds a credit of its stream.
        while let Ok(views) = arrivals.try_recv() {
            waiting.extend(views);
        }
        waiting.retain(|view| still_wanted(view, &metrics));
        let batch = take_batch(&mut waiting, |view: &Waiting| &view.key);
        if batch.is_empty() {
            continue;
        }
        let Ok(place) = behind.clone().acquire_owned().await else {
            return;
        };
        render(&engine, batch, encoders.clone(), place, &metrics).await;
    }
}

fn still_wanted(view: &Waiting, metrics: &NodeMetrics) -> bool {
    let wanted = !view.reply.is_closed();
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
            let reconstruct_s = start.elapsed().as_secs_f64() / batch.len() as f64;
            metrics.views.inc_by(batch.len() as u64);
            for view in &batch {
                metrics.view_s.observe(reconstruct_s);
                metrics.queue_s.observe(start.saturating_duration_since(view.since).as_secs_f64());
            }
            tokio::spawn(encode_all(batch, views, (start, reconstruct_s), encoders, place, metrics.clone()));
        }
        Err(status) => {
            for view in batch {
                metrics.drop_view("device failed");
                // Full or gone: then the stream has ended already.
                let _ = view.reply.try_send(Err(status.clone()));
            }
        }
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
            engine.reconstruct(set.as_ref(), &ViewWork { cameras, method: key.method, planes: key.planes })
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
    (start, reconstruct_s): (Instant, f64),
    encoders: Arc<Semaphore>,
    place: OwnedSemaphorePermit,
    metrics: NodeMetrics,
) {
    let batch_count = batch.len() as u32;
    let mut encodings = tokio::task::JoinSet::new();
    for (waiting, view) in batch.into_iter().zip(views) {
        let Ok(encoder) = encoders.clone().acquire_owned().await else {
            return;
        };
        let queue_s = start.saturating_duration_since(waiting.since).as_secs_f64();
        let times = StageTimes { set_wait_s: waiting.set_wait_s, queue_s, reconstruct_s, encode_s: 0.0, batch_count };
        let metrics = metrics.clone();
        encodings.spawn(async move {
            encode_and_send(waiting, view, times, &metrics).await;
            drop(encoder);
        });
    }
    while encodings.join_next().await.is_some() {}
    drop(place);
}

async fn encode_and_send(waiting: Waiting, view: View, mut times: StageTimes, metrics: &NodeMetrics) {
    let Waiting { key, view: requested, codec, reply, credit, .. } = waiting;
    let encoded = blocking(move || {
        let start = Instant::now();
        let encoded = encode_view(&view, codec).map_err(|error| Status::internal(format!("encoding: {error}")))?;
        Ok::<_, Status>((encoded, start.elapsed().as_secs_f64()))
    });
    let output = encoded.await.map(|(encoded, encode_s)| {
        times.encode_s = encode_s;
        metrics.frame_bytes.inc_by(encoded.data.len() as u64);
        let header = encoded.header(key.sample_set_id, times);
        Output { parts: Box::new(FramePart::cut(requested.frame, header, encoded.data)), _credit: credit }
    });
    // The channel has room for every credit, so this waits for nobody; an error means a client that left.
    let _ = reply.send(output).await;
}
