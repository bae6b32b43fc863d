//! A device that runs out of memory, or whose scenes were evicted, costs no frame where trying again helps.

use std::time::Duration;

use cluster::{PolicyChoice, Timeline};
use cluster_tests::cluster::{Cluster, request, whole_frame};
use cluster_tests::watcher::eventually;
use node::{Deadlines, NodeConfig};
use tokio::time::timeout;
use tonic::Code;
use wire::rpc::{CompositorClient, connect};

use super::raw::{HEALED, Raw, STILL, compositor_of, greedy, pipeline, seen};

const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 1.0, set_count: 2 };

#[tokio::test(flavor = "multi_thread")]
async fn views_that_have_no_room_together_are_made_in_halves() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    cluster.engines[0].run_short_for(8);
    let client = CompositorClient::new(connect(&compositor_of(&session).0).await.unwrap());
    let mut frames = client.render_views(tokio_stream::once(greedy(&session, 16, 8))).await.unwrap();
    for _ in 0..8 {
        timeout(HEALED, whole_frame(&mut frames)).await.expect("each frame");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn sets_that_are_not_in_use_are_freed_when_memory_runs_out() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(MOVING)).await.unwrap();
    let mut live = session.live();
    for set_index in [0, 1] {
        seen(&mut live, 0.0, set_index).await;
    }
    assert_eq!(cluster.take_counts(), [1; 6]);
    seen(&mut live, 0.1, 0).await;
    assert_eq!(cluster.take_counts(), [0; 0], "both are cached");
    cluster.engines[0].run_short(1);
    seen(&mut live, 0.2, 0).await;
    seen(&mut live, 0.3, 1).await;
    assert!(cluster.take_counts().len() >= 3, "that of the other moment was freed");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_has_no_memory_leaves_and_comes_back() {
    let quick = |config: NodeConfig| NodeConfig {
        deadlines: Deadlines { away: Duration::from_millis(300), ..config.deadlines },
        ..config
    };
    let cluster = Cluster::start_with(1, quick).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let (address, plan_epoch) = compositor_of(&session);
    seen(&mut session.live(), 0.0, 0).await;
    cluster.engines[0].run_short(usize::MAX);
    for _ in 0..3 {
        let mut raw = Raw::open(&address, plan_epoch).await.unwrap();
        raw.say(Some(1), 0).await;
        let refused = raw.refused().await;
        assert_eq!(refused.code(), Code::Unavailable, "{refused}");
        assert!(refused.message().contains("out of device memory"), "{refused}");
    }
    eventually("a plan of its return", HEALED, || session.plan().assignment.plan_epoch > plan_epoch).await;
    cluster.engines[0].run_short(0);
    seen(&mut session.live(), 0.0, 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_that_was_evicted_is_loaded_again() {
    for policy in [PolicyChoice::Pipeline, PolicyChoice::Direct] {
        let cluster = Cluster::start(1).await;
        let session = cluster.session(request(policy, MOVING)).await.unwrap();
        let mut live = session.live();
        for set_index in [0, 1] {
            cluster.engines[0].evict_scenes();
            seen(&mut live, 0.0, set_index).await;
        }
    }
}
