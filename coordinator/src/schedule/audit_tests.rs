//! Audits in the schedule: promises that views in force do not keep, and what replaces them.

use cluster::{AuditReport, AuditedView, Policy, PolicyChoice, Promise, PromiseState, ViewErrors};
use depth_image::PinholeCamera;
use glam::Vec3;

use super::budget_cluster_tests::{Cluster, recorded, rig, viewer};
use super::{Command, Event, Opening, PolicyOverride, replay};

const BUDGET: &str = "flip 0.06";

/// A cluster that audits, with a promise that is kept by four cameras.
fn kept(viewer: Opening) -> Cluster {
    let mut cluster = Cluster::of(3);
    cluster.tell(Event::Limits { max_workloads: 8, audit_time_ratio: 0.01 });
    cluster.open(viewer);
    cluster.wait(20);
    assert_eq!(cluster.promise().state, PromiseState::Kept, "{}", cluster.promise());
    cluster
}

/// May be drawn directly, at a high price.
fn free(session: u64, budget: &str) -> Opening {
    let mut opening = viewer(session, budget);
    opening.policy_override = PolicyOverride { policy: PolicyChoice::Auto, ..PolicyOverride::default() };
    opening.costs.direct_view_s = 1.0;
    opening
}

fn at(place: usize) -> PinholeCamera {
    let first = *rig()[0].reference();
    PinholeCamera { eye_in_world: first.eye_in_world + Vec3::X * (0.9 * (place % 97) as f32 / 97.0), ..first }
}

fn audited(cluster: &Cluster, place: usize, flip: f64) -> AuditedView {
    let errors = ViewErrors {
        foreground_ratio: 0.5,
        flip,
        flip_whole: flip / 2.0,
        mean_square: flip / 10.0,
        disoccluded_ratio: 0.0,
    };
    AuditedView {
        plan_epoch: cluster.plan().assignment.plan_epoch,
        stream: 3,
        camera: at(place),
        errors,
        is_part: false,
    }
}

/// Tells of audited views, one a second.
fn audit(cluster: &mut Cluster, flips: impl IntoIterator<Item = f64>) {
    for (place, flip) in flips.into_iter().enumerate() {
        let views = vec![audited(cluster, place, flip)];
        let report = AuditReport { views, covered_views: 10, uncovered_views: 1, busy_s: 0.02 };
        cluster.tell(Event::Audited { workload_number: 1, node_name: "n0".to_owned(), report });
        cluster.wait(1);
    }
}

/// The promise now: sessions are told of figures now and then.
fn promise(cluster: &Cluster) -> Promise {
    cluster.scheduler.status().workloads[0].promise.clone().unwrap()
}

fn states(cluster: &Cluster) -> Vec<PromiseState> {
    let mut states: Vec<PromiseState> = cluster.promises.iter().map(|(_, promise)| promise.state).collect();
    states.dedup();
    states
}

fn method(cluster: &Cluster) -> Option<&str> {
    cluster.plan().assignment.method.as_deref()
}

#[test]
fn views_are_audited_where_something_is_promised_for_them() {
    let mut cluster = kept(viewer(1, BUDGET));
    assert_eq!(cluster.plans[0].assignment.audit, None, "nothing is promised yet");
    let order = cluster.plan().assignment.audit.unwrap();
    assert_eq!((order.time_ratio, order.planned_pixel_count, order.with_sample_images), (0.01, 64 * 64, false));
    assert!((order.least_apart_m - 1e-3).abs() < 1e-6, "a thousandth of a cell of 1 m: {order:?}");
    audit(&mut cluster, [0.04; 30]);
    let promise = promise(&cluster);
    let summary = promise.audit.unwrap();
    assert_eq!(
        (promise.state, summary.audited_views > 20, summary.uncovered_ratio() > 0.08),
        (PromiseState::Kept, true, true)
    );
    let error = summary.error.unwrap();
    assert!(error.low <= 0.04 && (error.mean - 0.04).abs() < 1e-9 && error.high >= 0.04, "{error:?}");
    assert!(
        promise.reason.contains("Audits: flip 0.0400 (") && promise.reason.contains("Not covered: 9 %"),
        "{promise}"
    );
    let mut unwatched = Cluster::of(3);
    unwatched.open(viewer(1, BUDGET));
    unwatched.wait(20);
    assert_eq!((unwatched.promise().state, unwatched.plan().assignment.audit), (PromiseState::Kept, None));
    assert_eq!(unwatched.promise().audit, None);
}

#[test]
fn errors_within_the_budget_break_no_promise() {
    let mut cluster = kept(viewer(1, BUDGET));
    audit(&mut cluster, (0..400).map(|place| if place % 2 == 0 { 0.11 } else { 0.005 }));
    assert!(!states(&cluster).contains(&PromiseState::Broken), "{}", cluster.promise());
}

#[test]
fn a_broken_promise_is_said_and_the_next_safer_choice_takes_its_place() {
    let mut cluster = kept(free(1, BUDGET));
    assert_eq!(method(&cluster), Some("carve:4"));
    cluster.is_slow = true;
    audit(&mut cluster, [0.12; 40]);
    let broken: Vec<&Promise> =
        cluster.promises.iter().map(|(_, p)| p).filter(|p| p.state == PromiseState::Broken).collect();
    assert!(broken[0].reason.contains("Audits found flip 0.1200"), "{}", broken[0]);
    assert_eq!(cluster.promise().state, PromiseState::Kept, "{}", cluster.promise());
    assert_eq!(cluster.plan().assignment.policy, Policy::Direct, "no other row is certified");
    assert_eq!(cluster.plan().assignment.audit, None);
    assert!(cluster.promise().reason.contains("Audits found flip"), "{}", cluster.promise());
}

#[test]
fn a_plan_for_the_audited_viewpoints_follows_a_broken_promise() {
    let mut cluster = kept(viewer(1, BUDGET));
    let before = cluster.probes.len();
    cluster.wait(60);
    assert_eq!(cluster.probes.len(), before);
    cluster.error_scale = 2.0;
    audit(&mut cluster, [0.12; 40]);
    cluster.wait(100);
    let probes = &cluster.probes[before..];
    assert!(!probes.is_empty(), "planned again");
    let views: Vec<&PinholeCamera> = probes.iter().flat_map(|p| &p.requests[0].1.typical_views).collect();
    let of_audited: Vec<f32> =
        views.iter().copied().filter(|view| is_audited_place(view)).map(|view| view.eye_in_world.x).collect();
    let share = of_audited.len() as f64 / views.len() as f64;
    let newest_x = of_audited.iter().copied().fold(f32::MIN, f32::max);
    assert!(newest_x > at(36).eye_in_world.x, "the newest viewpoints are among them: {newest_x}");
    assert!((0.4..=0.6).contains(&share), "{share} of {} views", views.len());
    assert_eq!((method(&cluster), cluster.promise().state), (Some("carve:8"), PromiseState::Kept));
}

#[test]
fn a_plan_that_was_under_way_when_a_promise_broke_is_not_put_in_force() {
    let mut cluster = kept(free(1, BUDGET));
    cluster.wait(60);
    // Another demand is planned for, slowly and from nothing.
    (cluster.is_slow, cluster.kept) = (true, None);
    cluster.tell(Event::DemandChanged { session: 1, views_per_set: 1, frames_per_s: Some(60.0) });
    cluster.wait(2);
    let under_way = cluster.probes.last().unwrap().id;
    audit(&mut cluster, [0.12; 20]);
    assert_eq!(cluster.plan().assignment.policy, Policy::Direct, "{}", promise(&cluster));
    while cluster.kept.is_none() {
        let asked = cluster.probes.len();
        cluster.answer_one();
        assert!(cluster.probes.len() > asked || cluster.kept.is_some(), "the plan goes on");
    }
    assert_eq!(cluster.probes.last().unwrap().id.plan, under_way.plan);
    assert_eq!(cluster.plan().assignment.policy, Policy::Direct, "{}", promise(&cluster));
}

fn is_audited_place(camera: &PinholeCamera) -> bool {
    (0..97).any(|place| at(place).eye_in_world == camera.eye_in_world)
}

#[test]
fn a_third_broken_promise_within_ten_minutes_is_the_last() {
    let mut cluster = kept(free(1, BUDGET));
    for _ in 0..6 {
        audit(&mut cluster, [0.2; 40]);
    }
    assert_eq!(cluster.plan().assignment.policy, Policy::Direct);
    let breaks = cluster
        .promises
        .windows(2)
        .filter(|pair| pair[0].1.state != PromiseState::Broken && pair[1].1.state == PromiseState::Broken);
    assert!(breaks.count() <= 3, "{:#?}", cluster.promises.iter().map(|(_, p)| p.to_string()).collect::<Vec<_>>());
    let plans = cluster.plans.len();
    let probes = cluster.probes.len();
    cluster.wait(900);
    assert_eq!((cluster.plans.len(), cluster.probes.len()), (plans, probes), "nothing is planned any more");
    assert_eq!(cluster.promise().state, PromiseState::Kept);
}

#[test]
fn audits_of_the_representation_before_do_not_count() {
    let mut cluster = kept(viewer(1, BUDGET));
    let mut old = audited(&cluster, 0, 0.5);
    old.plan_epoch = cluster.plans[0].assignment.plan_epoch;
    for _ in 0..50 {
        let report = AuditReport { views: vec![old.clone()], ..AuditReport::default() };
        cluster.tell(Event::Audited { workload_number: 1, node_name: "n0".to_owned(), report });
    }
    cluster.wait(10);
    assert_eq!(promise(&cluster).audit.unwrap().audited_views, 0);
    // A stranger's report, and a report on a workload that has ended.
    for (workload_number, node_name) in [(1, "stranger"), (99, "n0")] {
        let report = AuditReport { views: vec![audited(&cluster, 0, 0.5); 64], ..AuditReport::default() };
        cluster.tell(Event::Audited { workload_number, node_name: node_name.to_owned(), report });
    }
    assert!(!states(&cluster).contains(&PromiseState::Broken));
}

#[test]
fn a_viewer_that_stays_above_the_budget_is_named_and_planned_for_once() {
    let mut cluster = kept(viewer(1, BUDGET));
    cluster.wait(60);
    let before = cluster.probes.len();
    let stays = |cluster: &mut Cluster, camera: PinholeCamera| {
        let node_name = "n0".to_owned();
        let viewpoints = vec![camera];
        cluster.tell(Event::ViewersMoved { workload_number: 1, node_name, viewpoints });
    };
    stays(&mut cluster, at(5));
    let views = vec![audited(&cluster, 5, 0.5)];
    let report = AuditReport { views, ..AuditReport::default() };
    cluster.tell(Event::Audited { workload_number: 1, node_name: "n0".to_owned(), report });
    cluster.wait(15);
    let promise = cluster.promise();
    assert!(promise.reason.contains("Broken here (viewer 3 of n0: flip 0.5000)"), "{promise}");
    assert_eq!(promise.audit.unwrap().viewers_above, 1);
    assert_ne!(promise.state, PromiseState::Broken, "one view is no mean");
    let after = cluster.probes.len();
    assert!(after > before, "planned again");
    cluster.wait(300);
    assert_eq!(cluster.probes.len(), after, "once");
    stays(&mut cluster, at(50));
    cluster.wait(15);
    assert!(!cluster.promise().reason.contains("Broken here"), "{}", cluster.promise());
}

#[test]
fn a_replayed_log_with_audits_gives_the_same_commands() {
    let mut cluster = kept(free(1, BUDGET));
    audit(&mut cluster, [0.12; 60]);
    let steps = replay(&recorded(&cluster.log)[..]).unwrap();
    let replayed: Vec<Command> = steps.into_iter().flat_map(|step| step.commands).collect();
    assert_eq!(replayed, cluster.commands);
    let views = vec![audited(&cluster, 0, f64::NAN)];
    let report = AuditReport { views, ..AuditReport::default() };
    let nan = Event::Audited { workload_number: 1, node_name: "n0".to_owned(), report };
    assert!(replay(&recorded(&[(cluster.now, nan)])[..]).is_err(), "no node sends it");
}

#[test]
fn squares_of_large_views_break_promises_and_name_no_viewer() {
    let mut cluster = kept(viewer(1, BUDGET));
    assert!(cluster.plan().assignment.audit.unwrap().in_parts);
    let part = |place: usize, flip: f64| AuditedView { is_part: true, ..audited(&cluster, place, flip) };
    // Half of the squares show far more than the budget, and half nothing.
    let views: Vec<AuditedView> = (0..60).map(|place| part(place, if place % 2 == 0 { 0.1 } else { 0.0 })).collect();
    for view in views.into_iter().take(20) {
        let report = AuditReport { views: vec![view], covered_views: 10, uncovered_views: 0, busy_s: 0.02 };
        cluster.tell(Event::Audited { workload_number: 1, node_name: "n0".to_owned(), report });
        cluster.wait(1);
    }
    let shown = promise(&cluster);
    assert_eq!(shown.state, PromiseState::Kept, "0.05 in the mean: {shown}");
    assert!(shown.reason.contains("on parts of 20 of 200 views") && !shown.reason.contains("Broken here"), "{shown}");
    assert_eq!(shown.audit.unwrap().viewers_above, 0);
    for place in 0..120 {
        let views = vec![AuditedView { is_part: true, ..audited(&cluster, place, 0.15) }];
        let report = AuditReport { views, covered_views: 10, uncovered_views: 0, busy_s: 0.02 };
        cluster.tell(Event::Audited { workload_number: 1, node_name: "n0".to_owned(), report });
    }
    cluster.wait(5);
    assert!(promise(&cluster).reason.contains("Audits found"), "{}", promise(&cluster));
}

#[test]
fn squares_say_nothing_of_a_percentile_of_views() {
    let mut cluster = kept(viewer(1, "flip p95 0.06"));
    assert!(!cluster.plan().assignment.audit.unwrap().in_parts);
    for place in 0..50 {
        let views = vec![AuditedView { is_part: true, ..audited(&cluster, place, 0.9) }];
        let report = AuditReport { views, covered_views: 1, uncovered_views: 0, busy_s: 0.02 };
        cluster.tell(Event::Audited { workload_number: 1, node_name: "n0".to_owned(), report });
    }
    cluster.wait(1);
    assert_eq!(promise(&cluster).audit.unwrap().audited_views, 0, "{}", promise(&cluster));
}
