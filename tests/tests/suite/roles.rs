//! Tiles, relays, changing demand, and nodes' reports of their work.

use std::num::NonZeroU32;
use std::time::{Duration, Instant};

use client::{ClientError, Frame};
use cluster::{
    Assignment, FetchImages, Policy, PolicyChoice, RenderViews, RequestedView, SessionRequest, Timeline, Workload,
};
use cluster_tests::cluster::{Cluster, camera, plan_alone, request, rig, views, whole_frame};
use cluster_tests::scalar_engine::Pace;
use codec::{FrameCodec, WholeFrame};
use glam::UVec2;
use tokio_stream::StreamExt as _;
use tonic::{Code, Status};
use wire::rpc::{CompositorClient, NodeClient, SamplerClient, connect};

const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 1.0, set_count: 3 };

fn pipeline() -> SessionRequest {
    request(PolicyChoice::Pipeline, MOVING)
}

/// The share of equal bytes in two deliveries.
fn alike(a: &[Frame], b: &[Frame]) -> f64 {
    let mut same = 0;
    let mut all = 0;
    for frame in a {
        let other = b.iter().find(|other| other.request.frame == frame.request.frame).unwrap();
        same += frame.view.srgb8.iter().zip(&other.view.srgb8).filter(|(a, b)| a == b).count();
        all += frame.view.srgb8.len();
    }
    f64::from(u32::try_from(same).unwrap()) / f64::from(u32::try_from(all).unwrap())
}

async fn delivered(cluster: &Cluster, request: SessionRequest) -> (Assignment, Vec<Frame>) {
    let session = cluster.session(request).await.unwrap();
    let frames = session.render_views(views(3, 6)).unwrap().all().await.unwrap();
    (session.plan().assignment, frames)
}

#[tokio::test(flavor = "multi_thread")]
async fn views_from_tiles_equal_those_from_whole_images() {
    let cluster = Cluster::start(4).await;
    let forced = |tiles| SessionRequest { forced_tile_count: Some(tiles), ..pipeline() };
    let (plan, whole) = delivered(&cluster, forced(1)).await;
    assert_eq!(plan.tile_count, 1);
    drop(cluster);
    let cluster = Cluster::start(4).await;
    let (plan, tiled) = delivered(&cluster, forced(5)).await;
    assert_eq!((plan.tile_count, plan.image_count()), (5, 15));
    assert_eq!(whole.len(), 18);
    assert!(cluster.take_counts().iter().all(|&times| times == 1), "every tile once");
    // Depth is quantised over each tile's own range, so that samples may fall into the neighbouring pixel.
    let alike = alike(&whole, &tiled);
    assert!(alike > 0.98, "{alike}");
}

#[tokio::test(flavor = "multi_thread")]
async fn tiles_are_refused_where_images_are_not_independent() {
    let cluster = Cluster::start(2).await;
    let cut = SessionRequest { sampling: "in_order".to_owned(), forced_tile_count: Some(2), ..pipeline() };
    let error = cluster.session(cut).await.unwrap_err().to_string();
    assert!(error.contains("forced_tile_count is 2"), "{error}");
}

/// A chain: one sampler, and compositors that relay images.
async fn chained(cluster: &Cluster) -> Assignment {
    let forced = SessionRequest { forced_sampler_count: Some(1), ..pipeline() };
    let session = cluster.session(forced).await.unwrap();
    let plan = session.plan().assignment;
    drop(session);
    let chain = Assignment { plan_epoch: 100, relay_fanout: NonZeroU32::new(1), ..plan };
    for address in chain.compositors.iter().map(|c| &c.address).chain(chain.samplers.iter().map(|s| &s.address)) {
        NodeClient::new(connect(address).await.unwrap()).apply_assignment(plan_alone(chain.clone())).await.unwrap();
    }
    chain
}

/// Requests one view of a set from one compositor.
async fn ask(address: &str, plan: &Assignment, set_index: u32) -> WholeFrame {
    let request = RenderViews {
        plan_epoch: plan.plan_epoch,
        workload_number: plan.workload_number,
        set_index,
        method: "splat".to_owned(),
        codec: FrameCodec::Lz4,
        planes: depth_image::ViewPlanes::default(),
        views: vec![RequestedView { frame: 1, camera: camera(0.1, UVec2::new(48, 36)) }],
        live: None,
    };
    let client = CompositorClient::new(connect(address).await.unwrap());
    let mut parts = client.render_views(tokio_stream::iter([request])).await.unwrap();
    whole_frame(&mut parts).await
}

#[tokio::test(flavor = "multi_thread")]
async fn compositors_relay_images_in_a_chain() {
    let cluster = Cluster::start(4).await;
    let plan = chained(&cluster).await;
    let [first, second, last] = &plan.compositors[..] else { panic!("{:?}", plan.compositors) };
    assert_eq!((plan.relay_of(&first.node_name), plan.relay_of(&last.node_name)), (None, Some(second)));
    cluster.take_counts();
    // The last compositor first: its request goes all the way up.
    let far = ask(&last.address, &plan, 1).await;
    let near = ask(&first.address, &plan, 1).await;
    assert_eq!(far.data, near.data);
    assert!(cluster.take_counts().iter().all(|&times| times == 1), "sampled once");
    let relayed = |address: String, plan_epoch| async move {
        let sampler = SamplerClient::new(connect(&address).await.unwrap());
        let fetch = FetchImages { plan_epoch, workload_number: 1, set_index: 1, cell: 0, image_indices: vec![0, 1, 2] };
        sampler.fetch_sample_images(fetch).await.map(|chunks| chunks.collect::<Vec<_>>())
    };
    let chunks = relayed(second.address.clone(), 100).await.unwrap().await;
    assert!(chunks.len() >= 6 && chunks.iter().all(Result::is_ok), "header and data of each of three images");
    let refused = relayed(last.address.clone(), 100).await.err().unwrap();
    assert!(refused.message().contains("is not sampled by"), "nobody asks the last one: {refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn samplers_replace_a_relay_that_is_lost() {
    let mut cluster = Cluster::start(4).await;
    let plan = chained(&cluster).await;
    let relay = plan.compositors[1].node_name[1..].parse::<usize>().unwrap();
    cluster.nodes[relay].kill();
    let start = Instant::now();
    ask(&plan.compositors[2].address, &plan, 0).await;
    println!("samplers asked in place of a relay after {:?}", start.elapsed());
    assert!(start.elapsed() < Duration::from_secs(5));
    let start = Instant::now();
    ask(&plan.compositors[2].address, &plan, 1).await;
    assert!(start.elapsed() < Duration::from_secs(2), "the next set is not asked of it any more");
}

/// Another plan arrives while one set is sampled and the next waits. Returns how the wait ends, and whether it sampled.
async fn next_set_under(change: impl Fn(Assignment) -> Assignment) -> (Result<(), Status>, bool) {
    let cluster = Cluster::start(3).await;
    let plan = chained(&cluster).await;
    let share = plan.samplers[0].clone();
    let engine = &cluster.engines[share.node_name[1..].parse::<usize>().unwrap()];
    let _ = engine.take_counts();
    engine.keep_pace(Pace { image: Duration::from_millis(200), ..Pace::default() });
    let fetch = |set_index| {
        let address = share.address.clone();
        let image_indices = share.image_indices.clone();
        let fetch = FetchImages {
            plan_epoch: plan.plan_epoch,
            workload_number: plan.workload_number,
            set_index,
            cell: 0,
            image_indices,
        };
        tokio::spawn(async move {
            let sampler = SamplerClient::new(connect(&address).await.unwrap());
            // The stream begins at once; its first message comes with the images.
            sampler.fetch_sample_images(fetch).await?.next().await.unwrap().map(drop)
        })
    };
    let begun = fetch(0);
    while engine.take_counts().is_empty() {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let waits = fetch(1);
    tokio::time::sleep(Duration::from_millis(100)).await;
    let _ = engine.take_counts();
    let next = change(Assignment { plan_epoch: plan.plan_epoch + 1, ..plan.clone() });
    NodeClient::new(connect(&share.address).await.unwrap()).apply_assignment(plan_alone(next)).await.unwrap();
    begun.await.unwrap().unwrap();
    let waited = waits.await.unwrap();
    (waited, !engine.take_counts().is_empty())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_set_that_was_not_begun_and_is_in_no_plan_any_more_is_not_sampled() {
    let (waited, sampled) = next_set_under(|plan| {
        let timeline = Timeline { start_s: 10.0, ..plan.workload.timeline };
        Assignment { workload: Workload { timeline, ..plan.workload }, ..plan }
    })
    .await;
    let refused = waited.unwrap_err();
    assert!(refused.code() == Code::FailedPrecondition && refused.message().contains("set 1"), "{refused}");
    assert!(!sampled);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_set_that_the_next_plan_has_too_is_sampled() {
    let (waited, sampled) = next_set_under(|plan| plan).await;
    waited.unwrap();
    assert!(sampled);
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_change_their_demand_and_nodes_report_their_work() {
    let cluster = Cluster::start(3).await;
    let session = cluster.session(pipeline()).await.unwrap();
    session.change(500, None).await.unwrap();
    let status = cluster.client.status().await.unwrap();
    assert_eq!(status.views_per_set(), 500);
    session.change(12, None).await.unwrap();
    let start = Instant::now();
    let mut made = 0;
    loop {
        made += session.render_views(views(3, 12)).unwrap().all().await.unwrap().len() as u64;
        let status = cluster.client.status().await.unwrap();
        let [workload] = &status.workloads[..] else { panic!("{status:?}") };
        let reported: u64 = workload.conditions.iter().map(|condition| condition.views).sum();
        assert!(reported <= made, "{reported} of {made}");
        if let Some(achieved) = workload.achieved.first().filter(|_| reported > 0) {
            assert_eq!(achieved.policy, Policy::Pipeline);
            assert!(achieved.busy_s > 0.0 && achieved.busy_s < 10.0, "{achieved:?}");
            assert!(workload.conditions.iter().any(|condition| condition.busy_ratio > 0.0));
            break;
        }
        assert!(start.elapsed() < Duration::from_secs(10), "{status:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_warms_up_before_it_joins() {
    let mut cluster = Cluster::start(1).await;
    let session = cluster.session(request(PolicyChoice::TimeShare, MOVING)).await.unwrap();
    cluster.add_node(|config| config);
    cluster.client.wait_for_nodes(2, Duration::from_secs(10)).await.unwrap();
    assert_eq!(cluster.take_counts(), vec![1; rig().len()], "nobody has asked for a view");
    assert_eq!(session.render_views(views(1, 6)).unwrap().all().await.unwrap().len(), 6);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rate_beyond_the_nodes_is_refused_and_other_sessions_go_on() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(pipeline()).await.unwrap();
    let still = Timeline::still(0.0);
    let greedy =
        SessionRequest { frames_per_s: Some(1000.0), views_per_set: 1 << 16, ..request(PolicyChoice::Auto, still) };
    let refused = cluster.session(greedy).await.unwrap_err();
    let ClientError::Exhausted { reason } = &refused else { panic!("{refused:?}") };
    assert!(reason.contains("frames_per_s: all sessions together would take"), "{reason}");
    assert_eq!(session.render_views(views(3, 2)).unwrap().all().await.unwrap().len(), 6);
}
