use codec::MAX_CHUNK_BYTES;
use codec::{FrameCodec, SampleSetId, StageTimes};
use depth_image::{Antialias, PinholeCamera, ToneMapping};
use glam::{UVec2, Vec3};
use node::Quotas;
use tokio::sync::Semaphore;
use tokio_stream::StreamExt as _;

use super::*;
use crate::quota::NodeQuota;

struct Bench {
    outbox: Arc<Outbox>,
    outgoing: Outgoing,
    reply: Reply,
    credits: Arc<Semaphore>,
    quota: NodeQuota,
}

fn bench(is_live: bool) -> Bench {
    let outbox = Outbox::new(1, NodeMetrics::default());
    if is_live {
        outbox.set_live();
    }
    let outgoing = Outgoing(outbox.clone());
    let reply = Reply::new(outbox.clone());
    Bench { outbox, outgoing, reply, credits: Arc::new(Semaphore::new(2)), quota: NodeQuota::new(Quotas::default()) }
}

impl Bench {
    fn put(&self, frame: u64, bytes: usize) {
        let camera = PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(8));
        let data = Bytes::from(vec![7; bytes]);
        let header = FrameHeader {
            sample_set_id: SampleSetId { plan_epoch: 1, index: 0 },
            cell: 0,
            is_neighbour_cell: false,
            camera,
            size_px: camera.size_px,
            antialias: Antialias::NONE,
            tone: ToneMapping::NONE,
            codec: FrameCodec::Lz4,
            color_bytes: bytes as u64,
            inverse_depth_bytes: 0,
            provenance_bytes: 0,
            crc32: 0,
            stage_times: StageTimes::default(),
        };
        let stream = self.credits.clone().try_acquire_owned().unwrap();
        let credit = Credit { stream, _node: self.quota.try_view(1).unwrap() };
        self.reply.send(Ok(Output { frame, header, data, arrived: Instant::now(), credit }));
    }

    async fn frame(&mut self) -> u64 {
        self.outgoing.next().await.unwrap().unwrap().frame
    }

    fn dropped(&self, reason: &'static str) -> u64 {
        self.outbox.metrics.dropped.get_or_create(&node::Reason { reason }).get()
    }
}

#[tokio::test]
async fn the_credit_of_a_frame_returns_with_its_last_part() {
    let mut bench = bench(false);
    bench.put(5, 2 * MAX_CHUNK_BYTES);
    assert_eq!((bench.frame().await, bench.credits.available_permits()), (5, 1));
    assert_eq!((bench.frame().await, bench.credits.available_permits()), (5, 2));
}

#[tokio::test]
async fn the_credit_of_a_live_frame_returns_with_its_acknowledgement() {
    let mut bench = bench(true);
    bench.put(5, 10);
    bench.put(6, 10);
    bench.outbox.acknowledge(5);
    assert_eq!(bench.credits.available_permits(), 0, "what was not sent cannot have come");
    assert_eq!((bench.frame().await, bench.frame().await), (5, 6));
    assert_eq!(bench.credits.available_permits(), 0);
    bench.outbox.acknowledge(5);
    assert_eq!(bench.credits.available_permits(), 1);
    bench.outbox.acknowledge(u64::MAX);
    assert_eq!(bench.credits.available_permits(), 2);
}

#[tokio::test]
async fn a_live_frame_after_a_later_one_is_dropped() {
    let mut bench = bench(true);
    bench.put(6, 10);
    bench.put(5, 10);
    assert_eq!(bench.frame().await, 6);
    bench.outbox.acknowledge(6);
    bench.put(7, 10);
    assert_eq!(bench.frame().await, 7);
    assert_eq!(bench.dropped("overtaken"), 1);
}

#[tokio::test]
async fn a_stream_ends_after_the_ready_frames_when_the_last_reply_is_dropped() {
    let mut bench = bench(false);
    let other = bench.reply.clone();
    bench.put(1, 10);
    drop(std::mem::replace(&mut bench.reply, other));
    assert_eq!(bench.frame().await, 1);
    let Bench { reply, mut outgoing, .. } = bench;
    drop(reply);
    assert!(outgoing.next().await.is_none());
}

#[tokio::test]
async fn an_error_follows_the_ready_frames_and_ends_the_stream() {
    let mut bench = bench(false);
    bench.put(1, 10);
    bench.reply.send(Err(Status::internal("device")));
    assert_eq!(bench.frame().await, 1);
    assert_eq!(bench.outgoing.next().await.unwrap().unwrap_err().message(), "device");
    assert!(bench.outgoing.next().await.is_none());
}

#[tokio::test]
async fn frames_that_a_client_does_not_take_are_dropped() {
    let mut bench = bench(false);
    bench.put(1, 2 * MAX_CHUNK_BYTES);
    bench.put(2, 10);
    bench.frame().await;
    tokio::time::timeout(Duration::from_secs(5), bench.outbox.stalled(Duration::from_millis(20))).await.unwrap();
    bench.outbox.cut(Status::deadline_exceeded("stalled"));
    assert_eq!(bench.credits.available_permits(), 2);
    assert_eq!(bench.dropped("client stalled"), 1);
    assert!(bench.outgoing.next().await.unwrap().is_err());
}

#[tokio::test]
async fn a_client_that_takes_all_frames_is_never_stalled() {
    let mut bench = bench(false);
    bench.put(1, 10);
    bench.frame().await;
    let stalled = bench.outbox.stalled(Duration::from_millis(10));
    assert!(tokio::time::timeout(Duration::from_millis(60), stalled).await.is_err());
}

#[tokio::test]
async fn a_client_that_leaves_returns_all_credit() {
    let bench = bench(true);
    bench.put(1, 10);
    let Bench { outbox, outgoing, credits, .. } = bench;
    drop(outgoing);
    outbox.gone.cancelled().await;
    assert_eq!(credits.available_permits(), 2);
}
