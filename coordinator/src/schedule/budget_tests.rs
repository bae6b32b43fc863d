//! Budgets in the schedule: plans, representations and promises.

use std::time::Duration;

use cluster::{MeasuredCosts, Policy, PolicyChoice, PromiseState};
use glam::UVec2;
use planner::Event as PlannerEvent;

use super::budget_cluster_tests::{Cluster, planned, recorded, viewer};
use super::{Command, Event, Opening, PolicyOverride, ViewProbe, replay};

#[test]
fn a_session_opens_at_once_and_gets_the_cheapest_row_that_keeps_its_budget() {
    let mut cluster = Cluster::of(3);
    cluster.open(viewer(1, "flip 0.06"));
    let first = &cluster.plans[0].assignment;
    assert_eq!((first.workload.sample_cameras.len(), first.method.clone()), (4, None), "what was asked for");
    assert_eq!(cluster.promises[0].1.state, PromiseState::Measuring);
    cluster.wait(20);
    let promise = cluster.promise();
    assert_eq!(promise.state, PromiseState::Kept, "{promise}");
    assert!((promise.expected_ratio - 0.04).abs() < 1e-9 && promise.bound_ratio <= 0.06, "{promise:?}");
    let assignment = &cluster.plan().assignment;
    assert_eq!(assignment.method.as_deref(), Some("carve:4"));
    assert_eq!(assignment.workload.sample_cameras.len(), 4);
    assert!(assignment.workload.planes.normals, "planes of the method");
    assert!(!cluster.probes.is_empty() && cluster.kept.is_some());
}

#[test]
fn a_budget_is_not_kept_before_sessions_have_the_plan_that_keeps_it() {
    let mut cluster = Cluster::of(3);
    cluster.is_unapplied = true;
    cluster.open(viewer(1, "flip 0.06"));
    cluster.wait(20);
    assert_eq!(cluster.plan().assignment.method.as_deref(), Some("carve:4"));
    assert_eq!(cluster.promise().state, PromiseState::Measuring);
    let plan_epoch = cluster.plan().assignment.plan_epoch;
    cluster.tell(Event::Applied { plan_epoch });
    assert_eq!(cluster.promise().state, PromiseState::Kept);
}

#[test]
fn another_policy_of_sessions_is_planned_for_anew() {
    let mut cluster = Cluster::of(2);
    cluster.open(viewer(1, "flip 0.01"));
    cluster.wait(20);
    assert_eq!(cluster.promise().state, PromiseState::Unreachable);
    cluster.open(Opening { policy_override: PolicyOverride::default(), ..viewer(2, "flip 0.01") });
    cluster.wait(20);
    assert_eq!(cluster.promise().state, PromiseState::Kept, "{}", cluster.promise());
    assert_eq!(cluster.plan().assignment.policy, Policy::Direct);
}

#[test]
fn budgets_that_are_not_comparable_with_all_others_share_no_plan() {
    let mut cluster = Cluster::of(20);
    for (session, budget) in [(1, "time 80ms"), (2, "flip 0.05"), (3, "psnr 30")] {
        cluster.open(viewer(session, budget));
    }
    assert_eq!(cluster.scheduler.status().workloads.len(), 2);
    let mut larger = viewer(4, "time 80ms");
    let budgeted = larger.budgeted.as_mut().unwrap();
    budgeted.typical_view = budgeted.typical_view.resized(UVec2::splat(256));
    cluster.open(larger);
    assert_eq!(cluster.scheduler.status().workloads.len(), 3, "of views of another size");
}

#[test]
fn a_replayed_log_gives_the_same_commands() {
    let mut cluster = Cluster::of(3);
    cluster.open(viewer(1, "flip 0.06"));
    cluster.wait(20);
    let steps = replay(&recorded(&cluster.log)[..]).unwrap();
    let replayed: Vec<Command> = steps.into_iter().flat_map(|step| step.commands).collect();
    assert_eq!(replayed, cluster.commands);
}

#[test]
fn a_budget_that_no_row_keeps_is_unreachable_and_what_is_drawn_directly_has_no_error() {
    let mut cluster = Cluster::of(2);
    cluster.open(viewer(1, "flip 0.01"));
    cluster.wait(20);
    assert_eq!(cluster.promise().state, PromiseState::Unreachable, "{}", cluster.promise());
    let mut cluster = Cluster::of(2);
    cluster.open(Opening { policy_override: Default::default(), ..viewer(1, "flip 0.01") });
    cluster.wait(20);
    assert_eq!(cluster.promise().state, PromiseState::Kept, "{}", cluster.promise());
    assert_eq!(cluster.plan().assignment.policy, Policy::Direct);
    let mut cluster = Cluster::of(2);
    let forced = PolicyOverride { policy: PolicyChoice::Direct, ..Default::default() };
    cluster.open(Opening { policy_override: forced, ..viewer(1, "flip 0.01") });
    assert_eq!((cluster.promise().state, cluster.probes.len()), (PromiseState::Kept, 0), "nothing is to be measured");
}

#[test]
fn what_was_measured_is_not_measured_again() {
    let mut cluster = Cluster::of(2);
    cluster.open(viewer(1, "flip 0.06"));
    cluster.wait(20);
    let probes = cluster.probes.len();
    assert!(probes > 0);
    cluster.tell(Event::Closed { session: 1 });
    cluster.open(viewer(2, "flip 0.06"));
    cluster.wait(20);
    assert_eq!((cluster.promise().state, cluster.probes.len()), (PromiseState::Kept, probes));
}

#[test]
fn measurements_of_a_plan_that_was_not_finished_are_kept() {
    let mut cluster = Cluster::of(2);
    cluster.is_slow = true;
    cluster.open(viewer(1, "flip 0.06"));
    cluster.answer_one();
    assert!(cluster.kept.is_none(), "the plan goes on");
    cluster.tell(Event::Closed { session: 1 });
    assert_eq!(cluster.kept.as_ref().map(|kept| kept.rows.len()), Some(1));
}

#[test]
fn sessions_with_comparable_budgets_share_the_strictest_and_others_do_not() {
    let mut cluster = Cluster::of(3);
    cluster.open(viewer(1, "flip 0.1"));
    cluster.wait(20);
    assert_eq!(cluster.plan().assignment.method.as_deref(), Some("carve:2"));
    cluster.open(viewer(2, "flip 0.05"));
    cluster.wait(20);
    assert_eq!(cluster.plan().assignment.method.as_deref(), Some("carve:4"));
    for (session, budget) in [(1, "flip 0.1"), (2, "flip 0.05")] {
        let promise = cluster.promise_to(session);
        assert_eq!((promise.budget.as_str(), promise.state), (budget, PromiseState::Kept));
        assert!((promise.expected_ratio - 0.04).abs() < 1e-9, "of the strictest: {promise:?}");
    }
    cluster.open(viewer(3, "psnr 20"));
    let mut plain = viewer(4, "flip 0.05");
    plain.budgeted = None;
    cluster.open(plain);
    assert_eq!(cluster.scheduler.status().workloads.len(), 3);
    // A looser budget follows after a while.
    cluster.tell(Event::Closed { session: 2 });
    cluster.wait(10);
    let method = |cluster: &Cluster| cluster.scheduler.status().workloads[0].plan.clone().unwrap().method;
    assert_eq!(method(&cluster), "carve:4", "representations change seldom");
    cluster.wait(120);
    assert_eq!(method(&cluster), "carve:2");
}

#[test]
fn a_budget_that_nothing_keeps_leaves_the_promises_of_other_sessions_as_they_are() {
    for order in [[(1, "flip 0.06"), (2, "flip 0.01")], [(2, "flip 0.01"), (1, "flip 0.06")]] {
        let mut cluster = Cluster::of(3);
        for (session, budget) in order {
            cluster.open(viewer(session, budget));
            cluster.wait(20);
        }
        assert_eq!(cluster.promise_to(1).state, PromiseState::Kept, "{}", cluster.promise_to(1));
        assert_eq!(cluster.plan().assignment.method.as_deref(), Some("carve:4"));
        let refused = cluster.promise_to(2);
        assert_eq!((refused.state, refused.budget.as_str()), (PromiseState::Unreachable, "flip 0.01"), "{refused}");
        let shown = cluster.scheduler.status().workloads[0].promise.clone().unwrap();
        assert_eq!(shown.state, PromiseState::Kept, "{shown}");
        // Nothing is measured again and again.
        let probes = cluster.probes.len();
        cluster.wait(300);
        assert_eq!((cluster.probes.len(), cluster.promise_to(1).state), (probes, PromiseState::Kept));
        cluster.tell(Event::Closed { session: 1 });
        cluster.wait(100);
        assert_eq!(cluster.promise_to(2).state, PromiseState::Unreachable);
    }
}

#[test]
fn a_row_that_cannot_be_put_in_force_leaves_the_promises_of_other_sessions_as_they_are() {
    let mut cluster = Cluster::of(3);
    cluster.open(viewer(1, "flip 0.1"));
    cluster.wait(20);
    cluster.refused = Some("carve:4".to_owned());
    cluster.open(viewer(2, "flip 0.05"));
    cluster.wait(20);
    assert_eq!(cluster.promise_to(1).state, PromiseState::Kept, "{}", cluster.promise_to(1));
    let refused = cluster.promise_to(2);
    assert_eq!(refused.state, PromiseState::Unreachable, "{refused}");
    assert!(refused.reason.contains("out of memory"), "{refused}");
    cluster.wait(200);
    assert_eq!(cluster.promise_to(1).state, PromiseState::Kept, "{}", cluster.promise_to(1));
    cluster.refused = None;
    cluster.wait(200);
    assert_eq!(cluster.promise_to(2).state, PromiseState::Kept, "{}", cluster.promise_to(2));
    assert_eq!(cluster.plan().assignment.method.as_deref(), Some("carve:4"));
}

#[test]
fn a_budget_that_nothing_keeps_has_the_nearest_row_again_when_others_have_left() {
    let mut cluster = Cluster::of(3);
    cluster.open(viewer(2, "flip 0.01"));
    cluster.wait(20);
    assert_eq!(cluster.plan().assignment.method.as_deref(), Some("carve:8"), "it comes nearest");
    cluster.open(viewer(1, "flip 0.06"));
    cluster.wait(80);
    assert_eq!(cluster.plan().assignment.method.as_deref(), Some("carve:4"));
    cluster.tell(Event::Closed { session: 1 });
    cluster.wait(80);
    assert_eq!(cluster.plan().assignment.method.as_deref(), Some("carve:8"));
}

#[test]
fn what_direct_drawing_has_promised_is_not_promised_where_it_is_forbidden() {
    let mut cluster = Cluster::of(3);
    cluster.open(viewer(1, "flip 0.06"));
    cluster.open(viewer(3, "flip 0.01"));
    cluster.open(Opening { policy_override: PolicyOverride::default(), ..viewer(2, "flip 0.01") });
    cluster.wait(20);
    for session in [1, 2, 3] {
        let promise = cluster.promise_to(session);
        assert_eq!((promise.state, promise.representation.as_str()), (PromiseState::Kept, "every view drawn directly"));
    }
    cluster.tell(Event::Closed { session: 2 });
    for _ in 0..80 {
        cluster.wait_ticks(1);
        let promise = cluster.promise_to(1);
        let is_direct = promise.representation == "every view drawn directly";
        let draws = cluster.plan().assignment.policy == Policy::Direct;
        assert!(promise.state != PromiseState::Kept || is_direct == draws, "{promise}");
    }
    assert_eq!(cluster.promise_to(1).state, PromiseState::Kept, "{}", cluster.promise_to(1));
    assert_eq!(cluster.promise_to(3).state, PromiseState::Unreachable, "{}", cluster.promise_to(3));
}

#[test]
fn of_budgets_that_cannot_be_kept_together_those_that_came_first_are_kept() {
    let accurate = "flip 0.05";
    let quick = "flip 0.1, time 4.5ms";
    for order in [[accurate, quick], [quick, accurate]] {
        let mut cluster = Cluster::of(3);
        cluster.open(viewer(1, order[0]));
        cluster.wait(20);
        assert_eq!(cluster.promise_to(1).state, PromiseState::Kept, "{}", cluster.promise_to(1));
        cluster.open(viewer(2, order[1]));
        cluster.wait(20);
        assert_eq!(cluster.promise_to(1).state, PromiseState::Kept, "{}", cluster.promise_to(1));
        let second = cluster.promise_to(2);
        assert_eq!(second.state, PromiseState::Unreachable, "{second}");
        assert!(second.reason.contains("Other sessions") && second.reason.contains(order[0]), "{second}");
        cluster.tell(Event::Closed { session: 1 });
        cluster.wait(120);
        assert_eq!(cluster.promise_to(2).state, PromiseState::Kept, "{}", cluster.promise_to(2));
    }
}

#[test]
fn a_lost_probe_is_asked_for_again_and_one_that_is_always_lost_fails_its_row() {
    let mut cluster = Cluster::of(2);
    cluster.is_slow = true;
    cluster.open(viewer(1, "flip 0.06"));
    let first = cluster.probes[0].clone();
    let lost = |probe: &ViewProbe| Event::ProbeLost {
        workload_number: probe.workload_number,
        id: probe.id,
        reason: "gone".to_owned(),
    };
    cluster.tell(lost(&first));
    assert_eq!(cluster.probes.len(), 1, "after a pause");
    cluster.wait(2);
    assert_eq!(cluster.probes[1].requests, first.requests);
    for _ in 0..4 {
        let last = cluster.probes.last().unwrap().clone();
        cluster.tell(lost(&last));
        cluster.wait(2);
    }
    assert_ne!(cluster.probes.last().unwrap().requests, first.requests, "another row");
    // Answers that nobody waits for change nothing.
    let before = cluster.commands.len();
    let late = cluster.answer(&first);
    cluster.tell(planned(first.workload_number, late));
    assert_eq!(cluster.commands.len(), before);
}

#[test]
fn probing_takes_a_fifth_of_one_node_while_anybody_is_served_and_one_probe_runs_at_a_time() {
    let mut cluster = Cluster::of(3);
    (cluster.busy_s, cluster.is_slow) = (0.5, true);
    cluster.open(viewer(1, "flip 0.06"));
    let mut begun = Vec::new();
    let mut answered = 0;
    for _ in 0..200 {
        let plan_epoch = cluster.plan().assignment.plan_epoch;
        for node in ["n0", "n1", "n2"] {
            let node_name = node.to_owned();
            let costs = MeasuredCosts::default();
            cluster.tell(Event::Measured { node_name, plan_epoch, costs, busy_s: 0.25, views: 1, dropped_views: 0 });
        }
        assert!(cluster.probes.len() <= answered + 1);
        if cluster.probes.len() > answered {
            (answered, _) = (cluster.probes.len(), begun.push(cluster.now));
            cluster.answer_one();
        }
        cluster.wait_ticks(1);
    }
    assert!(begun.len() > 5 && begun.windows(2).all(|pair| pair[1] - pair[0] >= Duration::from_secs(2)), "{begun:?}");
}

#[test]
fn a_spent_allowance_ends_the_plan_with_what_is_known() {
    let mut cluster = Cluster::of(1);
    cluster.busy_s = 40.0;
    cluster.open(viewer(1, "flip 0.06"));
    cluster.wait(200);
    assert_ne!(cluster.promise().state, PromiseState::Measuring, "{}", cluster.promise());
    assert!(cluster.probes.len() <= 2, "{} probes", cluster.probes.len());
}

#[test]
fn impossible_answers_are_failures() {
    let mut cluster = Cluster::of(2);
    // FLIP of one camera is 1.12.
    cluster.error_scale = 7.0;
    cluster.open(viewer(1, "flip 0.06"));
    cluster.wait(5);
    let nan = Event::Planned { workload_number: 1, event: Box::new(PlannerEvent::Allowed { allowance_s: f64::NAN }) };
    assert!(replay(&recorded(&[(Duration::ZERO, nan)])[..]).is_err(), "no node sends it");
    assert_eq!(cluster.promise().state, PromiseState::Unreachable, "the plan goes on: {}", cluster.promise());
}
