//! Clusters in one process over real ports: every view arrives once, and from one set.

use std::collections::HashSet;

use client::{Frame, ViewRequest};
use cluster::{Policy, PolicyChoice, Refinement, SceneHash, SessionRequest, Timeline};
use cluster_tests::cluster::{Cluster, package, request, views};
use cluster_tests::picture::fault_of;
use depth_image::{Antialias, ProvenanceKind, ToneCurve, ToneMapping, View, ViewPlanes};
use node::NodeConfig;

const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 1.0, set_count: 3 };

/// The ball shows its own time and step and no other; floor and sky are there, and no other colour.
fn shows_only(frame: &Frame, scene_time_s: f32, refinement: Refinement) {
    assert_eq!(fault_of(frame, scene_time_s, refinement), None);
}

/// All frames came once, each of its own set.
fn all_came(frames: &[Frame], asked: usize) {
    let numbers: HashSet<u64> = frames.iter().map(|frame| frame.request.frame).collect();
    assert_eq!((frames.len(), numbers.len()), (asked, asked));
    for frame in frames {
        assert_eq!(frame.header.sample_set_id.index, u64::from(frame.request.set_index));
        shows_only(frame, frame.request.set_index as f32, Refinement::default());
        let provenance = frame.view.provenance.as_ref().unwrap();
        assert!(provenance.iter().any(|p| p.kind() == ProvenanceKind::Hit));
        assert_eq!(frame.view.inverse_depth_per_m.as_ref().unwrap().len(), provenance.len());
    }
}

async fn pipeline_of(nodes: usize) {
    let cluster = Cluster::start(nodes).await;
    let session = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    let plan = session.plan();
    assert_eq!(plan.assignment.policy, Policy::Pipeline);
    assert_eq!(
        plan.assignment.compositors.len(),
        nodes.max(2) - plan.sampler_count().min(nodes.max(2) - 1),
        "{}",
        plan.reason
    );
    let frames = session.render_views(views(3, 12)).unwrap().all().await.unwrap();
    all_came(&frames, 36);
    // There are three sets of three images; the next set is fetched ahead, and no image twice.
    assert_eq!(cluster.take_counts(), [1; 9]);
    let again = session.render_views(views(3, 12)).unwrap().all().await.unwrap();
    all_came(&again, 36);
    assert!(cluster.take_counts().is_empty(), "what was sampled is kept");
}

#[tokio::test(flavor = "multi_thread")]
async fn one_node_samples_and_composites() {
    pipeline_of(1).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn three_nodes_share_images_and_views() {
    pipeline_of(3).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn five_nodes_share_images_and_views() {
    pipeline_of(5).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn every_number_of_samplers_gives_the_same_pictures() {
    let cluster = Cluster::start(4).await;
    let mut pictures = Vec::new();
    for k in 1..=3 {
        let forced = SessionRequest { forced_sampler_count: Some(k), ..request(PolicyChoice::Pipeline, MOVING) };
        let session = cluster.session(forced).await.unwrap();
        assert_eq!(session.plan().sampler_count(), k as usize);
        let mut frames = session.render_views(views(3, 4)).unwrap().all().await.unwrap();
        frames.sort_by_key(|frame| frame.request.frame);
        pictures.push(frames.into_iter().map(|frame| frame.view).collect::<Vec<_>>());
        cluster.close(session).await;
    }
    assert!(pictures[0] == pictures[1] && pictures[1] == pictures[2]);
    let forced = SessionRequest { forced_sampler_count: Some(4), ..request(PolicyChoice::Pipeline, MOVING) };
    let error = cluster.session(forced).await.unwrap_err().to_string();
    assert!(error.contains("forced_sampler_count is 4, at most 3"), "{error}");
}

/// Samples a pixel belong to a request, not to the workload: the same sample images serve both.
#[tokio::test(flavor = "multi_thread")]
async fn frames_say_their_samples_a_pixel() {
    let cluster = Cluster::start(3).await;
    let four = Antialias::of(4).unwrap();
    let mut shown = Vec::new();
    for antialias in [Antialias::NONE, four] {
        let still = request(PolicyChoice::Pipeline, Timeline::still(0.0));
        let asked = SessionRequest { planes: ViewPlanes { antialias, ..still.planes }, ..still };
        let session = cluster.session(asked).await.unwrap();
        let mut frames = session.render_views(views(1, 6)).unwrap().all().await.unwrap();
        frames.sort_by_key(|frame| frame.request.frame);
        assert!(frames.iter().all(|frame| frame.header.antialias == antialias));
        shown.push(frames.into_iter().map(|frame| frame.view).collect::<Vec<_>>());
    }
    assert!(cluster.take_counts().is_empty(), "what was sampled for the measurement serves both");
    for (plain, smooth) in shown[0].iter().zip(&shown[1]) {
        let colors = |view: &View| view.srgb8.chunks(3).map(<[u8]>::to_vec).collect::<HashSet<_>>().len();
        assert!(colors(smooth) > colors(plain) + 3, "silhouettes are between two colours");
        assert_eq!(plain.inverse_depth_per_m, smooth.inverse_depth_per_m);
        assert_eq!(plain.provenance, smooth.provenance);
    }
}

/// Exposure and curve belong to a request, too. A session that leaves the exposure to the plan gets the plan's, whatever its
/// policy.
#[tokio::test(flavor = "multi_thread")]
async fn frames_say_their_tone_and_the_plan_its_exposure() {
    let cluster = Cluster::start(3).await;
    let still = request(PolicyChoice::Pipeline, Timeline::still(0.0));
    let plain = cluster.session(still.clone()).await.unwrap();
    let measured = plain.plan().auto_exposure;
    assert!(measured.ev().abs() <= 8.0 && measured.ev() != 0.0, "{measured}");
    assert_eq!(plain.tone(), ToneMapping::NONE);
    let mut planes = still.planes;
    planes.tone.curve = ToneCurve::KhronosNeutral;
    let shown = async |policy| {
        let asked = SessionRequest { planes, auto_exposure: true, policy, ..still.clone() };
        let session = cluster.session(asked).await.unwrap();
        let expected = ToneMapping { exposure: measured, curve: ToneCurve::KhronosNeutral };
        assert_eq!((session.plan().auto_exposure, session.tone()), (measured, expected));
        let frames = session.render_views(views(1, 6)).unwrap().all().await.unwrap();
        assert!(frames.iter().all(|frame| frame.header.tone == expected));
        session
    };
    let session = shown(PolicyChoice::Pipeline).await;
    let frames = plain.render_views(views(1, 6)).unwrap().all().await.unwrap();
    assert!(frames.iter().all(|frame| frame.header.tone == ToneMapping::NONE));
    assert!(cluster.take_counts().iter().all(|&times| times == 1), "samples serve all tones");
    // The sessions of a workload have one policy.
    cluster.close(session).await;
    cluster.close(plain).await;
    cluster.close(shown(PolicyChoice::Direct).await).await;
}

/// Nodes take whole sets in turn: each image is sampled once for any K, and pictures are equal.
#[tokio::test(flavor = "multi_thread")]
async fn sets_of_sequential_images_stay_on_one_node() {
    let cluster = Cluster::start(4).await;
    let mut pictures = Vec::new();
    for k in 1..=3 {
        let in_order = SessionRequest {
            sampling: "in_order".to_owned(),
            forced_sampler_count: Some(k),
            ..request(PolicyChoice::Pipeline, MOVING)
        };
        let session = cluster.session(in_order).await.unwrap();
        let samplers = session.plan().assignment.samplers.clone();
        assert_eq!(samplers.len(), k as usize);
        assert!(samplers.iter().all(|share| share.image_indices == [0, 1, 2]), "{samplers:?}");
        let mut frames = session.render_views(views(3, 4)).unwrap().all().await.unwrap();
        frames.sort_by_key(|frame| frame.request.frame);
        assert!(cluster.take_counts().iter().all(|&times| times == 1), "no image twice in a session");
        pictures.push(frames.into_iter().map(|frame| frame.view).collect::<Vec<_>>());
        cluster.close(session).await;
    }
    assert!(pictures[0] == pictures[1] && pictures[1] == pictures[2]);
    let still = SessionRequest {
        sampling: "in_order".to_owned(),
        forced_sampler_count: Some(2),
        ..request(PolicyChoice::Pipeline, Timeline::still(0.0))
    };
    let error = cluster.session(still).await.unwrap_err().to_string();
    assert!(error.contains("at most 1"), "one still set is sampled by one node: {error}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_direct_policy_draws_on_every_node_and_samples_nothing() {
    let cluster = Cluster::start(3).await;
    let session = cluster.session(request(PolicyChoice::Direct, MOVING)).await.unwrap();
    assert_eq!((session.plan().sampler_count(), session.plan().assignment.compositors.len()), (0, 3));
    let frames = session.render_views(views(3, 12)).unwrap().all().await.unwrap();
    all_came(&frames, 36);
    assert!(cluster.take_counts().is_empty());
    let costs = session.plan().costs;
    let reason = &session.plan().reason;
    assert!(
        costs.sample_image_s > 0.0
            && costs.direct_view_s > 0.0
            && costs.reconstruct_view_s > 0.0
            && costs.load_set_s > 0.0
            && costs.encode_view_s > 0.0
    );
    assert!(reason.starts_with("direct, asked for. Pipeline: "), "{reason}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_static_scene_is_sampled_once_for_all_sets_and_plans() {
    let cluster = Cluster::start(2).await;
    let still = request(PolicyChoice::Pipeline, Timeline { step_s: 0.0, ..MOVING });
    let session = cluster.session(still.clone()).await.unwrap();
    session.render_views(views(3, 4)).unwrap().all().await.unwrap();
    assert_eq!(cluster.take_counts(), [1; 3]);
    let session = cluster.session(still).await.unwrap();
    session.render_views(views(3, 4)).unwrap().all().await.unwrap();
    assert!(cluster.take_counts().is_empty());
}

/// Four steps over eight sets, by one node and by samplers apart from compositors.
#[tokio::test(flavor = "multi_thread")]
async fn a_static_scene_is_refined_step_by_step_and_each_step_sampled_once() {
    for nodes in [1, 3] {
        let cluster = Cluster::start(nodes).await;
        let timeline = Timeline { start_s: 0.0, step_s: 0.0, set_count: 8 };
        let refined = SessionRequest { refinement_steps: 4, ..request(PolicyChoice::Pipeline, timeline) };
        let session = cluster.session(refined.clone()).await.unwrap();
        let plan = &session.plan().assignment;
        assert!((3..8).all(|set_index| plan.set_content(set_index) == plan.set_content(3)));
        let frames = session.render_views(views(8, 4)).unwrap().all().await.unwrap();
        assert_eq!(frames.len(), 32);
        for frame in &frames {
            shows_only(frame, 0.0, Refinement { step: frame.request.set_index.min(3), steps: 4 });
        }
        assert_eq!(cluster.take_counts(), [1; 12], "four sets of three images, none twice, none ahead of the last");
        let again = cluster.session(refined).await.unwrap();
        let last: Vec<_> = views(8, 1).into_iter().filter(|view| view.set_index == 7).collect();
        let frames = again.render_views(last).unwrap().all().await.unwrap();
        shows_only(&frames[0], 0.0, Refinement::default());
        assert!(cluster.take_counts().is_empty(), "a new plan shows what is there");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_moving_scene_is_finished_in_every_set() {
    let cluster = Cluster::start(2).await;
    let refined = SessionRequest { refinement_steps: 4, ..request(PolicyChoice::Pipeline, MOVING) };
    let session = cluster.session(refined).await.unwrap();
    all_came(&session.render_views(views(3, 4)).unwrap().all().await.unwrap(), 12);
    assert_eq!(cluster.take_counts(), [1; 9]);
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_go_on_while_the_coordinator_is_gone() {
    let mut cluster = Cluster::start(2).await;
    let session = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    cluster.coordinator.kill();
    let frames = session.render_views(views(3, 6)).unwrap().all().await.unwrap();
    all_came(&frames, 18);
}

#[tokio::test(flavor = "multi_thread")]
async fn scenes_are_fetched_by_hash_and_stored_in_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let with_folder = |config: NodeConfig| NodeConfig { scene_folder: Some(folder.path().to_owned()), ..config };
    let cluster = Cluster::start_with(1, with_folder).await;
    let session = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    session.render_views(views(1, 1)).unwrap().all().await.unwrap();
    let kept = folder.path().join(format!("{}.scene", SceneHash::of(&package())));
    assert_eq!(std::fs::read(kept).unwrap(), package());
}

#[tokio::test(flavor = "multi_thread")]
async fn the_latest_eight_moments_stay_on_the_device_and_older_ones_are_loaded_again() {
    let cluster = Cluster::start(1).await;
    let timeline = Timeline { set_count: 20, ..MOVING };
    let session = cluster.session(request(PolicyChoice::Pipeline, timeline)).await.unwrap();
    let loaded_by = async |requests: Vec<ViewRequest>| {
        let before = cluster.metrics[0].sets_loaded.get();
        session.render_views(requests).unwrap().all().await.unwrap();
        cluster.metrics[0].sets_loaded.get() - before
    };
    let of_set = |set_index| views(20, 1).into_iter().filter(|view| view.set_index == set_index).collect();
    assert_eq!(loaded_by(views(20, 1)).await, 20);
    assert_eq!(loaded_by(of_set(19)).await, 0, "the last of the eight");
    assert_eq!(loaded_by(of_set(13)).await, 0, "one of the eight, and so are those that are fetched ahead of it");
    assert!(loaded_by(of_set(3)).await >= 1);
    assert!(cluster.take_counts().iter().all(|times| *times == 1), "samplers kept the images");
}
