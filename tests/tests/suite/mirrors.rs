//! Mirror cells: images of what mirrors show, which every view is made from.

use std::f32::consts::PI;
use std::time::Duration;

use client::{Frame, Session, ViewRequest};
use cluster::{DIRECT, PolicyChoice, SessionRequest, Timeline};
use cluster_tests::cluster::{Cluster, camera, camera_around, offer, request, views};
use cluster_tests::scalar_engine::{ball_linear, srgb8};
use cluster_tests::watcher::eventually;
use depth_image::PinholeCamera;
use glam::UVec2;

const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 0.5, set_count: 4 };
const STILL: Timeline = Timeline { start_s: 1.0, step_s: 0.0, set_count: 1 };
const SOON: Duration = Duration::from_secs(5);

fn following(timeline: Timeline) -> SessionRequest {
    SessionRequest { follows_mirrors: true, ..request(PolicyChoice::Pipeline, timeline) }
}

/// What the mirrors of a frame show, one pixel each.
fn mirrored(frame: &Frame) -> [[u8; 3]; 2] {
    let pixel = |at: usize| frame.view.srgb8[3 * at..][..3].try_into().unwrap();
    [pixel(0), pixel(1)]
}

fn ball_at(scene_time_s: f32) -> [u8; 3] {
    srgb8(ball_linear(scene_time_s, cluster::Refinement::default()))
}

async fn frames(session: &Session, views: Vec<ViewRequest>) -> Vec<Frame> {
    let mut frames = session.render_views(views).unwrap().all().await.unwrap();
    frames.sort_by_key(|frame| frame.request.frame);
    frames
}

fn around(azimuth_rad: f32) -> PinholeCamera {
    camera_around(azimuth_rad, 3.0, UVec2::new(48, 36))
}

/// Views and mirrors of a frame show one moment: the ball has another colour in each.
#[tokio::test(flavor = "multi_thread")]
async fn mirrors_show_the_moment_of_their_view() {
    let cluster = Cluster::start(3).await;
    let session = cluster.session(following(MOVING)).await.unwrap();
    let plan = session.plan().assignment;
    let own = plan.workload.view_cell_count();
    assert_eq!((own, plan.workload.common_cells.len(), plan.image_count()), (1, 2, 3 + 2));
    for frame in frames(&session, views(MOVING.set_count, 6)).await {
        let time_s = MOVING.time_s(frame.request.set_index).unwrap();
        assert_eq!(mirrored(&frame), [ball_at(time_s); 2], "set {}", frame.request.set_index);
        assert_eq!(frame.header.cell, 0);
    }
    let counts = cluster.take_counts();
    assert_eq!(counts, vec![1; counts.len()], "each image once, for all compositors");
    assert_eq!(counts.len(), plan.image_count() * MOVING.set_count as usize);
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_that_follow_no_mirrors_have_no_mirror_cells() {
    let cluster = Cluster::start(2).await;
    for asked in [
        request(PolicyChoice::Pipeline, STILL),
        SessionRequest { method: DIRECT.to_owned(), policy: PolicyChoice::Auto, ..following(STILL) },
    ] {
        let session = cluster.session(asked).await.unwrap();
        assert_eq!(session.plan().assignment.workload.common_cells, []);
        cluster.close(session).await;
    }
    let budget = cluster::BudgetRequest { budget: Some("flip 0.1".to_owned()), names_method: false };
    let refused = cluster
        .session(SessionRequest { budget, policy: PolicyChoice::Auto, ..following(STILL) })
        .await
        .err()
        .unwrap()
        .to_string();
    assert!(refused.contains("budget: none can be kept for images of what mirrors show"), "{refused}");
}

/// Mirrors depend on no viewer.
#[tokio::test(flavor = "multi_thread")]
async fn no_mirror_image_is_sampled_again_when_viewers_move() {
    let cluster = Cluster::start(3).await;
    let from = |azimuth| SessionRequest { viewpoints: vec![around(azimuth)], ..following(STILL) };
    let view = |azimuth| vec![ViewRequest { frame: 0, set_index: 0, camera: around(azimuth) }];
    let session = cluster.session(from(0.0)).await.unwrap();
    let first = frames(&session, view(0.0)).await;
    assert_eq!(cluster.take_counts(), [1; 3], "one of the cell, two of mirrors");
    let epoch = session.plan().assignment.plan_epoch;
    session.set_viewpoints(vec![around(PI)]).await.unwrap();
    let has_moved = || session.plan().assignment.plan_epoch > epoch;
    eventually("a cell there", SOON, has_moved).await;
    let second = frames(&session, view(PI)).await;
    assert_eq!(cluster.take_counts(), [1], "the new cell's alone");
    assert_eq!(mirrored(&first[0]), mirrored(&second[0]));
    assert_eq!(session.plan().assignment.workload.common_cells.len(), 2);
}

/// The images of a mirror are being made when their sampler is killed.
#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_is_killed_amid_mirror_images_changes_no_frame() {
    let alone = Cluster::start(1).await;
    let session = alone.session(SessionRequest { policy: PolicyChoice::TimeShare, ..following(MOVING) }).await.unwrap();
    let expected = frames(&session, views(MOVING.set_count, 6)).await;
    let mut cluster = Cluster::start(3).await;
    let session = cluster.session(following(MOVING)).await.unwrap();
    let plan = session.plan().assignment;
    let cell = plan.of_cell(plan.workload.view_cell_count() as u32).unwrap();
    let node: usize = cell.samplers[0].node_name.trim_start_matches('n').parse().unwrap();
    let engine = cluster.engines[node].clone();
    let mirror_cameras = offer().mirrors.into_iter().flat_map(|mirror| mirror.cameras);
    mirror_cameras.for_each(|camera| engine.hold_samples_from(camera.reference().eye_in_world));
    let stream = session.render_views(views(MOVING.set_count, 6)).unwrap();
    eventually("sampling has begun", SOON, || engine.held_calls() > 0).await;
    cluster.nodes[node].kill();
    engine.release();
    let mut received = stream.all().await.unwrap();
    received.sort_by_key(|frame| frame.request.frame);
    assert_eq!(received.len(), expected.len());
    for (frame, expected) in received.iter().zip(&expected) {
        assert_eq!(frame.view.srgb8, expected.view.srgb8, "frame {}", frame.request.frame);
    }
    assert!(session.plan().assignment.plan_epoch > plan.plan_epoch);
}

#[tokio::test(flavor = "multi_thread")]
async fn live_views_have_mirrors() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(following(STILL)).await.unwrap();
    let mut live = session.live();
    live.set_pose(camera(0.0, UVec2::new(48, 36)), 0).unwrap();
    let frame = live.next().await.unwrap().frame;
    assert_eq!(mirrored(&frame), [ball_at(1.0); 2]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_view_whose_sets_exceed_the_memory_is_refused_by_its_name() {
    let texels: usize = offer().rig.iter().map(depth_image::Camera::pixel_count).sum();
    // Room for a view cell's set and its packed images, not for the mirrors' beside it.
    let small = |config| node::NodeConfig { set_memory_bytes: texels * 45 * 2, ..config };
    let cluster = Cluster::start_with(2, small).await;
    let session = cluster.session(following(STILL)).await.unwrap();
    let refused = session.render_views(views(1, 1)).unwrap().all().await.err().map(|error| error.to_string());
    assert!(refused.is_some_and(|text| text.contains("of a view's sample sets exceed")), "they do not fit");
}
