//! Clients receive all requested pictures, whole and each of one set, while nodes come and go.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use client::{Frame, Session, ViewRequest};
use cluster::{PolicyChoice, SessionRequest, Timeline};
use cluster_tests::cluster::{Cluster, camera, request, views};
use depth_image::ViewPlanes;
use glam::UVec2;
use node::{Deadlines, NodeConfig};

const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 1.0, set_count: 3 };
const STILL: Timeline = Timeline { start_s: 0.0, step_s: 0.0, set_count: 1 };
/// Short deadline of nodes for stalled and idle streams.
const HASTE: Duration = Duration::from_millis(300);
/// Greatest time until complete frames arrive again.
const HEALED: Duration = Duration::from_secs(5);

fn pipeline(timeline: Timeline) -> SessionRequest {
    request(PolicyChoice::Pipeline, timeline)
}

/// The invariants of a history: each frame arrives once, and plans only rise.
fn check(frames: &[Frame], asked: usize) {
    let numbers: BTreeSet<u64> = frames.iter().map(|frame| frame.request.frame).collect();
    assert_eq!((numbers.len(), frames.len()), (asked, asked));
    assert!(frames.iter().all(|frame| frame.header.sample_set_id.index == u64::from(frame.request.set_index)));
    let epochs: Vec<u64> = frames.iter().map(|frame| frame.header.sample_set_id.plan_epoch).collect();
    assert!(epochs.is_sorted(), "{epochs:?}");
}

async fn wait_for(what: &str, holds: impl AsyncFn() -> bool) {
    let start = Instant::now();
    while !holds().await {
        assert!(start.elapsed() < HEALED, "{what} takes longer than {HEALED:?}");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

/// Requests the same view until it comes from a plan above `plan_epoch`; returns the time that took.
async fn until_replanned(session: &Session, plan_epoch: u64) -> Duration {
    let start = Instant::now();
    for frame in 0.. {
        let view = ViewRequest { frame, set_index: 0, camera: camera(0.1, UVec2::new(48, 36)) };
        let frames = session.render_views(vec![view]).unwrap().all().await.unwrap();
        check(&frames, 1);
        if frames[0].header.sample_set_id.plan_epoch > plan_epoch {
            break;
        }
        assert!(start.elapsed() < HEALED);
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    start.elapsed()
}

#[tokio::test(flavor = "multi_thread")]
async fn other_compositors_send_the_frames_of_a_killed_one() {
    let mut cluster = Cluster::start(4).await;
    let session = cluster.session(pipeline(MOVING)).await.unwrap();
    let plan = session.plan();
    let victim = plan.assignment.compositors.last().unwrap().node_name[1..].parse::<usize>().unwrap();
    let mut frames = session.render_views(views(3, 40)).unwrap();
    let mut received = vec![frames.next().await.unwrap().unwrap()];
    cluster.nodes[victim].kill();
    let start = Instant::now();
    received.extend(frames.all().await.unwrap());
    println!("healed after {:?}", start.elapsed());
    assert!(start.elapsed() < HEALED);
    check(&received, 120);
    assert!(session.plan().assignment.plan_epoch > plan.assignment.plan_epoch);
    assert!(!session.plan().assignment.composites(&format!("n{victim}")));
}

/// A client holds a window of its requests, also over a fault.
#[tokio::test(flavor = "multi_thread")]
async fn requests_are_drawn_as_frames_are_received_also_after_a_fault() {
    const VIEWS: u32 = 30_000;
    const WINDOW: usize = 10_000;
    let mut cluster = Cluster::start(4).await;
    let planes = ViewPlanes::default();
    let session = cluster.session(SessionRequest { planes, ..pipeline(MOVING) }).await.unwrap();
    let victim = session.plan().assignment.compositors.last().unwrap().node_name[1..].parse::<usize>().unwrap();
    let drawn = Arc::new(AtomicUsize::new(0));
    let counted = drawn.clone();
    let small = camera(0.1, UVec2::splat(4));
    let requests = (0..VIEWS).map(move |i| {
        counted.fetch_add(1, Ordering::Relaxed);
        ViewRequest { frame: i.into(), set_index: i / (VIEWS / 3), camera: small }
    });
    let mut frames = session.render_views(requests).unwrap();
    let mut received = Vec::new();
    while let Some(frame) = frames.next().await {
        received.push(frame.unwrap());
        let lead = drawn.load(Ordering::Relaxed) - received.len();
        assert!(lead <= WINDOW, "{lead} ahead of {}", received.len());
        if received.len() == 8000 {
            cluster.nodes[victim].kill();
        }
    }
    check(&received, VIEWS as usize);
}

/// Decoded frames wait for a busy caller, though their plan ends meanwhile.
#[tokio::test(flavor = "multi_thread")]
async fn frames_that_their_caller_has_not_taken_outlive_their_plan() {
    let mut cluster = Cluster::start(4).await;
    let session = cluster.session(pipeline(MOVING)).await.unwrap();
    let plan = session.plan().assignment;
    let victim = plan.compositors.last().unwrap().node_name[1..].parse::<usize>().unwrap();
    let mut frames = session.render_views(views(3, 40)).unwrap();
    let mut received = vec![frames.next().await.unwrap().unwrap()];
    tokio::time::sleep(Duration::from_millis(300)).await;
    cluster.nodes[victim].kill();
    wait_for("another plan", async || session.plan().assignment.plan_epoch > plan.plan_epoch).await;
    tokio::time::sleep(Duration::from_millis(300)).await;
    received.extend(frames.all().await.unwrap());
    check(&received, 120);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_caller_may_pause_for_longer_than_nodes_wait() {
    let hasty = |config: NodeConfig| NodeConfig {
        deadlines: Deadlines { stall: HASTE, idle: HASTE, ..config.deadlines },
        ..config
    };
    let cluster = Cluster::start_with(2, hasty).await;
    let session = cluster.session(pipeline(MOVING)).await.unwrap();
    let mut frames = session.render_views(views(3, 100)).unwrap();
    let mut received = Vec::new();
    for _ in 0..3 {
        received.push(frames.next().await.unwrap().unwrap());
        tokio::time::sleep(3 * HASTE).await;
    }
    received.extend(frames.all().await.unwrap());
    check(&received, 300);
}

#[tokio::test(flavor = "multi_thread")]
async fn other_samplers_make_the_sets_of_a_killed_one() {
    let mut cluster = Cluster::start(3).await;
    let session = cluster.session(pipeline(MOVING)).await.unwrap();
    let plan = session.plan();
    let victim = plan.assignment.samplers[0].node_name[1..].parse::<usize>().unwrap();
    cluster.nodes[victim].kill();
    let start = Instant::now();
    let frames = session.render_views(views(3, 4)).unwrap().all().await.unwrap();
    println!("healed after {:?}", start.elapsed());
    assert!(start.elapsed() < HEALED);
    check(&frames, 12);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_without_nodes_waits_for_the_next() {
    let mut cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(MOVING)).await.unwrap();
    cluster.nodes[0].kill();
    let waiting = session.render_views(views(1, 3)).unwrap();
    cluster.add_node(|config| config);
    check(&waiting.all().await.unwrap(), 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_new_node_gets_a_role_without_a_lost_frame() {
    let mut cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let epoch = session.plan().assignment.plan_epoch;
    cluster.add_node(|config| config);
    cluster.client.wait_for_nodes(2, HEALED).await.unwrap();
    let mut all = Vec::new();
    let start = Instant::now();
    while session.plan().assignment.plan_epoch == epoch {
        let first = all.len() as u64;
        let asked = (0..6).map(move |i| ViewRequest { frame: first + i, ..views(1, 6)[i as usize] });
        all.extend(session.render_views(asked).unwrap().all().await.unwrap());
        assert!(start.elapsed() < 3 * HEALED, "one node goes on doing both");
    }
    println!("{} frames before the second node takes part, after {:?}", all.len(), start.elapsed());
    check(&all, all.len());
    check(&session.render_views(views(1, 6)).unwrap().all().await.unwrap(), 6);
    let assignment = session.plan().assignment;
    let samplers = assignment.samplers.iter().map(|share| &share.node_name);
    let names: BTreeSet<_> = samplers.chain(assignment.compositors.iter().map(|share| &share.node_name)).collect();
    assert_eq!(names.len(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_go_on_without_a_coordinator_and_a_plan_follows_its_return() {
    let mut cluster = Cluster::start(3).await;
    let session = cluster.session(pipeline(MOVING)).await.unwrap();
    let epoch = session.plan().assignment.plan_epoch;
    cluster.kill_coordinator();
    check(&session.render_views(views(3, 4)).unwrap().all().await.unwrap(), 12);
    cluster.restart_coordinator();
    let took = until_replanned(&session, epoch).await;
    println!("a new plan {took:?} after the coordinator's return");
    check(&session.render_views(views(3, 4)).unwrap().all().await.unwrap(), 12);
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_of_one_workload_share_a_plan() {
    let mut cluster = Cluster::start(3).await;
    let mut sessions = Vec::new();
    for _ in 0..4 {
        sessions.push(cluster.session(pipeline(MOVING)).await.unwrap());
    }
    let newest = sessions[3].plan().assignment.plan_epoch;
    wait_for("one plan for all", async || {
        sessions.iter().all(|session| session.plan().assignment.plan_epoch == newest)
    })
    .await;
    cluster.take_counts();
    let mut images = HashMap::new();
    for session in &sessions {
        for frame in session.render_views(views(3, 4)).unwrap().all().await.unwrap() {
            let first = images.entry(frame.request.frame).or_insert_with(|| frame.view.clone());
            assert!(*first == frame.view, "the same picture for all");
        }
    }
    assert!(cluster.take_counts().iter().all(|&times| times == 1), "sampled once for all");
    drop(sessions.remove(0));
    cluster.nodes[2].kill();
    check(&sessions[0].render_views(views(3, 4)).unwrap().all().await.unwrap(), 12);
}
