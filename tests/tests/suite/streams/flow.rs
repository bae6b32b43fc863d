//! Streams go on from plan to plan, and wait neither for a view cell nor for a batch.

use std::num::NonZeroU32;
use std::time::Duration;

use cluster::{
    ApplyPlan, Assignment, LiveRequest, Policy, RenderViews, RequestedView, SamplerShare, SessionRequest, Timeline,
    Workload,
};
use cluster_tests::cluster::{Cluster, camera, plan_alone, rig, views, whole_frame};
use cluster_tests::scalar_engine::LIGHT_CACHE;
use cluster_tests::watcher::eventually;
use codec::{FrameHeader, WholeFrame};
use depth_image::{Camera, PinholeCamera, SampleCamera};
use glam::{UVec2, Vec3};
use node::{Deadlines, NodeConfig};
use tokio::time::timeout;
use tonic::Code;
use wire::rpc::{NodeClient, connect};

use super::raw::{HEALED, Raw, SIZE_PX, STILL, compositor_of, greedy, pipeline, seen};

/// The shift to the cameras of the second cell.
const AWAY_M: f32 = 3.0;

/// The rig's cameras, shifted sideways.
fn shifted_rig(x_m: f32) -> Vec<Camera> {
    let shifted = |camera: &Camera| {
        let camera = *camera.reference();
        Camera::Pinhole(PinholeCamera { eye_in_world: camera.eye_in_world + Vec3::X * x_m, ..camera })
    };
    rig().iter().map(shifted).collect()
}

fn eye(camera: &Camera) -> Vec3 {
    camera.reference().eye_in_world
}

/// The next plan: with a second cell to the side, whose images all samplers share.
fn with_two_cells(plan: &Assignment) -> Assignment {
    with_cells(plan, 2)
}

/// The next plan: with cells side by side, whose images all samplers share.
fn with_cells(plan: &Assignment, count: u32) -> Assignment {
    let sample_cameras: Vec<_> =
        (0..count).flat_map(|cell| shifted_rig(AWAY_M * cell as f32)).map(Into::into).collect();
    let cell_first_indices = (0..count).map(|cell| cell * rig().len() as u32).collect();
    let nodes = plan.samplers.len() as u32;
    let own = |at: u32| (0..sample_cameras.len() as u32).filter(|image| image % nodes == at).collect();
    let shares = plan.samplers.iter().zip(0..);
    let samplers = shares.map(|(share, at)| SamplerShare { image_indices: own(at), ..share.clone() }).collect();
    let workload = Workload { sample_cameras, cell_first_indices, ..plan.workload.clone() };
    Assignment { plan_epoch: plan.plan_epoch + 1, workload, samplers, ..plan.clone() }
}

fn sampled(rig: Vec<Camera>) -> Vec<SampleCamera> {
    rig.into_iter().map(Into::into).collect()
}

async fn apply(cluster: &Cluster, plan: &Assignment) {
    for node in &cluster.nodes {
        let node = NodeClient::new(connect(&node.address).await.unwrap());
        node.apply_assignment(plan_alone(plan.clone())).await.unwrap();
    }
}

async fn opened(address: &str, plan: &Assignment) -> Raw {
    let mut raw = Raw::open(address, plan.plan_epoch).await.unwrap();
    raw.template.workload_number = plan.workload_number;
    raw
}

/// Shows a pose, `x_m` to the side, and gives its frame.
async fn shown(raw: &mut Raw, frame: u64, x_m: f32) -> FrameHeader {
    raw.say_at(Some((frame, camera(x_m, SIZE_PX))), frame - 1).await;
    let WholeFrame { frame: number, header, .. } = timeout(HEALED, whole_frame(&mut raw.parts)).await.expect("a frame");
    assert_eq!(number, frame);
    header
}

#[tokio::test(flavor = "multi_thread")]
async fn a_live_stream_goes_on_with_other_cells_another_k_and_another_policy() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(SessionRequest { forced_sampler_count: Some(1), ..pipeline(STILL) }).await.unwrap();
    let plan = session.plan().assignment;
    let mut raw = opened(&compositor_of(&session).0, &plan).await;
    assert_eq!(shown(&mut raw, 1, 0.0).await.sample_set_id.plan_epoch, plan.plan_epoch);
    let both = plan.compositors.iter().map(|share| (&share.node_name, &share.address));
    let both = both.chain(plan.samplers.iter().map(|share| (&share.node_name, &share.address)));
    let share = |(name, address): (&String, &String)| SamplerShare {
        node_name: name.clone(),
        address: address.clone(),
        image_indices: Vec::new(),
    };
    let samplers: Vec<_> = both.map(share).collect();
    assert_eq!(samplers.len(), 2, "one became two");
    let next = with_two_cells(&Assignment { samplers, policy: Policy::TimeShare, ..plan.clone() });
    apply(&cluster, &next).await;
    let header = shown(&mut raw, 2, AWAY_M).await;
    assert_eq!((header.sample_set_id.plan_epoch, header.sample_set_id.index), (next.plan_epoch, 0));
    let direct = Assignment { plan_epoch: next.plan_epoch + 1, policy: Policy::Direct, samplers: Vec::new(), ..next };
    apply(&cluster, &direct).await;
    assert_eq!(shown(&mut raw, 3, AWAY_M).await.sample_set_id.plan_epoch, direct.plan_epoch);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_viewer_in_a_cell_that_is_not_loaded_sees_a_neighbour_and_then_its_own() {
    let quick = |config: NodeConfig| NodeConfig {
        deadlines: Deadlines { neighbour: Duration::from_millis(20), ..config.deadlines },
        ..config
    };
    let cluster = Cluster::start_with(1, quick).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let next = with_two_cells(&session.plan().assignment);
    apply(&cluster, &next).await;
    let engine = &cluster.engines[0];
    engine.hold_samples_from(eye(&shifted_rig(AWAY_M)[0]));
    let mut raw = opened(&compositor_of(&session).0, &next).await;
    let source = |header: &FrameHeader| (header.cell, header.is_neighbour_cell);
    assert_eq!(source(&shown(&mut raw, 1, 0.0).await), (0, false));
    for frame in 2..6 {
        assert_eq!(source(&shown(&mut raw, frame, AWAY_M).await), (0, true), "its own is not sampled yet");
    }
    assert_eq!(source(&shown(&mut raw, 6, 0.0).await), (0, false), "in its own cell again");
    engine.release();
    let mut frame = 7;
    while source(&shown(&mut raw, frame, AWAY_M).await) != (1, false) {
        frame += 1;
        assert!(frame < 500, "its own never arrives");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_first_set_of_a_stream_is_waited_for() {
    let quick = |config: NodeConfig| NodeConfig {
        deadlines: Deadlines { neighbour: Duration::from_millis(1), ..config.deadlines },
        ..config
    };
    let cluster = Cluster::start_with(1, quick).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let next = with_two_cells(&session.plan().assignment);
    apply(&cluster, &next).await;
    let address = compositor_of(&session).0;
    shown(&mut opened(&address, &next).await, 1, 0.0).await;
    cluster.engines[0].hold_samples_from(eye(&shifted_rig(AWAY_M)[0]));
    let mut raw = opened(&address, &next).await;
    raw.say_at(Some((1, camera(AWAY_M, SIZE_PX))), 0).await;
    assert_eq!(raw.frame().await, None, "another cell is loaded, but not for this stream");
    cluster.engines[0].release();
    let header = timeout(HEALED, whole_frame(&mut raw.parts)).await.expect("its own").header;
    assert_eq!((header.cell, header.is_neighbour_cell), (1, false));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_viewer_in_motion_sees_the_scene_until_its_first_set_of_light_is_there_and_a_still_waits() {
    let quick = |config: NodeConfig| NodeConfig {
        deadlines: Deadlines { neighbour: Duration::from_millis(1), ..config.deadlines },
        ..config
    };
    let cluster = Cluster::start_with(1, quick).await;
    let method = format!("{LIGHT_CACHE}:fine");
    let request = SessionRequest { method: method.clone(), takes_light: true, ..pipeline(STILL) };
    let session = cluster.session(request).await.unwrap();
    let plan = session.plan().assignment;
    assert!(plan.workload.planes.light);
    let engine = &cluster.engines[0];
    let _of_measuring = engine.take_reconstructed();
    engine.hold_samples_from(eye(&rig()[0]));
    let address = compositor_of(&session).0;
    let [mut moving, mut still] = [opened(&address, &plan).await, opened(&address, &plan).await];
    for stream in [&mut moving, &mut still] {
        stream.template.method.clone_from(&method);
    }
    still.template.live = Some(LiveRequest { client_id: 1, waits_for_set: true, ..LiveRequest::default() });
    still.say_at(Some((1, camera(0.0, SIZE_PX))), 0).await;
    for frame in 1..4 {
        assert!(shown(&mut moving, frame, 0.01 * frame as f32).await.is_neighbour_cell, "no set is there");
    }
    moving.say_at(Some((4, camera(0.03, SIZE_PX))), 3).await;
    assert_eq!(moving.frame().await, None, "the same view is not drawn again");
    assert_eq!(still.frame().await, None, "it waits");
    assert_eq!(engine.take_reconstructed(), 0);
    engine.release();
    for stream in [&mut moving, &mut still] {
        let header = timeout(HEALED, whole_frame(&mut stream.parts)).await.expect("from the set").header;
        assert!(!header.is_neighbour_cell);
    }
    assert_eq!(engine.take_reconstructed(), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_set_that_is_wanted_is_fetched_once_whatever_the_plan() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let plan = session.plan().assignment;
    let engine = &cluster.engines[0];
    engine.hold_samples_from(eye(&rig()[0]));
    let mut raw = opened(&compositor_of(&session).0, &plan).await;
    raw.say_at(Some((1, camera(0.0, SIZE_PX))), 0).await;
    eventually("sampling has begun", HEALED, || engine.held_calls() == 1).await;
    for later in 1..4 {
        let relay_fanout = NonZeroU32::new(later as u32);
        let next = Assignment { plan_epoch: plan.plan_epoch + later, relay_fanout, ..with_two_cells(&plan) };
        apply(&cluster, &next).await;
    }
    engine.release();
    timeout(HEALED, whole_frame(&mut raw.parts)).await.expect("the set that was fetched under the first plan");
    assert_eq!(cluster.take_counts(), [1; 3], "each image once");
}

/// The plan of another workload that is open alone: all others have ended.
fn alone(plan: &Assignment, workload_number: u64, plan_epoch: u64) -> ApplyPlan {
    let assignment = Assignment { workload_number, plan_epoch, ..plan.clone() };
    ApplyPlan { assignment, open_workloads: vec![workload_number] }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_set_that_two_workloads_fetch_is_there_for_the_second_when_the_first_has_ended() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let plan = session.plan().assignment;
    let engine = &cluster.engines[0];
    engine.hold_samples_from(eye(&rig()[0]));
    let address = compositor_of(&session).0;
    let mut first = opened(&address, &plan).await;
    first.say_at(Some((1, camera(0.0, SIZE_PX))), 0).await;
    eventually("sampling has begun", HEALED, || engine.held_calls() == 1).await;
    let next = alone(&plan, plan.plan_epoch + 1, plan.plan_epoch + 1);
    apply(&cluster, &next.assignment).await;
    let mut second = opened(&address, &next.assignment).await;
    second.say_at(Some((1, camera(0.0, SIZE_PX))), 0).await;
    assert_eq!(second.frame().await, None, "both wait for one fetch");
    let next = alone(&plan, plan.plan_epoch + 1, plan.plan_epoch + 2);
    NodeClient::new(connect(&address).await.unwrap()).apply_assignment(next).await.unwrap();
    let refused = first.refused().await;
    assert_eq!(refused.code(), Code::FailedPrecondition, "{refused}");
    engine.release();
    timeout(HEALED, whole_frame(&mut second.parts)).await.expect("the set goes on");
    assert_eq!(cluster.take_counts(), [1; 3], "each image once");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_workload_that_has_ended_and_is_opened_again_is_not_sampled_again() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let plan = session.plan().assignment;
    let address = compositor_of(&session).0;
    let node = NodeClient::new(connect(&address).await.unwrap());
    let mut number = plan.workload_number;
    shown(&mut opened(&address, &plan).await, 1, 0.0).await;
    assert_eq!(cluster.take_counts(), [1; 3]);
    for is_open in [true, false] {
        let workload = Workload { sample_cameras: sampled(shifted_rig(AWAY_M)), ..plan.workload.clone() };
        let between = Assignment { workload, ..plan.clone() };
        let mut between = alone(&between, number + 10, number + 10);
        between.open_workloads.extend(is_open.then_some(number));
        node.apply_assignment(between).await.unwrap();
        number += 20;
        let again = alone(&plan, number, number);
        node.apply_assignment(again.clone()).await.unwrap();
        shown(&mut opened(&address, &again.assignment).await, 1, 0.0).await;
        assert!(cluster.take_counts().is_empty(), "open: {is_open}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_workload_whose_sampling_takes_long_delays_no_other() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let plan = session.plan().assignment;
    let engine = &cluster.engines[0];
    engine.hold_samples_from(eye(&rig()[0]));
    let address = compositor_of(&session).0;
    let mut held = opened(&address, &plan).await;
    held.say_at(Some((1, camera(0.0, SIZE_PX))), 0).await;
    eventually("sampling has begun", HEALED, || engine.held_calls() == 1).await;
    let workload = Workload { sample_cameras: sampled(shifted_rig(AWAY_M)), ..plan.workload.clone() };
    // Epochs of different workloads may be equal.
    let other = Assignment { workload_number: plan.workload_number + 1, workload, ..plan.clone() };
    apply(&cluster, &other).await;
    let mut raw = opened(&address, &other).await;
    for frame in 1..4 {
        shown(&mut raw, frame, AWAY_M).await;
    }
    assert_eq!(engine.held_calls(), 1);
    engine.release();
    timeout(HEALED, whole_frame(&mut held.parts)).await.expect("the first workload's view");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_of_large_views_does_not_keep_a_live_view_waiting() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let engine = &cluster.engines[0];
    let large_px = 64;
    engine.hold_views_of(UVec2::splat(large_px));
    let address = compositor_of(&session).0;
    let client = wire::rpc::CompositorClient::new(connect(&address).await.unwrap());
    let mut batch = client.render_views(tokio_stream::once(greedy(&session, large_px, 64))).await.unwrap();
    eventually("the batch is on the device", HEALED, || engine.held_calls() == 1).await;
    let mut live = session.live();
    for i in 0..5 {
        seen(&mut live, i as f32 * 0.01, 0).await;
        assert_eq!(engine.held_calls(), 1, "the batch is still there");
    }
    engine.release();
    for _ in 0..64 {
        timeout(HEALED, whole_frame(&mut batch)).await.expect("the batch ends");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_long_view_keeps_neither_viewers_nor_batches_of_others_waiting() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let engine = &cluster.engines[0];
    let long_live_px = UVec2::new(1200, 1000);
    let long_batch_side_px = 1100;
    engine.hold_views_of(long_live_px);
    engine.hold_views_of(UVec2::splat(long_batch_side_px));
    let (address, plan_epoch) = compositor_of(&session);
    let mut long = Raw::open(&address, plan_epoch).await.unwrap();
    long.say_at(Some((1, camera(0.0, long_live_px))), 0).await;
    let client = wire::rpc::CompositorClient::new(connect(&address).await.unwrap());
    let ask = async |side_px: u32, count: u64| {
        client.render_views(tokio_stream::once(greedy(&session, side_px, count))).await.unwrap()
    };
    let mut long_batch = ask(long_batch_side_px, 1).await;
    eventually("both are on the device", HEALED, || engine.held_calls() == 2).await;
    let mut live = session.live();
    let mut batch = ask(32, 8).await;
    for i in 0..5 {
        seen(&mut live, i as f32 * 0.01, 0).await;
    }
    for _ in 0..8 {
        timeout(HEALED, whole_frame(&mut batch)).await.expect("the short batch ends");
    }
    assert_eq!(engine.held_calls(), 2, "the long views are still there");
    engine.release();
    timeout(HEALED, whole_frame(&mut long.parts)).await.expect("the long view");
    timeout(HEALED, whole_frame(&mut long_batch)).await.expect("the long view of a batch");
}

/// Each stream has more views in each cell than it may have in flight.
#[tokio::test(flavor = "multi_thread")]
async fn batches_of_more_cells_than_memory_has_room_for_end() {
    let few = |config: NodeConfig| NodeConfig { set_memory_bytes: 2_500_000, ..config };
    let cluster = Cluster::start_with(1, few).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let plan = with_cells(&session.plan().assignment, 5);
    apply(&cluster, &plan).await;
    let at = |frame: u64| camera(AWAY_M * (frame % 5) as f32, UVec2::splat(8));
    let views = |count: u64| (0..count).map(|frame| RequestedView { frame, camera: at(frame) }).collect();
    let request = RenderViews { plan_epoch: plan.plan_epoch, views: views(1500), ..greedy(&session, 8, 0) };
    let mut ends = Vec::new();
    for _ in 0..3 {
        let client = wire::rpc::CompositorClient::new(connect(&compositor_of(&session).0).await.unwrap());
        let mut parts = client.render_views(tokio_stream::once(request.clone())).await.unwrap();
        ends.push(tokio::spawn(async move {
            for _ in 0..1500 {
                timeout(HEALED, whole_frame(&mut parts)).await.expect("the next frame");
            }
        }));
    }
    for end in ends {
        end.await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_shows_all_sets_with_room_for_one_and_refuses_a_larger_one_by_name() {
    const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 1.0, set_count: 3 };
    let within = |set_memory_bytes: usize| move |config: NodeConfig| NodeConfig { set_memory_bytes, ..config };
    let cluster = Cluster::start_with(1, within(900_000)).await;
    let session = cluster.session(pipeline(MOVING)).await.unwrap();
    let mut live = session.live();
    for set_index in [0, 1, 2, 1, 0] {
        seen(&mut live, 0.1, set_index).await;
    }
    assert_eq!(session.render_views(views(3, 4)).unwrap().all().await.unwrap().len(), 12);
    let small = Cluster::start_with(1, within(100_000)).await;
    let session = small.session(pipeline(MOVING)).await.unwrap();
    let mut raw = opened(&compositor_of(&session).0, &session.plan().assignment).await;
    raw.say(Some(1), 0).await;
    let refused = raw.refused().await;
    assert_eq!(refused.code(), Code::ResourceExhausted, "{refused}");
    assert!(refused.message().contains("set-memory: "), "{refused}");
}
