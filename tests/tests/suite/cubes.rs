//! A layered depth cube in a cluster: one sample set for viewers anywhere.

use std::f32::consts::TAU;
use std::time::Duration;

use client::{Frame, Session, ViewRequest};
use cluster::{BudgetRequest, DIRECT, PolicyChoice, Refinement, SessionRequest, Timeline};
use cluster_tests::cluster::{CUBE, Cluster, camera_around, offer_with_light_field, request, rig};
use cluster_tests::picture::fault_of;
use cluster_tests::scalar_engine::Pace;
use cluster_tests::watcher::eventually;
use depth_image::{Aabb, PinholeCamera, ProvenanceKind};
use glam::{UVec2, Vec3};

const STILL: Timeline = Timeline { start_s: 1.0, step_s: 0.0, set_count: 1 };
const SOON: Duration = Duration::from_secs(20);

fn view(azimuth_rad: f32) -> PinholeCamera {
    camera_around(azimuth_rad, 2.4, UVec2::new(36, 27))
}

fn around(count: usize) -> impl Iterator<Item = f32> {
    (0..count).map(move |i| TAU * i as f32 / count as f32)
}

fn sampled_as_cube(viewpoints: Vec<PinholeCamera>) -> SessionRequest {
    let asked = request(PolicyChoice::Pipeline, STILL);
    SessionRequest { sampling: CUBE.to_owned(), forced_sampler_count: Some(1), viewpoints, ..asked }
}

async fn frames(session: &Session, azimuths: impl IntoIterator<Item = f32>) -> Vec<Frame> {
    let request = |(frame, azimuth)| ViewRequest { frame, set_index: 0, camera: view(azimuth) };
    let requests: Vec<ViewRequest> = (0..).zip(azimuths).map(request).collect();
    session.render_views(requests).unwrap().all().await.unwrap()
}

/// The share of pixels in the picture's middle, which shows the ball, that samples show.
fn known_in_the_middle(frame: &Frame) -> f64 {
    let provenance = frame.view.provenance.as_ref().unwrap();
    let middle = (11..17).flat_map(|row| (15..21).map(move |column| row * 36 + column));
    let hits = middle.filter(|&pixel| provenance[pixel].kind() == ProvenanceKind::Hit).count();
    hits as f64 / 36.0
}

/// One set serves viewers from everywhere: nothing is sampled again, and no plan is made, when they walk.
#[tokio::test(flavor = "multi_thread")]
async fn viewers_that_walk_around_cause_no_sampling_and_no_plan() {
    let cluster = Cluster::start(3).await;
    let session = cluster.session(sampled_as_cube(vec![view(0.0)])).await.unwrap();
    let plan = session.plan().assignment;
    assert_eq!((plan.workload.sample_cameras.len(), plan.workload.cell_count()), (3, 1));
    assert!(plan.workload.samples_cube());
    assert!(frames(&session, around(24)).await.iter().all(|frame| known_in_the_middle(frame) > 0.9));
    assert_eq!(cluster.take_counts(), vec![1; plan.image_count()], "each image once, for all compositors");
    for azimuth in around(6) {
        session.set_viewpoints(vec![view(azimuth), view(azimuth + 0.5)]).await.unwrap();
        assert!(known_in_the_middle(&frames(&session, [azimuth]).await[0]) > 0.9);
    }
    let second = cluster.session(sampled_as_cube(around(8).map(view).collect())).await.unwrap();
    frames(&second, around(8)).await;
    assert_eq!(second.plan().assignment.workload_number, plan.workload_number, "of one workload");
    assert_eq!(session.plan().assignment.plan_epoch, second.plan().assignment.plan_epoch);
    assert_eq!(session.plan().assignment.workload, plan.workload);
    assert_eq!(cluster.take_counts(), [0; 0]);
}

/// A killed compositor's successor loads the images that are sampled already, once.
#[tokio::test(flavor = "multi_thread")]
async fn a_successor_of_a_killed_compositor_pulls_the_set_once() {
    let mut cluster = Cluster::start(3).await;
    cluster.keep_pace(Pace::from_ms(10, 20));
    let session = cluster.session(sampled_as_cube(vec![view(0.0)])).await.unwrap();
    frames(&session, around(12)).await;
    cluster.take_counts();
    check_successor(&mut cluster, &session).await;
}

/// The fourth image of the set. Viewers that walk cause no more of it, and a successor loads it with the cube.
#[tokio::test(flavor = "multi_thread")]
async fn tiles_of_a_light_field_are_sampled_once_and_a_successor_pulls_them_once() {
    let mut cluster = Cluster::start_offering(offer_with_light_field(), 3).await;
    cluster.keep_pace(Pace::from_ms(10, 20));
    let asked = SessionRequest { forced_tile_count: Some(2), ..sampled_as_cube(vec![view(0.0)]) };
    let session = cluster.session(asked).await.unwrap();
    let plan = session.plan().assignment;
    assert_eq!((plan.workload.sample_cameras.len(), plan.image_count()), (4, 8), "two tiles each");
    assert!(plan.workload.sample_cameras[3].light_field().is_some());
    for azimuth in around(6) {
        session.set_viewpoints(vec![view(azimuth)]).await.unwrap();
        assert!(known_in_the_middle(&frames(&session, [azimuth]).await[0]) > 0.9);
    }
    assert_eq!(cluster.take_counts(), [1; 8]);
    assert_eq!(session.plan().assignment.plan_epoch, plan.plan_epoch);
    check_successor(&mut cluster, &session).await;
}

/// Three steps over six moments. Each step has images of the cube and a light field of its own, as the cells' images have.
#[tokio::test(flavor = "multi_thread")]
async fn each_step_of_light_samples_the_cube_and_its_light_field_once() {
    let cluster = Cluster::start_offering(offer_with_light_field(), 3).await;
    let timeline = Timeline { set_count: 6, ..STILL };
    let asked = SessionRequest { timeline, refinement_steps: 3, ..sampled_as_cube(vec![view(0.0)]) };
    let session = cluster.session(asked.clone()).await.unwrap();
    let plan = session.plan().assignment;
    assert_eq!(plan.workload.sample_cameras.len(), 4);
    assert_ne!(plan.set_content(0), plan.set_content(1));
    assert!((2..6).all(|set_index| plan.set_content(set_index) == plan.set_content(2)));
    let of_set = |set_index: u32| {
        let request = move |(number, azimuth)| ViewRequest {
            frame: u64::from(4 * set_index + number),
            set_index,
            camera: view(azimuth),
        };
        (0..).zip(around(4)).map(request)
    };
    let frames = session.render_views((0..6).flat_map(of_set).collect::<Vec<_>>()).unwrap().all().await.unwrap();
    assert_eq!(frames.len(), 24);
    for frame in &frames {
        let refinement = Refinement { step: frame.request.set_index.min(2), steps: 3 };
        assert_eq!(fault_of(frame, STILL.start_s as f32, refinement), None);
    }
    assert_eq!(cluster.take_counts(), [1; 12], "four images of three steps, none twice, none ahead of the last");
    let again = cluster.session(asked).await.unwrap();
    again.render_views(of_set(5).collect::<Vec<_>>()).unwrap().all().await.unwrap();
    assert!(cluster.take_counts().is_empty(), "a new session shows what is there");
}

/// Kills a compositor, and checks what the node in its place loads.
async fn check_successor(cluster: &mut Cluster, session: &Session) {
    let plan = session.plan().assignment;
    cluster.kill_compositor(&plan);
    let all = frames(session, around(12)).await;
    assert!(all.len() == 12 && all.iter().all(|frame| known_in_the_middle(frame) > 0.9));
    assert_eq!(cluster.take_counts(), [0; 0], "the others have the set");
    cluster.add_node(|config| config);
    let has_successor = || session.plan().assignment.composites("n3");
    eventually("a successor", SOON, has_successor).await;
    // A node warms up by a small set before it joins.
    assert_eq!(cluster.engines[3].take_counts().len(), plan.workload.sample_cameras.len());
    frames(session, around(36)).await;
    eventually("its set", SOON, || cluster.metrics[3].sets_loaded.get() > 0).await;
    frames(session, around(36)).await;
    assert_eq!(cluster.metrics[3].sets_loaded.get(), 1);
    assert_eq!(cluster.take_counts(), [0; 0], "nothing is sampled again");
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_cube_does_not_serve_is_refused_by_name() {
    let cluster = Cluster::start(1).await;
    let refused = async |asked: SessionRequest| cluster.session(asked).await.err().unwrap().to_string();
    let moving = Timeline { start_s: 0.0, step_s: 0.05, set_count: 4 };
    let asked = SessionRequest { timeline: moving, ..sampled_as_cube(Vec::new()) };
    assert!(refused(asked).await.contains("timeline: scenes that move are not sampled by cube"));
    let asked = SessionRequest { sample_cameras: rig(), ..sampled_as_cube(Vec::new()) };
    assert!(refused(asked).await.contains("sample_cameras: "));
    let asked = SessionRequest { sample_size_px: Some(UVec2::splat(64)), ..sampled_as_cube(Vec::new()) };
    assert!(refused(asked).await.contains("sample_image_size: "));
    let volume = Some(Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE });
    let asked = SessionRequest { volume, ..sampled_as_cube(Vec::new()) };
    assert!(refused(asked).await.contains("volume: "));
    let budget = BudgetRequest { budget: Some("flip 0.1".to_owned()), ..BudgetRequest::default() };
    let policy = PolicyChoice::Auto;
    let asked = SessionRequest { budget, policy, forced_sampler_count: None, ..sampled_as_cube(Vec::new()) };
    assert!(refused(asked).await.contains("budget: none can be kept for a layered cube"));
}

/// Whoever has views drawn directly changes nothing for viewers of the cube.
#[tokio::test(flavor = "multi_thread")]
async fn directly_drawn_views_are_of_another_workload() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(sampled_as_cube(vec![view(0.0)])).await.unwrap();
    let plan = session.plan().assignment;
    let asked = SessionRequest {
        method: DIRECT.to_owned(),
        policy: PolicyChoice::Direct,
        forced_sampler_count: None,
        ..sampled_as_cube(Vec::new())
    };
    let drawn = cluster.session(asked).await.unwrap();
    assert_ne!(drawn.plan().assignment.workload_number, plan.workload_number);
    assert!(!drawn.plan().assignment.workload.samples_cube());
    frames(&drawn, [0.3]).await;
    assert_eq!(session.plan().assignment.policy, plan.policy);
}
