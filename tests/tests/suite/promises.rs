//! Budgets of sessions on real nodes of the scalar device: promises that are kept, or cannot be.

use std::io::Write;
use std::sync::Arc;
use std::time::Duration;

use client::{ClientError, Session};
use cluster::{BudgetRequest, PolicyChoice, Promise, PromiseState, SessionRequest, Timeline};
use cluster_tests::cluster::{Cluster, camera, request, views};
use coordinator::schedule::{Command, Recorder, replay};
use coordinator::{CoordinatorConfig, CoordinatorMetrics, Observers, PlanStore};
use node::NodeConfig;
use parking_lot::Mutex;
use planner::{Certificate, Kept, KeptCosts, KeptKey, KeptRow, RowCosts, ViewErrors};

const DEADLINE: Duration = Duration::from_secs(60);
/// Every picture keeps this budget, and none but directly drawn ones the other.
const LOOSE: &str = "flip 0.99";
const STRICT: &str = "flip 0.00001";

/// A session with a budget. The pipeline is forced: the scalar device draws directly faster than it reconstructs.
fn budgeted(budget: &str) -> SessionRequest {
    let budget = BudgetRequest { budget: Some(budget.to_owned()), ..BudgetRequest::default() };
    SessionRequest { budget, ..request(PolicyChoice::Pipeline, Timeline::still(0.0)) }
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
    assert!(promise.bound_ratio <= 0.99 && promise.probe_view_count >= 32, "{promise:?}");
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
    let free = SessionRequest { policy: PolicyChoice::Auto, ..budgeted(STRICT) };
    cluster.close(session).await;
    let session = cluster.session(free).await.unwrap();
    let promise = settled(&session).await;
    assert_eq!(promise.state, PromiseState::Kept, "{promise}");
    assert_eq!(delivered(&session).await, 6);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_text_that_is_no_budget_is_refused_by_its_term() {
    let cluster = Cluster::start(1).await;
    for wrong in ["flop 0.1", "flip NaN", "flip -1", "flip 0.1, flip 0.2", &"flip 1,".repeat(30)] {
        let refused = cluster.session(budgeted(wrong)).await.unwrap_err();
        assert!(matches!(&refused, ClientError::Coordinator { reason } if reason.contains("budget")), "{refused}");
    }
    let direct = SessionRequest { method: cluster::DIRECT.to_owned(), ..budgeted(LOOSE) };
    let refused = cluster.session(direct).await.unwrap_err();
    assert!(refused.to_string().contains("leave no representation"), "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_coordinators_budget_is_that_of_sessions_that_state_none() {
    let config = CoordinatorConfig { budget: Some(LOOSE.parse().unwrap()), ..CoordinatorConfig::default() };
    let cluster = Cluster::start_limited(config, 1, |config| config).await;
    let plain = request(PolicyChoice::Pipeline, Timeline::still(0.0));
    let session = cluster.session(plain.clone()).await.unwrap();
    assert_eq!(settled(&session).await.budget, LOOSE);
    // A session that has its views drawn by name has nothing to be promised.
    let direct = SessionRequest { method: cluster::DIRECT.to_owned(), policy: PolicyChoice::Auto, ..plain };
    let session = cluster.session(direct).await.unwrap();
    assert_eq!(delivered(&session).await, 6);
    assert_eq!(session.promise(), None);
}

#[tokio::test(flavor = "multi_thread")]
async fn measurements_outlive_the_coordinator_and_are_used_again() {
    let config = CoordinatorConfig { plans: Some(Arc::new(Memory::default())), ..CoordinatorConfig::default() };
    let mut all = Vec::new();
    for _ in 0..2 {
        let log = Shared::default();
        let cluster = recorded(config.clone(), 1, &log).await;
        let session = cluster.session(budgeted(LOOSE)).await.unwrap();
        let promise = settled(&session).await;
        drop(session);
        all.push((promise.state, promise.representation, probes(&log)));
    }
    let [(first, chosen, measured), (second, again, more)] = &all[..] else { panic!("two coordinators") };
    assert_eq!((first, chosen), (second, again));
    assert!(*measured > 0 && *more == 0, "{measured} probes, then {more}");
}

/// The commands of a log, as the schedule gave them.
#[tokio::test(flavor = "multi_thread")]
async fn a_recorded_log_replays_to_the_same_promise() {
    let log = Shared::default();
    let cluster = recorded(CoordinatorConfig::default(), 2, &log).await;
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

/// Measurements in memory.
#[derive(Debug, Default)]
struct Memory(Mutex<Vec<Kept>>);

impl PlanStore for Memory {
    fn read(&self, key: &KeptKey) -> Kept {
        let found = self.0.lock().iter().rev().find(|kept| kept.key == *key).cloned();
        found.unwrap_or_else(|| Kept::empty(key.clone()))
    }

    fn write(&self, kept: &Kept) -> std::io::Result<()> {
        self.0.lock().push(kept.clone());
        Ok(())
    }
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

/// Measurements as a device that lies has left them: errors are a third of the true ones. Budgets and rows of one and of four
/// cameras are promised to be kept.
async fn divided_by_three() -> (Arc<Memory>, String) {
    let memory = Arc::new(Memory::default());
    let config = CoordinatorConfig { plans: Some(memory.clone()), ..CoordinatorConfig::default() };
    let cluster = Cluster::start_limited(config, 1, |config| config).await;
    let session = cluster.session(budgeted(LOOSE)).await.unwrap();
    let promise = settled(&session).await;
    let mut kept = memory.0.lock().pop().expect("measurements");
    let budget = format!("flip {}", promise.expected_ratio * 0.6);
    let all = kept.rows.iter().flat_map(|kept| &kept.certificates);
    let Some(certificate) = all.last().cloned() else { panic!("no certificate of {promise}") };
    for kept in &mut kept.rows {
        let screening = kept.screening.iter().map(|errors| ViewErrors { flip: errors.flip / 3.0, ..*errors });
        let thirds = KeptRow::new(kept.row.clone(), screening.collect());
        let ratio = promise.expected_ratio / 3.0 / f64::from(kept.row.camera_count).sqrt();
        let expected_ratio = ratio;
        let bound_ratio = ratio * 1.1;
        let budget = budget.parse().unwrap();
        let certificate = Certificate { budget, expected_ratio, bound_ratio, ..certificate.clone() };
        // One camera is cheapest, however busy the machine was.
        let seconds = 1e-3 * f64::from(kept.row.camera_count);
        let costs = RowCosts { sample_image_s: 1e-3, load_set_s: seconds, reconstruct_view_s: seconds };
        let costs = kept.costs.iter().map(|of_device| KeptCosts { costs, ..of_device.clone() }).collect();
        *kept = KeptRow { certificates: vec![certificate], costs, ..thirds };
    }
    kept.searches.clear();
    memory.0.lock().push(kept);
    (memory, budget)
}

/// A cluster that audits as often as it may, with wrong measurements of earlier plans, and a session to which too much is
/// promised.
async fn promised_too_much() -> (Cluster, Session) {
    let (memory, budget) = divided_by_three().await;
    let config = CoordinatorConfig { plans: Some(memory), audit_time_ratio: 0.5, ..CoordinatorConfig::default() };
    let cluster = Cluster::start_limited(config, 2, |config| NodeConfig { direct_share: 1.0, ..config }).await;
    let request = SessionRequest { frames_per_s: Some(20.0), views_per_set: 1, ..budgeted(&budget) };
    let session = cluster.session(request).await.unwrap();
    let promise = settled(&session).await;
    assert_eq!(promise.state, PromiseState::Kept, "{promise}");
    (cluster, session)
}

#[tokio::test(flavor = "multi_thread")]
async fn audits_break_a_promise_of_wrong_measurements_and_another_representation_takes_its_place() {
    let (_cluster, session) = promised_too_much().await;
    let first = session.promise().unwrap();
    let mut live = session.live();
    let mut seen = Vec::new();
    let start = std::time::Instant::now();
    for step in 0.. {
        assert!(start.elapsed() < DEADLINE, "{seen:#?}");
        live.set_pose(session_view(step % 120), 0).unwrap();
        tokio::time::timeout(DEADLINE, live.next()).await.expect("a frame").unwrap();
        let promise = session.promise().unwrap();
        if seen.last().is_none_or(|last: &Promise| last.state != promise.state) {
            seen.push(promise.clone());
        }
        let is_replaced = promise.state == PromiseState::Kept && promise.representation != first.representation;
        if is_replaced {
            break;
        }
    }
    // The state may have passed between two looks.
    let mut broken = seen.iter().filter(|promise| promise.state == PromiseState::Broken);
    assert!(broken.all(|promise| promise.reason.contains("Audits found flip")), "{seen:#?}");
    assert!(session.promise().unwrap().reason.contains("Audits found flip"), "{}", session.promise().unwrap());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_viewer_that_stays_above_the_budget_is_named_and_breaks_no_promise_of_the_mean() {
    let (_cluster, session) = promised_too_much().await;
    let mut live = session.live();
    let start = std::time::Instant::now();
    let named = loop {
        assert!(start.elapsed() < DEADLINE, "{}", session.promise().unwrap());
        live.set_pose(session_view(60), 0).unwrap();
        tokio::time::timeout(DEADLINE, live.next()).await.expect("a frame").unwrap();
        let promise = session.promise().unwrap();
        assert_eq!(promise.state, PromiseState::Kept, "{promise}");
        if promise.reason.contains("Broken here (viewer") {
            break promise;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    };
    assert!(named.audit.unwrap().audited_views <= 2, "it is audited once on each node that serves it: {named}");
}

#[tokio::test(flavor = "multi_thread")]
async fn of_large_views_a_square_is_audited() {
    let config = CoordinatorConfig { audit_time_ratio: 0.5, ..CoordinatorConfig::default() };
    let cluster = Cluster::start_limited(config, 2, |config| NodeConfig { direct_share: 1.0, ..config }).await;
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
            assert!(promise.reason.contains("on parts of"), "{promise}");
            return;
        }
        live.set_pose(camera(0.1 + 0.01 * (step % 80) as f32, typical_view.size_px), 0).unwrap();
        tokio::time::timeout(DEADLINE, live.next()).await.expect("a frame").unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_honest_promise_is_audited_and_stays() {
    let config = CoordinatorConfig { audit_time_ratio: 0.5, ..CoordinatorConfig::default() };
    let cluster = Cluster::start_limited(config, 2, |config| NodeConfig { direct_share: 1.0, ..config }).await;
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
    assert!(audit.covered_views >= 6 && audit.uncovered_views == 0 && audit.busy_s > 0.0, "{audit:?}");
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

/// Measurements that nodes were asked for.
fn probes(log: &Shared) -> usize {
    let steps = replay(&log.0.lock()[..]).unwrap();
    let commands = steps.iter().flat_map(|step| &step.commands);
    commands.filter(|command| matches!(command, Command::ProbeViews(_))).count()
}
