//! Budgets of sessions on real nodes of the scalar device: promises that are kept, or cannot be.

use std::io::Write;
use std::sync::Arc;
use std::time::Duration;

use client::{ClientError, Session};
use cluster::{BudgetRequest, PolicyChoice, Promise, PromiseState, SessionRequest, Timeline};
use cluster_tests::cluster::{Cluster, camera, request, rows, rows_with_direct, views};
use cluster_tests::scalar_engine::Pace;
use coordinator::schedule::{Command, Recorder, replay};
use coordinator::{CoordinatorConfig, CoordinatorMetrics, Observers};
use node::NodeConfig;
use parking_lot::Mutex;

const DEADLINE: Duration = Duration::from_secs(60);
/// Every picture keeps this budget, and none but directly drawn ones the other.
const LOOSE: &str = "flip 0.99";
const STRICT: &str = "flip 0.00001";

/// A session with a budget.
fn budgeted(budget: &str) -> SessionRequest {
    let budget = BudgetRequest { budget: Some(budget.to_owned()), ..BudgetRequest::default() };
    SessionRequest { budget, ..request(PolicyChoice::Auto, Timeline::still(0.0)) }
}

/// Views from samples are faster.
const SLOW_DRAWING: Pace = Pace { image: Duration::ZERO, view: Duration::ZERO, direct: Duration::from_millis(60) };

/// The configuration of a coordinator that has half of the time for audits.
fn auditing() -> CoordinatorConfig {
    CoordinatorConfig { audit_time_ratio: 0.5, rows, ..CoordinatorConfig::default() }
}

async fn settled(session: &Session) -> Promise {
    let settled = async {
        let mut promise = session.promise();
        while promise.as_ref().is_none_or(|promise| promise.state == PromiseState::Measuring) {
            promise = Some(session.another_promise(promise.as_ref()).await);
        }
        promise.unwrap()
    };
    tokio::time::timeout(DEADLINE, settled).await.expect("the promise is settled")
}

/// Frames that arrive for the views of one set.
async fn delivered(session: &Session) -> usize {
    let mut frames = session.render_views(views(1, 6)).unwrap();
    let mut count = 0;
    while let Some(frame) = frames.next().await {
        frame.unwrap();
        count += 1;
    }
    count
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_opens_at_once_and_switches_to_the_cheapest_representation_that_keeps_its_budget() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(budgeted(LOOSE)).await.unwrap();
    let first = session.plan().assignment;
    assert_eq!(first.workload.sample_cameras.len(), 3, "the rig, as without a budget");
    assert_eq!(delivered(&session).await, 6);
    let promise = settled(&session).await;
    assert_eq!(promise.state, PromiseState::Kept, "{promise}");
    assert!(promise.expected_ratio > 0.0 && promise.expected_ratio <= promise.bound_ratio, "{promise:?}");
    assert!(promise.bound_ratio <= 0.99 && promise.probe_view_count >= 16, "{promise:?}");
    let plan = session.another_plan(first.plan_epoch).await.assignment;
    assert_eq!(plan.method.as_deref(), Some("splat"));
    let cameras = plan.workload.sample_cameras.len();
    assert!(promise.representation.contains(&format!("S = {cameras},")), "{promise}: {cameras}");
    assert_eq!(delivered(&session).await, 6);
    let status = cluster.client.status().await.unwrap();
    assert_eq!(status.workloads[0].promise.as_ref().map(|shown| shown.state), Some(PromiseState::Kept));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_promise_that_nothing_keeps_is_said_to_be_unreachable_and_views_are_made() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(budgeted(STRICT)).await.unwrap();
    let promise = settled(&session).await;
    assert_eq!(promise.state, PromiseState::Unreachable, "{promise}");
    assert_eq!(delivered(&session).await, 6);
    // Where views may be drawn directly, they have no error.
    let config = CoordinatorConfig { rows: rows_with_direct, ..CoordinatorConfig::default() };
    let cluster = Cluster::start_limited(config, 2, |config| config).await;
    let session = cluster.session(budgeted(STRICT)).await.unwrap();
    let promise = settled(&session).await;
    assert_eq!(promise.state, PromiseState::Kept, "{promise}");
    assert_eq!(delivered(&session).await, 6);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_text_that_is_no_budget_is_refused_by_its_term() {
    let cluster = Cluster::start(1).await;
    for wrong in ["flop 0.1", "flip NaN", "flip 0", "flip 0.1, psnr 30", &"flip 1,".repeat(30)] {
        let refused = cluster.session(budgeted(wrong)).await.unwrap_err();
        assert!(matches!(&refused, ClientError::Coordinator { reason } if reason.contains("budget")), "{refused}");
    }
    let named = BudgetRequest { budget: Some(LOOSE.to_owned()), names_method: true };
    for (request, what) in [
        (SessionRequest { method: cluster::DIRECT.to_owned(), ..budgeted(LOOSE) }, "method is named"),
        (SessionRequest { budget: named, ..budgeted(LOOSE) }, "method is named"),
        (SessionRequest { policy: PolicyChoice::Pipeline, ..budgeted(LOOSE) }, "policy is named"),
        (SessionRequest { sample_size_px: Some(glam::UVec2::splat(32)), ..budgeted(LOOSE) }, "size of sample images"),
    ] {
        let refused = cluster.session(request).await.unwrap_err();
        assert!(refused.to_string().contains(what), "{refused}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_coordinators_budget_is_that_of_sessions_that_state_none() {
    let config = CoordinatorConfig { budget: Some(LOOSE.parse().unwrap()), rows, ..CoordinatorConfig::default() };
    let cluster = Cluster::start_limited(config, 1, |config| config).await;
    let plain = request(PolicyChoice::Auto, Timeline::still(0.0));
    let session = cluster.session(plain.clone()).await.unwrap();
    assert_eq!(settled(&session).await.budget, LOOSE);
    // A session that has its views drawn by name has nothing to be promised.
    let direct = SessionRequest { method: cluster::DIRECT.to_owned(), ..plain };
    let session = cluster.session(direct).await.unwrap();
    assert_eq!(delivered(&session).await, 6);
    assert_eq!(session.promise(), None);
}

/// The commands of a log, as the schedule gave them.
#[tokio::test(flavor = "multi_thread")]
async fn a_recorded_log_replays_to_the_same_promise() {
    let log = Shared::default();
    let cluster = recorded(CoordinatorConfig { rows, ..CoordinatorConfig::default() }, 2, &log).await;
    let session = cluster.session(budgeted(LOOSE)).await.unwrap();
    let promise = settled(&session).await;
    let commands = replay(&log.0.lock()[..]).unwrap().into_iter().flat_map(|step| step.commands);
    let promises = commands.filter_map(|command| match command {
        Command::Promise { promise, .. } => Some(*promise),
        _ => None,
    });
    assert!(promises.into_iter().any(|replayed| replayed == promise), "{promise}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_is_lost_while_it_measures_is_replaced_by_another() {
    let mut cluster = Cluster::start(3).await;
    let session = cluster.session(budgeted(LOOSE)).await.unwrap();
    cluster.nodes[0].kill();
    let promise = settled(&session).await;
    assert_eq!(promise.state, PromiseState::Kept, "{promise}");
    assert_eq!(delivered(&session).await, 6);
}

/// A live view goes on while the representation changes.
#[tokio::test(flavor = "multi_thread")]
async fn a_live_view_goes_on_while_the_representation_changes() {
    let cluster = Cluster::start(2).await;
    let request = SessionRequest { frames_per_s: Some(20.0), views_per_set: 1, ..budgeted(LOOSE) };
    let session = cluster.session(request).await.unwrap();
    let first = session.plan().assignment.plan_epoch;
    let mut live = session.live();
    let mut epochs = std::collections::BTreeSet::new();
    let start = std::time::Instant::now();
    while epochs.iter().all(|&epoch| epoch == first) {
        assert!(start.elapsed() < DEADLINE, "the representation does not change");
        live.set_pose(session_view(epochs.len()), 0).unwrap();
        let frame = tokio::time::timeout(DEADLINE, live.next()).await.expect("a frame").unwrap();
        epochs.insert(frame.frame.header.sample_set_id.plan_epoch);
    }
    assert_eq!(settled(&session).await.state, PromiseState::Kept);
}

fn session_view(step: usize) -> depth_image::PinholeCamera {
    camera(0.1 + 0.01 * step as f32, glam::UVec2::new(48, 36))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_square_of_large_views_is_audited() {
    let mut cluster = Cluster::start_limited(auditing(), 2, |config| NodeConfig { direct_share: 1.0, ..config }).await;
    cluster.keep_pace(SLOW_DRAWING);
    let typical_view = camera(0.5, glam::UVec2::new(360, 270));
    let request = SessionRequest { typical_view, frames_per_s: Some(10.0), views_per_set: 1, ..budgeted(LOOSE) };
    let session = cluster.session(request).await.unwrap();
    settled(&session).await;
    let mut live = session.live();
    let start = std::time::Instant::now();
    for step in 0.. {
        let status = cluster.client.status().await.unwrap();
        let promise = status.workloads[0].promise.clone().unwrap();
        assert!(start.elapsed() < DEADLINE, "{promise}");
        assert_eq!(promise.state, PromiseState::Kept, "{promise}");
        if promise.audit.is_some_and(|audit| audit.audited_views >= 3) {
            return;
        }
        live.set_pose(camera(0.1 + 0.01 * (step % 80) as f32, typical_view.size_px), 0).unwrap();
        tokio::time::timeout(DEADLINE, live.next()).await.expect("a frame").unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_honest_promise_is_audited_and_stays() {
    let mut cluster = Cluster::start_limited(auditing(), 2, |config| NodeConfig { direct_share: 1.0, ..config }).await;
    cluster.keep_pace(SLOW_DRAWING);
    let session = cluster.session(budgeted(LOOSE)).await.unwrap();
    settled(&session).await;
    let start = std::time::Instant::now();
    let audit = loop {
        assert!(start.elapsed() < DEADLINE, "{}", session.promise().unwrap());
        delivered(&session).await;
        let status = cluster.client.status().await.unwrap();
        let promise = status.workloads[0].promise.clone().unwrap();
        assert_eq!(promise.state, PromiseState::Kept, "{promise}");
        let audit = promise.audit.unwrap();
        if audit.audited_views >= 3 {
            break audit;
        }
    };
    assert!(audit.covered_views >= 6 && audit.uncovered_views == 0, "{audit:?}");
}

/// A log that a test can read.
#[derive(Clone, Default)]
struct Shared(Arc<Mutex<Vec<u8>>>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

async fn recorded(config: CoordinatorConfig, nodes: usize, log: &Shared) -> Cluster {
    let log = Recorder::new(Box::new(log.clone()) as Box<dyn Write + Send>).unwrap();
    let observers = Observers { metrics: CoordinatorMetrics::default(), log: Some(log) };
    Cluster::start_observed(config, observers, nodes, |config| config).await
}
