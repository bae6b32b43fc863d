//! Nodes of a stated speed: views of a slow node are stolen, and K follows V.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use client::{Session, ViewRequest};
use cluster::{Assignment, PolicyChoice, SessionPlan, SessionRequest, Timeline};
use cluster_tests::cluster::{Cluster, request, views};
use cluster_tests::scalar_engine::Pace;

const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 1.0, set_count: 3 };
/// Time until a better plan is in force: three reevaluations, and a dwell of 5 s of the plan before it.
const SETTLED: Duration = Duration::from_secs(20);

async fn cluster_of(nodes: usize, pace: Pace) -> Cluster {
    let mut cluster = Cluster::start(nodes).await;
    cluster.keep_pace(pace);
    cluster
}

fn number_of(node_name: &str) -> usize {
    node_name[1..].parse().unwrap()
}

/// Three equal nodes share the views of one set; one has become five times as slow since it was measured.
#[tokio::test(flavor = "multi_thread")]
async fn views_of_a_compositor_that_became_slow_are_stolen() {
    const VIEWS: u32 = 600;
    let cluster = cluster_of(4, Pace::from_ms(1, 10)).await;
    let asked = request(PolicyChoice::Pipeline, Timeline { set_count: 1, ..MOVING });
    let asked = SessionRequest { forced_sampler_count: Some(1), views_per_set: VIEWS, ..asked };
    let session = cluster.session(asked).await.unwrap();
    let compositors: Vec<usize> =
        session.plan().assignment.compositors.iter().map(|share| number_of(&share.node_name)).collect();
    let slow = compositors[1];
    cluster.engines[slow].keep_pace(Pace::from_ms(1, 50));
    // The views of the measurement.
    compositors.iter().for_each(|&node| _ = cluster.engines[node].take_reconstructed());
    let frames = session.render_views(views(1, VIEWS)).unwrap().all().await.unwrap();
    let numbers: BTreeSet<u64> = frames.iter().map(|frame| frame.request.frame).collect();
    assert_eq!((numbers.len(), frames.len()), (VIEWS as usize, VIEWS as usize));
    let made: BTreeMap<usize, usize> =
        compositors.iter().map(|&node| (node, cluster.engines[node].take_reconstructed())).collect();
    println!("views made by each, n{slow} being slow: {made:?}");
    assert_eq!(made.values().sum::<usize>(), VIEWS as usize);
    assert!(made[&slow] < 120, "an equal share is 200, an eleventh 55, and it has been asked for 50 at once");
    assert!(made.iter().all(|(&node, &made)| node == slow || made > 200));
}

/// The number of nodes whose role changed.
fn changes_of_role(from: &Assignment, to: &Assignment) -> usize {
    let names =
        |plan: &Assignment| -> BTreeSet<String> { plan.samplers.iter().map(|share| share.node_name.clone()).collect() };
    names(from).symmetric_difference(&names(to)).count()
}

/// Requests V views of each set until K is right; all requested views arrive meanwhile.
async fn follow(session: &Session, views_per_set: u32, k: usize) -> SessionPlan {
    let before = session.plan();
    session.change(views_per_set, None).await.unwrap();
    let start = Instant::now();
    while session.plan().sampler_count() != k {
        let asked: Vec<ViewRequest> = views(MOVING.set_count, views_per_set);
        let frames = session.render_views(asked.clone()).unwrap().all().await.unwrap();
        assert_eq!(frames.len(), asked.len(), "none is lost");
        let whole = |frame: &client::Frame| frame.header.sample_set_id.index == u64::from(frame.request.set_index);
        assert!(frames.iter().all(whole));
        assert!(start.elapsed() < SETTLED, "K is still {}: {}", session.plan().sampler_count(), session.plan().reason);
    }
    let plan = session.plan();
    let changes = changes_of_role(&before.assignment, &plan.assignment);
    println!(
        "V = {views_per_set}: K = {k} after {:.1?}, {changes} changes of role, predicted {:.3} s, K_fd {:.3} s",
        start.elapsed(),
        plan.predicted_pipeline_s,
        plan.predicted_k_fd_s
    );
    assert!(changes <= 2);
    assert!(plan.predicted_pipeline_s <= 1.1 * plan.predicted_k_fd_s);
    plan
}

#[tokio::test(flavor = "multi_thread")]
async fn k_follows_v_from_one_to_five_hundred_and_back() {
    let cluster = cluster_of(6, Pace::from_ms(60, 2)).await;
    let asked = SessionRequest { views_per_set: 1, ..request(PolicyChoice::Pipeline, MOVING) };
    let session = cluster.session(asked).await.unwrap();
    assert_eq!(session.plan().sampler_count(), 3, "{}", session.plan().reason);
    follow(&session, 500, 1).await;
    follow(&session, 1, 3).await;
}
