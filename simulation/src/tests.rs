//! Closed forms.

use cluster::{Costs, Policy, PolicyChoice};
use coordinator::schedule::{Load, NodeCosts, k_fd, pipeline_s};

use crate::{Calls, Cluster, Demand, Habits, Limit, Machine, Run, Transfer, plan, run, spread_speeds};

const COSTS: Costs = Costs {
    sample_image_s: 0.1,
    direct_view_s: 0.1,
    reconstruct_view_s: 0.009,
    load_set_s: 0.005,
    encode_view_s: 0.001,
    in_order: false,
    tiles: None,
};

const FREE: Machine =
    Machine { costs: COSTS, calls: Calls { reconstruct_s: 0.0, direct_s: 0.0 }, bytes_per_s: f64::INFINITY };

fn demand(policy: PolicyChoice, views: usize, sets: u32) -> Demand {
    Demand { views, sets, policy, tiles: None, nodes_report: false }
}

fn ran(cluster: &Cluster, demand: &Demand, habits: Habits) -> Run {
    run(cluster, &plan(cluster, demand).unwrap(), demand.views, demand.sets, habits)
}

fn equal(nodes: usize, machine: Machine) -> Cluster {
    Cluster { machines: vec![machine; nodes], images: 4, image_bytes: 1e6, frame_bytes: 1e5 }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9 * b.abs().max(1.0)
}

#[test]
fn a_set_takes_the_sum_of_its_steps_on_two_nodes() {
    let run = ran(&equal(2, FREE), &demand(PolicyChoice::Pipeline, 100, 1), Habits::default());
    assert!(close(run.complete_s[0], 0.4 + 0.005 + 100.0 * 0.01), "{run:?}");
    assert!(close(run.busy[0].sample_s, 0.4) && close(run.busy[1].views_s, 1.0));
}

#[test]
fn every_batch_costs_a_call() {
    let machine = Machine { calls: Calls { reconstruct_s: 0.02, direct_s: 0.03 }, ..FREE };
    let run = ran(&equal(2, machine), &demand(PolicyChoice::Pipeline, 100, 1), Habits::default());
    // The first 50 wait together for the set; after that a message at a time, of 25 views or of half as many.
    let calls = (run.complete_s[0] - (0.4 + 0.005 + 100.0 * 0.01)) / 0.02;
    assert!((2.9..=1.1 + 50.0 / 12.0).contains(&calls) && (calls - calls.round()).abs() < 1e-6, "{calls}");
    let run = ran(&equal(2, machine), &demand(PolicyChoice::Direct, 16, 1), Habits::default());
    assert!(close(run.complete_s[0], 0.03 + 8.0 * 0.101));
}

#[test]
fn a_link_delays_by_the_bytes_it_carries() {
    // 4 MB of images at 10 MB/s and a first batch of 50. Frames of 0.1 MB then take as long to send as to make.
    let slow = Machine { bytes_per_s: 1e7, ..FREE };
    let run = ran(&equal(2, slow), &demand(PolicyChoice::Pipeline, 100, 1), Habits::default());
    let least_s = 0.4 + 0.4 + 0.005 + 0.5 + 1.0;
    assert!((least_s..least_s + 0.1).contains(&run.complete_s[0]), "{:?}", run.complete_s);
}

#[test]
fn the_steady_state_follows_the_formulas() {
    for (nodes, views) in [(2, 100), (5, 1000), (11, 1000), (11, 290)] {
        let demand = demand(PolicyChoice::Pipeline, views, 16);
        let run = ran(&equal(nodes, FREE), &demand, Habits::default());
        let k = k_fd(4, 0.1, views, 0.01, nodes).clamp(1, 4);
        // A compositor that is late leaves the end of a set to others.
        let most = views as f64 / (nodes - k) as f64 * 0.01 + 0.005;
        let formula_s = (4.0 * 0.1 / k as f64).max(most);
        let ratio = run.steady_period_s() / formula_s;
        assert!((0.97..1.02).contains(&ratio), "{nodes} {views} {ratio}");
    }
    let direct = ran(&equal(4, FREE), &demand(PolicyChoice::Direct, 100, 12), Habits::default());
    let ratio = direct.steady_period_s() / (25.0 * 0.101);
    assert!((0.98..1.02).contains(&ratio), "{ratio}");
}

/// With one set fetched ahead, a sampler is idle while its images are sent and loaded; with two it is not.
#[test]
fn a_sampler_is_idle_where_sets_are_requested_late() {
    let machine = Machine { bytes_per_s: 1e8, ..FREE };
    let demand = demand(PolicyChoice::Pipeline, 2, 24);
    let one = ran(&equal(2, machine), &demand, Habits { sets_ahead: 1, ..Habits::default() });
    assert!(close(one.steady_period_s(), 0.4 + 0.04 + 0.005), "{}", one.steady_period_s());
    let two = ran(&equal(2, machine), &demand, Habits::default());
    assert!(close(two.steady_period_s(), 0.4), "{}", two.steady_period_s());
    assert_eq!(two.limit(), Limit::Sampling);
}

#[test]
fn a_sampler_that_sends_to_all_is_bound_by_its_link_and_a_tree_is_not() {
    // 40 compositors × 4 MB at 100 MB/s: 1.6 s a set, against 0.4 s of sampling and 0.26 s of views.
    let machine = Machine { bytes_per_s: 1e8, ..FREE };
    let demand = demand(PolicyChoice::Pipeline, 1000, 12);
    let cluster = equal(41, machine);
    let planned = plan(&cluster, &demand).unwrap();
    let k = planned.sampler_count();
    let sent_mb = (4 / k * (41 - k)) as f64;
    let unicast = run(&cluster, &planned, 1000, 12, Habits::default());
    // A late compositor leaves a set to others, and a few need not fetch it.
    let link_s = sent_mb / 100.0;
    assert!((0.9 * link_s..1.1 * link_s).contains(&unicast.steady_period_s()), "{}", unicast.steady_period_s());
    assert_eq!(unicast.limit(), Limit::ImagesOut);
    let ahead = Habits { transfer: Transfer::Relay(2), sets_ahead: 3, ..Habits::default() };
    let tree = run(&cluster, &planned, 1000, 12, ahead);
    assert!(tree.steady_period_s() < 0.5 * unicast.steady_period_s(), "{}", tree.steady_period_s());
    assert!(tree.complete_s.iter().all(|at_s| at_s.is_finite()));
}

#[test]
fn a_relay_sends_every_image_to_every_node_once() {
    for (policy, transfer) in [
        (PolicyChoice::Pipeline, Transfer::Relay(1)),
        (PolicyChoice::Pipeline, Transfer::Relay(3)),
        (PolicyChoice::TimeShare, Transfer::Relay(1)),
        (PolicyChoice::TimeShare, Transfer::Relay(2)),
        (PolicyChoice::TimeShare, Transfer::Unicast),
    ] {
        let machine = Machine { bytes_per_s: 1e8, ..FREE };
        let cluster = equal(7, machine);
        let demand = demand(policy, 70, 5);
        let planned = plan(&cluster, &demand).unwrap();
        let habits = Habits { transfer, ..Habits::default() };
        let run = run(&cluster, &planned, 70, 5, habits);
        assert!(run.complete_s.iter().all(|s| s.is_finite()), "{policy:?} {transfer:?}");
        let own = |node: usize| {
            let name = format!("node-{node:04}");
            planned.assignment.samplers.iter().find(|s| s.node_name == name).map_or(0, |s| s.image_indices.len())
        };
        for share in &planned.assignment.compositors {
            let node: usize = share.node_name["node-".len()..].parse().unwrap();
            let received_mb = run.busy[node].in_s * 100.0;
            assert!(close(received_mb, (5 * (4 - own(node))) as f64), "{policy:?} {transfer:?} {node}: {received_mb}");
        }
    }
}

#[test]
fn time_share_with_few_views_is_bound_by_sampling() {
    let one = ran(&equal(1, FREE), &demand(PolicyChoice::Auto, 100, 12), Habits::default());
    assert!(close(one.steady_period_s(), 0.4 + 0.005 + 1.0), "{}", one.steady_period_s());
    // A set that is sampled ahead may fall before or behind the end of the time that counts.
    let shared = ran(&equal(4, FREE), &demand(PolicyChoice::TimeShare, 400, 64), Habits::default());
    assert!((0.99..1.01).contains(&(shared.steady_period_s() / 1.105)), "{}", shared.steady_period_s());
    let few = ran(&equal(11, FREE), &demand(PolicyChoice::Pipeline, 3, 6), Habits::default());
    assert_eq!(few.busy.iter().filter(|busy| busy.load_s > 0.0).count(), 3, "who has no view loads nothing");
}

#[test]
fn nodes_take_turns_with_sets_of_sequential_images() {
    let costs = Costs { in_order: true, ..COSTS };
    let cluster = equal(5, Machine { costs, ..FREE });
    let run = ran(&cluster, &demand(PolicyChoice::Pipeline, 10, 40), Habits::default());
    let samplers = run.busy.iter().filter(|busy| busy.sample_s > 0.0).count();
    assert!(samplers > 1);
    let ratio = run.steady_period_s() / (0.4 / samplers as f64);
    assert!((0.9..1.2).contains(&ratio), "{samplers} {ratio}");
}

#[test]
fn unequal_nodes_are_planned_by_their_own_costs() {
    let speeds = spread_speeds(11, 4.0, 7);
    assert!(speeds.iter().all(|speed| (0.5..=2.0).contains(speed)));
    assert_eq!(speeds, spread_speeds(11, 4.0, 7));
    let machines = speeds.iter().map(|&speed| FREE.faster(speed)).collect();
    let cluster = Cluster { machines, images: 4, image_bytes: 1e6, frame_bytes: 1e5 };
    let known = Demand { nodes_report: true, ..demand(PolicyChoice::Pipeline, 1000, 16) };
    let ran = ran(&cluster, &known, Habits::default());
    assert_eq!(ran.limit(), Limit::Views, "fast nodes make more views than slow ones");
    let nodes: Vec<_> =
        cluster.machines.iter().map(|machine| NodeCosts { costs: machine.costs, transfer_image_s: None }).collect();
    let samplers = plan(&cluster, &known).unwrap().assignment.samplers;
    let samples: Vec<bool> =
        (0..11).map(|node| samplers.iter().any(|share| share.node_name == format!("node-{node:04}"))).collect();
    let load = Load { images: 4, sets: 16, views: 1000, ..Load::default() };
    let ratio = ran.steady_period_s() / pipeline_s(&load, &nodes, &samples);
    assert!((0.98..1.02).contains(&ratio), "{ratio}");
}

#[test]
fn the_limit_names_sampling_and_loading_where_they_delay_views() {
    // Nodes that sample an image make as many views as the others.
    let few = ran(&equal(50, FREE), &demand(PolicyChoice::TimeShare, 500, 16), Habits::default());
    assert_eq!(few.limit(), Limit::Sampling);
    let loads = Machine { costs: Costs { load_set_s: 0.2, sample_image_s: 0.01, ..COSTS }, ..FREE };
    let loading = ran(&equal(50, loads), &demand(PolicyChoice::TimeShare, 500, 16), Habits::default());
    assert_eq!(loading.limit(), Limit::Loading);
}

#[test]
fn a_run_of_a_thousand_nodes_is_quick_and_deterministic() {
    let machine = Machine { bytes_per_s: 1.25e9, ..FREE };
    let demand = demand(PolicyChoice::Auto, 100_000, 12);
    let cluster = equal(1000, machine);
    let planned = plan(&cluster, &demand).unwrap();
    let first = run(&cluster, &planned, 100_000, 12, Habits::default());
    assert_eq!(first, run(&cluster, &planned, 100_000, 12, Habits::default()));
    assert!(first.complete_s.iter().all(|at_s| at_s.is_finite()));
    assert!(planned.assignment.policy != Policy::Direct);
}

/// Two nodes sample for all and make views, too: their own views wait, and sets end long after those that begin later.
#[test]
fn sets_that_end_late_have_a_period() {
    let costs = Costs { sample_image_s: 0.143, reconstruct_view_s: 0.026, load_set_s: 0.002, ..COSTS };
    let cluster = Cluster { images: 2, ..equal(11, Machine { costs, ..FREE }) };
    let run =
        ran(&cluster, &Demand { nodes_report: true, ..demand(PolicyChoice::TimeShare, 24, 17) }, Habits::default());
    assert!(run.complete_s[1] > run.complete_s[9], "{:?}", run.complete_s);
    let work_s = (2.0 * 0.143 + 24.0 * 0.027) / 11.0;
    assert!((work_s..3.0 * work_s).contains(&run.steady_period_s()), "{} {work_s}", run.steady_period_s());
}
