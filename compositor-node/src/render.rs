//! The device's loops, one for each lane: batch by batch, while the frames of the batch before are encoded and sent.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::available_parallelism;
use std::time::{Duration, Instant};

use codec::{StageTimes, encode_view};
use depth_image::{PinholeCamera, View};
use node::{DirectWork, Engine, EngineError, NodeMetrics, Operation, Turn, ViewWork, WorkClass, blocking, own_time};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tonic::Status;

use crate::auditor::Auditor;
use crate::batch::{BatchKey, Source, Waiting};
use crate::outbox::Output;
use crate::queue::{Arrivals, Lane};
use crate::view_times::ViewTimes;

/// Batches that are being encoded while the device makes the next.
const BATCHES_BEHIND: usize = 2;

/// The share of the time for previews: the rest is for the samples that they wait for.
const PREVIEW_SHARE: f64 = 0.5;

/// Makes views, and encodes them. Clones share the encoders.
#[derive(Clone)]
pub(crate) struct Rendering {
    times: Arc<ViewTimes>,
    encoders: Arc<Semaphore>,
    auditor: Arc<Auditor>,
}

impl Rendering {
    pub(crate) fn new(auditor: Arc<Auditor>, times: Arc<ViewTimes>) -> Self {
        let encoders = Arc::new(Semaphore::new(available_parallelism().map_or(1, usize::from)));
        Self { times, encoders, auditor }
    }

    /// Makes the views of one lane, until it is aborted.
    pub(crate) async fn run(self, arrivals: Arc<Arrivals>, lane: Lane) {
        let behind = Arc::new(Semaphore::new(BATCHES_BEHIND));
        // Lanes of a class share the device evenly: long views delay others by a slice each.
        let is_live = matches!(lane, Lane::Live | Lane::LongLive | Lane::Preview);
        let class = if is_live { WorkClass::Live } else { WorkClass::Batch };
        let turn = Turn { class, flow: Turn::next_flow() };
        loop {
            // Before the batch is chosen: views that arrive while frames wait for encoders are newer.
            let Ok(place) = behind.clone().acquire_owned().await else {
                return;
            };
            let mut batch = arrivals.next_batch(lane).await;
            batch.retain(|view| {
                let is_wanted = !view.reply.outbox().gone.is_cancelled();
                if !is_wanted {
                    self.auditor.node.metrics.drop_view("client gone");
                }
                is_wanted
            });
            if !batch.is_empty() {
                let served = arrivals.served.load(Ordering::Relaxed);
                let busy_s = self.render(turn, batch, place).await;
                if lane == Lane::Direct && arrivals.served.load(Ordering::Relaxed) > served {
                    tokio::time::sleep(pause(busy_s, self.auditor.node.config.direct_share)).await;
                } else if lane == Lane::Preview {
                    tokio::time::sleep(pause(busy_s, PREVIEW_SHARE)).await;
                }
            }
        }
    }

    /// Gives the seconds that the views had the device.
    async fn render(&self, turn: Turn, batch: Vec<Waiting>, place: OwnedSemaphorePermit) -> f64 {
        let start = Instant::now();
        let metrics = &self.auditor.node.metrics;
        match self.make(turn, &batch).await {
            Ok((operation, views, busy_s)) => {
                let batch_s = start.elapsed().as_secs_f64();
                let pixels = batch.iter().map(|view| view.view.camera.pixel_count()).sum();
                self.times.learn(Instant::now(), &batch[0].key.kind(), pixels, busy_s);
                if !batch[0].key.is_preview {
                    metrics.done.add(batch[0].key.workload_number, operation, batch.len() as f64, busy_s);
                }
                metrics.views.inc_by(batch.len() as u64);
                for view in &batch {
                    metrics.view_s.observe(batch_s / batch.len() as f64);
                    metrics.queue_s.observe(start.saturating_duration_since(view.queued).as_secs_f64());
                }
                self.auditor.note(&batch);
                tokio::spawn(self.clone().encode_all(batch, views, start, batch_s, place));
                busy_s
            }
            Err(status) => {
                for view in batch {
                    metrics.drop_view("device failed");
                    view.reply.send(Err(status.clone()));
                }
                0.0
            }
        }
    }

    /// Makes the views of a batch, which has one at least; with the seconds that they had the device.
    async fn make(&self, turn: Turn, batch: &[Waiting]) -> Result<(Operation, Vec<View>, f64), Status> {
        let source = batch[0].set.source.clone();
        let key = batch[0].key.clone();
        let cameras: Vec<_> = batch.iter().map(|waiting| waiting.view.camera).collect();
        let count = cameras.len();
        // The scene that surfaces, or all of the views, are drawn from.
        let (scene, operation) = match &source {
            Source::Sets(sets) => (sets.of_cell.scene.clone(), Operation::ReconstructView),
            Source::Scene { plan, .. } => (plan.workload.scene.clone(), Operation::DirectView),
        };
        let making = self.auditor.node.on_device(&scene, move |engine| {
            let (views, busy_s) = own_time(engine, || views_of(engine, &source, &key, &cameras, turn));
            Ok((views?, busy_s))
        });
        let (views, busy_s) = making.await?;
        if views.len() == count {
            Ok((operation, views, busy_s))
        } else {
            Err(Status::internal(format!("{} views were made for {count} cameras", views.len())))
        }
    }

    async fn encode_all(
        self,
        batch: Vec<Waiting>,
        views: Vec<View>,
        start: Instant,
        batch_s: f64,
        place: OwnedSemaphorePermit,
    ) {
        let count = batch.len();
        let mut encodings = tokio::task::JoinSet::new();
        for (waiting, view) in batch.into_iter().zip(views) {
            let Ok(encoder) = self.encoders.clone().acquire_owned().await else {
                return;
            };
            let times = stage_times(&waiting, start, batch_s, count);
            let metrics = self.auditor.node.metrics.clone();
            encodings.spawn(async move {
                encode_and_send(waiting, view, times, &metrics).await;
                drop(encoder);
            });
        }
        while encodings.join_next().await.is_some() {}
        drop(place);
    }
}

fn views_of(
    engine: &dyn Engine,
    source: &Source,
    key: &BatchKey,
    cameras: &[PinholeCamera],
    turn: Turn,
) -> Result<Vec<View>, EngineError> {
    match source {
        Source::Sets(sets) => {
            let work = ViewWork { cameras: cameras.to_vec(), method: key.method.clone(), planes: key.planes };
            engine.reconstruct(sets.on_device.as_ref(), &work, turn)
        }
        Source::Scene { plan, scene_time_s } => {
            let mut work = DirectWork::of(&plan.workload, cameras.to_vec(), key.planes);
            work.scene_time_s = *scene_time_s;
            if key.is_preview {
                work.lighting = engine.preview_lighting(&work.lighting)?;
            }
            engine.draw_direct(&work, turn)
        }
    }
}

/// The pause after work of `busy_s` that may take `share` of the time.
fn pause(busy_s: f64, share: f64) -> Duration {
    Duration::try_from_secs_f64(busy_s * (share.recip() - 1.0)).unwrap_or_default()
}

/// The stage times of a view in a batch of `count` views that was begun at `start`.
fn stage_times(waiting: &Waiting, start: Instant, batch_s: f64, count: usize) -> StageTimes {
    let times = StageTimes {
        set_wait_s: waiting.set.wait_s,
        credit_wait_s: (waiting.queued.saturating_duration_since(waiting.arrived).as_secs_f64() - waiting.set.wait_s)
            .max(0.0),
        queue_s: start.saturating_duration_since(waiting.queued).as_secs_f64(),
        batch_s,
        reconstruct_s: batch_s / count as f64,
        set_age_s: match &waiting.set.source {
            Source::Sets(sets) => start.saturating_duration_since(sets.of_cell.since).as_secs_f64(),
            Source::Scene { .. } => 0.0,
        },
        batch_count: count as u32,
        ..StageTimes::default()
    };
    let stream = waiting.reply.outbox().stream;
    let frame = waiting.view.frame;
    let StageTimes { queue_s, batch_count, .. } = times;
    tracing::debug!(stream, frame, set = %waiting.key.sample_set_id, queue_s, batch_s, batch_count, "reconstructed");
    times
}

async fn encode_and_send(waiting: Waiting, view: View, mut times: StageTimes, metrics: &NodeMetrics) {
    let Waiting { key, set, view: requested, codec, arrived, reply, credit, .. } = waiting;
    let encoded = blocking(move || {
        let start = Instant::now();
        let encoded = encode_view(&view, codec).map_err(|error| Status::internal(format!("encoding: {error}")))?;
        Ok::<_, Status>((encoded, start.elapsed().as_secs_f64()))
    });
    let output = encoded.await.map(|(encoded, encode_s)| {
        times.encode_s = encode_s;
        metrics.done.add(key.workload_number, Operation::EncodeView, 1.0, encode_s);
        metrics.frame_bytes.inc_by(encoded.data.len() as u64);
        let place = set.place;
        let header =
            encoded.header(key.sample_set_id, place.cell, place.is_neighbour, requested.camera, key.planes, times);
        Output { frame: requested.frame, header, data: encoded.data, arrived, credit }
    });
    reply.send(output);
}
