//! A base in a cluster: a layered depth cube beside the images of view cells, which every view is made from.

use std::f32::consts::{PI, TAU};
use std::time::Duration;

use client::{Session, ViewRequest};
use cluster::{BudgetRequest, CommonCell, CommonKind, DIRECT, PolicyChoice, SessionRequest, Timeline};
use cluster_tests::cluster::{CUBE, Cluster, camera_around, cube_grid, offer, request};
use cluster_tests::scalar_engine::Pace;
use cluster_tests::watcher::eventually;
use coordinator::SceneOffer;
use depth_image::{Aabb, PinholeCamera};
use glam::{UVec2, Vec3};

const STILL: Timeline = Timeline { start_s: 1.0, step_s: 0.0, set_count: 1 };
pub const SOON: Duration = Duration::from_secs(20);

/// The scene with a base.
fn with_base() -> SceneOffer {
    let offer = offer();
    let cell = CommonCell { kind: CommonKind::Base, bounds: offer.volume, sampling: CUBE.to_owned() };
    SceneOffer { base: Some((cell, cube_grid())), ..offer }
}

pub fn around(azimuth_rad: f32) -> PinholeCamera {
    camera_around(azimuth_rad, 3.0, UVec2::new(36, 27))
}

pub fn asked(viewpoints: Vec<PinholeCamera>) -> SessionRequest {
    let asked = request(PolicyChoice::Pipeline, STILL);
    SessionRequest { forced_sampler_count: Some(1), viewpoints, ..asked }
}

pub async fn frames(session: &Session, azimuths: impl IntoIterator<Item = f32>) -> usize {
    let request = |(frame, azimuth)| ViewRequest { frame, set_index: 0, camera: around(azimuth) };
    let requests: Vec<ViewRequest> = (0..).zip(azimuths).map(request).collect();
    session.render_views(requests).unwrap().all().await.unwrap().len()
}

pub fn kinds(session: &Session) -> Vec<CommonKind> {
    session.plan().assignment.workload.common_cells.iter().map(|cell| cell.kind).collect()
}

/// It depends on no viewer: who moves has a view cell sampled, and no more.
#[tokio::test(flavor = "multi_thread")]
async fn a_base_is_sampled_once_wherever_viewers_walk() {
    let cluster = Cluster::start_offering(with_base(), 3).await;
    let session = cluster.session(asked(vec![around(0.0)])).await.unwrap();
    assert_eq!(kinds(&session), [CommonKind::Base]);
    assert_eq!(frames(&session, [0.0, 0.02]).await, 2);
    assert_eq!(cluster.take_counts(), [1; 4], "one image of the cell, three of the base");
    let epoch = session.plan().assignment.plan_epoch;
    session.set_viewpoints(vec![around(PI)]).await.unwrap();
    eventually("a cell there", SOON, || session.plan().assignment.plan_epoch > epoch).await;
    assert_eq!(frames(&session, [PI]).await, 1);
    assert_eq!(cluster.take_counts(), [1], "the new cell's alone");
    assert_eq!(kinds(&session), [CommonKind::Base]);
}

/// A killed compositor's successor loads its view cell and the base, each once.
#[tokio::test(flavor = "multi_thread")]
async fn a_successor_of_a_killed_compositor_pulls_the_base_once() {
    let mut cluster = Cluster::start_offering(with_base(), 3).await;
    cluster.keep_pace(Pace::from_ms(10, 20));
    let session = cluster.session(asked(vec![around(0.0)])).await.unwrap();
    let views = || (0..12).map(|view| 0.002 * view as f32);
    assert_eq!(frames(&session, views()).await, 12);
    cluster.take_counts();
    cluster.kill_compositor(&session.plan().assignment);
    assert_eq!(frames(&session, views()).await, 12);
    cluster.add_node(|config| config);
    eventually("a successor", SOON, || session.plan().assignment.composites("n3")).await;
    // A node warms up by small images before it joins.
    cluster.take_counts();
    frames(&session, views().chain(views())).await;
    eventually("its sets", SOON, || cluster.metrics[3].sets_loaded.get() > 1).await;
    frames(&session, views().chain(views())).await;
    assert_eq!(cluster.metrics[3].sets_loaded.get(), 2, "its view cell and the base");
    assert_eq!(cluster.take_counts(), [0; 0], "nothing is sampled again");
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_that_no_base_suits_have_none() {
    let cluster = Cluster::start_offering(with_base(), 1).await;
    let moving = Timeline { start_s: 0.0, step_s: 0.05, set_count: 4 };
    let volume = Some(Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE });
    let policy = PolicyChoice::Direct;
    let method = DIRECT.to_owned();
    for asked in [
        SessionRequest { timeline: moving, ..asked(Vec::new()) },
        SessionRequest { volume, ..asked(Vec::new()) },
        SessionRequest { sampling: CUBE.to_owned(), ..asked(Vec::new()) },
        SessionRequest { policy, method, forced_sampler_count: None, ..asked(Vec::new()) },
    ] {
        let session = cluster.session(asked).await.unwrap();
        assert_eq!(kinds(&session), []);
        cluster.close(session).await;
    }
    let budget = BudgetRequest { budget: Some("flip 0.1".to_owned()), ..BudgetRequest::default() };
    let policy = PolicyChoice::Auto;
    let asked = SessionRequest { budget, policy, forced_sampler_count: None, ..asked(Vec::new()) };
    let refused = cluster.session(asked).await;
    assert!(refused.err().unwrap().to_string().contains("and beside a base"));
}

#[tokio::test(flavor = "multi_thread")]
async fn mirrors_and_a_base_go_together() {
    let cluster = Cluster::start_offering(with_base(), 2).await;
    let asked =
        SessionRequest { follows_mirrors: true, ..asked((0..4).map(|i| around(TAU * i as f32 / 4.0)).collect()) };
    let session = cluster.session(asked).await.unwrap();
    assert_eq!(kinds(&session), [CommonKind::Mirrors, CommonKind::Mirrors, CommonKind::Base]);
    assert_eq!(session.plan().assignment.workload.view_cell_count(), 4);
    assert_eq!(frames(&session, [0.0, PI]).await, 2);
}
