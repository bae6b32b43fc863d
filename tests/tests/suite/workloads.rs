//! Several workloads are served side by side, and no session ends another.

use std::time::Duration;

use client::{ClientError, Frame, Session};
use cluster::{DIRECT, Policy, PolicyChoice, Refinement, SessionEvent, SessionRequest, SessionStage, Timeline};
use cluster_tests::cluster::{Cluster, connected, request, views};
use cluster_tests::picture::fault_of;
use cluster_tests::scalar_engine::ScalarEngine;
use codec::FrameCodec;
use coordinator::CoordinatorConfig;
use glam::UVec2;

const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 1.0, set_count: 3 };

fn pipeline(timeline: Timeline) -> SessionRequest {
    request(PolicyChoice::Pipeline, timeline)
}

/// A workload of its own for each number: the moments differ.
fn numbered(number: u32) -> SessionRequest {
    SessionRequest { policy: PolicyChoice::Auto, ..pipeline(Timeline { start_s: 0.1 * f64::from(number), ..MOVING }) }
}

/// A client that does not wait for its session.
const HASTE: Duration = Duration::from_millis(5);
const DEADLINE: Duration = Duration::from_secs(60);

/// The frames of two views of each set.
async fn frames_of(session: &Session) -> Vec<Frame> {
    let frames = session.render_views(views(3, 2)).unwrap().all().await.unwrap();
    assert_eq!(frames.len(), 6);
    frames
}

fn workload_of(session: &Session) -> u64 {
    session.plan().assignment.workload_number
}

/// Every frame shows the moment and the refinement of its own session.
fn shows(frames: &[Frame], timeline: Timeline, refinement: Refinement) {
    for frame in frames {
        let scene_time_s = timeline.start_s + timeline.step_s * f64::from(frame.request.set_index);
        assert_eq!(fault_of(frame, scene_time_s as f32, refinement), None);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_of_two_workloads_are_served_side_by_side() {
    let cluster = Cluster::start(2).await;
    let later = Timeline { start_s: 0.5, ..MOVING };
    let one = cluster.session(pipeline(MOVING)).await.unwrap();
    let other = cluster.session(pipeline(later)).await.unwrap();
    assert_ne!(workload_of(&one), workload_of(&other));
    for _ in 0..2 {
        let (of_one, of_other) = tokio::join!(frames_of(&one), frames_of(&other));
        shows(&of_one, MOVING, Refinement::default());
        shows(&of_other, later, Refinement::default());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_that_differ_in_codec_or_method_share_a_workload() {
    let cluster = Cluster::start(2).await;
    let one = cluster.session(pipeline(MOVING)).await.unwrap();
    let jpeg = cluster.session(SessionRequest { codec: "jpeg:80".to_owned(), ..pipeline(MOVING) }).await.unwrap();
    let direct = cluster.session(SessionRequest { method: DIRECT.to_owned(), ..pipeline(MOVING) }).await.unwrap();
    assert_eq!([workload_of(&jpeg), workload_of(&direct)], [workload_of(&one); 2]);
    let (of_one, of_jpeg, of_direct) = tokio::join!(frames_of(&one), frames_of(&jpeg), frames_of(&direct));
    shows(&of_one, MOVING, Refinement::default());
    assert!(of_jpeg.iter().all(|frame| frame.header.codec == FrameCodec::Jpeg { quality: 80 }));
    assert_eq!(of_direct.len(), of_one.len());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pipeline_serves_direct_views() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(SessionRequest { method: DIRECT.to_owned(), ..pipeline(MOVING) }).await.unwrap();
    assert_eq!(session.plan().assignment.policy, Policy::Pipeline);
    let reconstructed = || cluster.engines.iter().map(ScalarEngine::take_reconstructed).sum::<usize>();
    // Those of the measurement.
    reconstructed();
    shows(&frames_of(&session).await, MOVING, Refinement::default());
    assert_eq!(reconstructed(), 0, "each view was drawn from the scene");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_workload_beyond_the_most_is_refused_and_the_others_go_on() {
    let cluster = Cluster::start(2).await;
    let most = CoordinatorConfig::default().max_workloads as u32;
    let mut sessions = Vec::new();
    for number in 0..most {
        sessions.push(cluster.session(numbered(number)).await.unwrap());
    }
    let refused = cluster.session(numbered(most)).await.unwrap_err();
    assert!(matches!(&refused, ClientError::Exhausted { reason } if reason.contains("--max-workloads")), "{refused}");
    let unmeasured = SessionRequest { sample_size_px: Some(UVec2::splat(9)), ..numbered(most) };
    let refused = cluster.client.open_session(unmeasured, |_| ()).await.unwrap_err();
    assert!(matches!(&refused, ClientError::Exhausted { .. }), "{refused}");
    assert_eq!(cluster.take_counts(), [0; 0], "before costs were measured");
    let shared = cluster.session(numbered(0)).await.unwrap();
    assert_eq!(workload_of(&shared), workload_of(&sessions[0]), "an open workload takes more sessions");
    for (number, session) in (0..).zip(&sessions) {
        shows(&frames_of(session).await, numbered(number).timeline, Refinement::default());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_that_are_opened_and_dropped_in_numbers_disturb_nobody() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(numbered(0)).await.unwrap();
    // A connection with thousands of cancelled calls may end, with all of its sessions: the others have one of their own.
    let others = connected(&cluster.coordinator.address).await;
    let mut begun = tokio::task::JoinSet::new();
    let mut dropped = 0;
    for number in 0..10_000 {
        let client = others.clone();
        let size_px = UVec2::splat(8 + number % 20);
        let request = SessionRequest { sample_size_px: Some(size_px), ..numbered(number % 50) };
        begun.spawn(async move { tokio::time::timeout(HASTE, client.open_session(request, |_| ())).await.map(drop) });
        while begun.len() > 100 {
            dropped += begun.join_next().await.map_or(0, |_| 1);
        }
    }
    let (frames, ()) = tokio::join!(frames_of(&session), async {
        while begun.join_next().await.is_some() {
            dropped += 1;
        }
    });
    assert_eq!(dropped, 10_000);
    shows(&frames, numbered(0).timeline, Refinement::default());
    let start = std::time::Instant::now();
    let open = async || {
        let status = cluster.client.status().await.unwrap();
        (status.session_count(), status.workloads.len())
    };
    // Some are still being opened when their clients have left.
    while open().await != (1, 1) {
        assert!(start.elapsed() < DEADLINE, "dropped sessions are still open");
        tokio::time::sleep(HASTE).await;
    }
    shows(&frames_of(&session).await, numbered(0).timeline, Refinement::default());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_predicted_view_size_opens_at_once_and_is_measured_on_an_idle_node() {
    let cluster = Cluster::start(2).await;
    let reconstructed = || cluster.engines.iter().map(ScalarEngine::take_reconstructed).sum::<usize>();
    let _known = cluster.session(numbered(0)).await.unwrap();
    assert!(reconstructed() > 0, "it was measured");
    let mut larger = numbered(0);
    larger.typical_view = larger.typical_view.resized(larger.typical_view.size_px * 2);
    let mut stages = Vec::new();
    let note = |event: &SessionEvent| match event {
        SessionEvent::Progress { stage, .. } => stages.push(*stage),
        SessionEvent::Opened { .. } | SessionEvent::Plan(_) | SessionEvent::Promise(_) => (),
    };
    let _predicted = cluster.client.open_session(larger, note).await.unwrap();
    assert!(!stages.is_empty() && !stages.contains(&SessionStage::Measuring), "{stages:?}");
    let start = std::time::Instant::now();
    while reconstructed() == 0 {
        assert!(start.elapsed() < DEADLINE, "the predicted size is not measured");
        tokio::time::sleep(HASTE).await;
    }
}
