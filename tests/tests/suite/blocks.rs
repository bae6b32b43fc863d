//! Blocks of a scene in a cluster: sets that every view is made from, and that depend on no viewer.

use std::f32::consts::PI;

use cluster::{BudgetRequest, CommonCell, CommonKind, DIRECT, PolicyChoice, SessionRequest};
use cluster_tests::cluster::{Cluster, offer};
use cluster_tests::watcher::eventually;
use coordinator::{OfferedCell, SceneOffer};
use depth_image::{Aabb, PinholeCamera};
use glam::{UVec2, Vec3};

use crate::bases::{self, SOON, around, frames, kinds};

/// The scene with two blocks side by side.
fn with_blocks() -> SceneOffer {
    let offer = offer();
    let Aabb { min, max } = offer.volume;
    let middle = 0.5 * (min.x + max.x);
    let halves = [Aabb { min, max: max.with_x(middle) }, Aabb { min: min.with_x(middle), max }];
    let blocks = halves.map(|bounds| {
        let eye = bounds.center() + Vec3::Y * 3.0;
        let camera = PinholeCamera::looking_at(eye, bounds.center(), Vec3::Z, 0.8, UVec2::new(40, 30));
        let cell = CommonCell { kind: CommonKind::Block, bounds, sampling: "conventional".to_owned() };
        OfferedCell { cell, cameras: vec![camera.into()] }
    });
    SceneOffer { blocks: blocks.to_vec(), ..offer }
}

fn asked(viewpoints: Vec<PinholeCamera>) -> SessionRequest {
    SessionRequest { follows_mirrors: true, ..bases::asked(viewpoints) }
}

#[tokio::test(flavor = "multi_thread")]
async fn blocks_are_sampled_once_wherever_viewers_walk() {
    let cluster = Cluster::start_offering(with_blocks(), 3).await;
    let session = cluster.session(asked(vec![around(0.0)])).await.unwrap();
    assert_eq!(kinds(&session), [CommonKind::Block; 2], "and no mirrors");
    assert_eq!(frames(&session, [0.0, 0.02]).await, 2);
    assert_eq!(cluster.take_counts(), [1; 3], "one image of the cell, one of each block");
    let epoch = session.plan().assignment.plan_epoch;
    session.set_viewpoints(vec![around(PI)]).await.unwrap();
    eventually("a cell there", SOON, || session.plan().assignment.plan_epoch > epoch).await;
    assert_eq!(frames(&session, [PI]).await, 1);
    assert_eq!(cluster.take_counts(), [1], "the new cell's alone");
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_of_direct_views_have_no_blocks_and_budgets_are_refused() {
    let cluster = Cluster::start_offering(with_blocks(), 2).await;
    let direct = SessionRequest {
        policy: PolicyChoice::Direct,
        method: DIRECT.to_owned(),
        forced_sampler_count: None,
        ..asked(Vec::new())
    };
    let session = cluster.session(direct).await.unwrap();
    assert_eq!(kinds(&session), []);
    cluster.close(session).await;
    let budget = BudgetRequest { budget: Some("flip 0.1".to_owned()), ..BudgetRequest::default() };
    let policy = PolicyChoice::Auto;
    let asked =
        SessionRequest { budget, policy, forced_sampler_count: None, follows_mirrors: false, ..asked(Vec::new()) };
    let refused = cluster.session(asked).await;
    assert!(refused.err().unwrap().to_string().contains("beside a base or blocks"));
}
