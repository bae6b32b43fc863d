//! Live streams: the newest pose counts, and no stream delays another.

mod flow;
mod quotas;
mod raw;
mod shortage;

use std::time::{Duration, Instant};

use client::{ClientError, LiveView};
use cluster::{SessionRequest, Timeline};
use cluster_tests::cluster::{Cluster, camera, plan_alone, views};
use tokio::time::timeout;
use tokio_stream::StreamExt as _;
use tonic::Code;
use wire::rpc::connect;

use raw::{HEALED, Raw, SIZE_PX, STILL, compositor_of, pipeline, seen};

const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 1.0, set_count: 3 };

#[tokio::test(flavor = "multi_thread")]
async fn every_frame_shows_its_pose() {
    let cluster = Cluster::start(3).await;
    let session = cluster.session(pipeline(MOVING)).await.unwrap();
    let mut live = session.live();
    let mut last = 0;
    for i in 0..30 {
        let received = seen(&mut live, i as f32 * 0.01, i / 10).await;
        assert!(received.frame.request.frame > last);
        last = received.frame.request.frame;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn invalid_poses_are_refused_before_they_are_sent() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let mut live = session.live();
    assert!(matches!(live.set_pose(camera(0.0, SIZE_PX), 1), Err(ClientError::Invalid { field: "set_index", .. })));
    assert!(matches!(live.set_pose(camera(f32::NAN, SIZE_PX), 0), Err(ClientError::Invalid { field: "camera", .. })));
    assert_eq!(seen(&mut live, 0.1, 0).await.frame.request.frame, 1);
    drop(session);
    let over = timeout(HEALED, live.next()).await.unwrap().unwrap_err();
    assert!(matches!(over, ClientError::Ended { .. }), "{over}");
}

#[tokio::test(flavor = "multi_thread")]
async fn live_views_outlive_their_compositor() {
    let mut cluster = Cluster::start(4).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let plan = session.plan().assignment;
    // The streams are on all compositors.
    let mut lives: Vec<LiveView> = plan.compositors.iter().map(|_| session.live()).collect();
    for live in &mut lives {
        seen(live, 0.0, 0).await;
    }
    let victim = plan.compositors[0].node_name[1..].parse::<usize>().unwrap();
    cluster.nodes[victim].kill();
    let start = Instant::now();
    for i in 0..20 {
        for live in &mut lives {
            seen(live, i as f32 * 0.01, 0).await;
        }
    }
    println!("healed after {:?} at most", start.elapsed());
    assert!(start.elapsed() < HEALED);
}

#[tokio::test(flavor = "multi_thread")]
async fn live_views_follow_the_plan() {
    let mut cluster = Cluster::start(3).await;
    let session = cluster.session(SessionRequest { forced_sampler_count: Some(1), ..pipeline(STILL) }).await.unwrap();
    let mut live = session.live();
    let mut epoch = seen(&mut live, 0.0, 0).await.frame.header.sample_set_id.plan_epoch;
    let start = Instant::now();
    let first = epoch;
    // Its compositor may have become a sampler.
    let sampler = session.plan().assignment.samplers[0].node_name[1..].parse::<usize>().unwrap();
    cluster.nodes[sampler].kill();
    for i in 0.. {
        let received = seen(&mut live, (i % 50) as f32 * 0.01, 0).await;
        let next = received.frame.header.sample_set_id.plan_epoch;
        assert!(next >= epoch);
        epoch = next;
        if epoch > first {
            break;
        }
        assert!(start.elapsed() < HEALED, "no other plan");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    for i in 0..10 {
        seen(&mut live, i as f32 * 0.01, 0).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn only_the_newest_pose_is_shown_and_two_frames_are_in_flight() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let (address, epoch) = compositor_of(&session);
    let mut raw = Raw::open(&address, epoch).await.unwrap();
    for frame in 1..=2 {
        raw.say(Some(frame), 0).await;
        assert_eq!(raw.frame().await, Some(frame));
    }
    for frame in 3..=150 {
        raw.say(Some(frame), 0).await;
    }
    assert_eq!(raw.frame().await, None, "neither was acknowledged");
    raw.say(None, 1).await;
    assert_eq!(raw.frame().await, Some(150), "all others were replaced");
}

#[tokio::test(flavor = "multi_thread")]
async fn invalid_live_requests_are_refused_by_field() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let (address, epoch) = compositor_of(&session);
    let mut raw = Raw::open(&address, epoch).await.unwrap();
    raw.say(Some(5), 0).await;
    raw.say(Some(5), 0).await;
    let refused = raw.refused().await;
    assert_eq!(refused.code(), Code::InvalidArgument);
    assert!(refused.message().contains("views.frame_number: 5 comes after 5"), "{refused}");
    let mut raw = Raw::open(&address, epoch).await.unwrap();
    raw.say(Some(1), 0).await;
    raw.template.live = None;
    raw.say(Some(2), 0).await;
    assert!(raw.refused().await.message().contains("live: "));
    let mut raw = Raw::open(&address, epoch + 1).await.unwrap();
    raw.say(None, 0).await;
    assert_eq!(raw.refused().await.code(), Code::FailedPrecondition);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_plan_of_the_same_workload_serves_clients_of_the_plan_before() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let (address, epoch) = compositor_of(&session);
    let mut raw = Raw::open(&address, epoch).await.unwrap();
    raw.say(Some(1), 0).await;
    assert_eq!(raw.frame().await, Some(1));
    let node = wire::rpc::NodeClient::new(connect(&address).await.unwrap());
    let plan = session.plan().assignment;
    node.apply_assignment(plan_alone(cluster::Assignment { plan_epoch: epoch + 1, ..plan.clone() })).await.unwrap();
    raw.say(Some(2), 1).await;
    let part = timeout(HEALED, raw.parts.next()).await.unwrap().unwrap().unwrap();
    assert_eq!((part.frame, part.header.unwrap().sample_set_id.plan_epoch), (2, epoch + 1));
    let workload = cluster::Workload { refinement_steps: 2, ..plan.workload.clone() };
    node.apply_assignment(plan_alone(cluster::Assignment { plan_epoch: epoch + 2, workload, ..plan.clone() }))
        .await
        .unwrap();
    raw.say(Some(3), 2).await;
    assert_eq!(raw.refused().await.code(), Code::FailedPrecondition, "it shows something else");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_viewer_that_pauses_goes_on_at_its_newest_pose() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let mut live = session.live();
    for i in 0..50 {
        live.set_pose(camera(i as f32 * 0.005, SIZE_PX), 0).unwrap();
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    let mut numbers = Vec::new();
    while numbers.last() != Some(&50) {
        numbers.push(timeout(HEALED, live.next()).await.unwrap().unwrap().frame.request.frame);
    }
    assert!(numbers.is_sorted() && numbers.len() <= 4, "{numbers:?}: two, one that was asked for, and the newest");
    // Batches of the same session are unaffected.
    assert_eq!(session.render_views(views(1, 6)).unwrap().all().await.unwrap().len(), 6);
}
