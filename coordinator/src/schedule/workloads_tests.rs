//! Several workloads side by side.

use std::collections::BTreeSet;
use std::time::Duration;

use cluster::{Assignment, MeasuredCosts, PolicyChoice, Quality, SamplePlanes, SamplerReport};

use super::command::Command;
use super::demand::{ChoiceError, PolicyOverride};
use super::event::{Event, Opening, ProbeKind};
use super::test_support::{Cluster, join, opening, workload};

const AUTO: PolicyChoice = PolicyChoice::Auto;
const PIPELINE: PolicyChoice = PolicyChoice::Pipeline;

impl Cluster {
    fn open(&mut self, opening: Opening) -> Vec<Command> {
        self.step(Event::Opened(Box::new(opening)))
    }

    fn plan_of(&self, number: u64) -> Assignment {
        let workloads = self.workloads();
        let workload = workloads.iter().find(|workload| workload.number == number).expect("a workload");
        workload.plan.clone().expect("a plan").assignment
    }

    fn nodes(&self, number: u64) -> BTreeSet<String> {
        let workloads = self.workloads();
        let workload = workloads.iter().find(|workload| workload.number == number).expect("a workload");
        workload.conditions.iter().map(|node| node.node_name.clone()).collect()
    }

    /// All plans are taken, and half seconds pass, in which nodes work for these workloads.
    fn pass(&mut self, ticks: usize, busy: &[u64]) -> Vec<Command> {
        let mut commands = Vec::new();
        for _ in 0..ticks {
            for workload in self.workloads() {
                let Some(plan) = workload.plan.map(|plan| plan.assignment) else { continue };
                let node_name = plan.compositors[0].node_name.clone();
                commands.extend(self.step(Event::Ready { plan_epoch: plan.plan_epoch, node_name: node_name.clone() }));
                if busy.contains(&workload.number) {
                    commands.extend(self.step(worked(node_name, plan.plan_epoch)));
                }
            }
            self.now += Duration::from_millis(500);
            commands.extend(self.step(Event::Tick));
        }
        commands
    }
}

fn worked(node_name: String, plan_epoch: u64) -> Event {
    let costs = MeasuredCosts::default();
    Event::Measured { node_name, plan_epoch, costs, busy_s: 0.1, views: 1, dropped_views: 0 }
}

/// A session of the workload with this many images.
fn of(images: usize, session: u64) -> Opening {
    Opening { workload: workload(images), ..opening(session, AUTO, 40) }
}

fn rated(opening: Opening, frames_per_s: f64) -> Opening {
    Opening { frames_per_s: Some(frames_per_s), views_per_set: 1, ..opening }
}

fn forced(policy: PolicyChoice, k: Option<usize>) -> PolicyOverride {
    PolicyOverride { policy, forced_samplers: k, forced_tiles: None }
}

/// Workload, epoch and sessions of each plan.
fn applied(commands: &[Command]) -> Vec<(u64, u64, Vec<u64>)> {
    let plan = |command: &Command| match command {
        Command::Apply { sessions, plan, .. } => {
            Some((plan.assignment.workload_number, plan.assignment.plan_epoch, sessions.clone()))
        }
        _ => None,
    };
    commands.iter().filter_map(plan).collect()
}

fn refusal(commands: &[Command]) -> &ChoiceError {
    match commands {
        [Command::Refuse { error, .. }] => error,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_session_of_another_workload_opens_beside_the_others() {
    let mut cluster = Cluster::of(4);
    cluster.open(of(4, 1));
    let commands = cluster.open(of(3, 2));
    assert_eq!(applied(&commands), [(1, 2, vec![1]), (2, 3, vec![2])], "each plan has an epoch of its own");
    assert!(cluster.scheduler.has_session(1) && cluster.scheduler.has_session(2));
    assert_eq!((cluster.nodes(1).len(), cluster.nodes(2).len()), (2, 2));
    assert!(cluster.nodes(1).is_disjoint(&cluster.nodes(2)));
    let Command::Apply { nodes, .. } = &commands[0] else { panic!("{commands:?}") };
    assert_eq!(nodes.len(), 4, "those that it had learn that they have no role any more");
    let commands = cluster.open(of(3, 3));
    assert_eq!(applied(&commands).iter().map(|plan| plan.0).collect::<Vec<_>>(), [2], "the other notices nothing");
    for session in [2, 3] {
        cluster.step(Event::Closed { session });
    }
    assert_eq!(cluster.nodes(1).len(), 4, "it has all of them again");
    let commands = cluster.pass(40, &[1]);
    assert!(applied(&commands).iter().all(|plan| plan.0 == 1) && !commands.is_empty(), "{commands:?}");
    let next = cluster.scheduler.status().plan_epoch + 1;
    assert_eq!(applied(&cluster.open(of(2, 4))).last().map(|plan| plan.0), Some(next), "above all epochs, and numbers");
}

#[test]
fn workloads_that_have_ended_are_told_apart_from_those_of_a_coordinator_before() {
    let mut cluster = Cluster::of(2);
    cluster.open(of(4, 1));
    cluster.open(of(3, 2));
    assert_eq!(cluster.scheduler.open_workloads(), [1, 2]);
    cluster.step(Event::Closed { session: 1 });
    assert_eq!(cluster.scheduler.open_workloads(), [2]);
    cluster.step(join("n2", 2, 90));
    assert!(cluster.scheduler.open_workloads().is_empty(), "the node has seen plans of another coordinator");
    cluster.now += Duration::from_secs(30);
    cluster.step(Event::Tick);
    assert_eq!(cluster.scheduler.open_workloads(), [2]);
}

#[test]
fn a_node_is_idle_while_no_node_at_its_address_works() {
    let mut cluster = Cluster::of(2);
    let neighbour = Event::Joined {
        incarnation: 2,
        join: cluster::JoinCluster {
            node: cluster::NodeStatus {
                node_name: "n2".to_owned(),
                address: "http://n1:99".to_owned(),
                device_name: "cpu".to_owned(),
                is_software: true,
            },
            plan_epoch: 0,
        },
    };
    cluster.step(neighbour);
    let idle_s = |cluster: &Cluster| ["n0", "n1", "n2"].map(|name| cluster.scheduler.idle_for(name).as_secs());
    assert_eq!(idle_s(&cluster), [u64::MAX; 3]);
    cluster.now = Duration::from_secs(10);
    let busy = |busy_s| Event::Measured {
        node_name: "n1".to_owned(),
        plan_epoch: 7,
        costs: MeasuredCosts::default(),
        busy_s,
        views: 1,
        dropped_views: 0,
    };
    cluster.step(busy(0.9));
    cluster.now = Duration::from_secs(14);
    cluster.step(busy(0.1));
    assert_eq!(idle_s(&cluster), [u64::MAX, 4, 4], "a little work makes no node busy");
    assert_eq!(cluster.scheduler.idle_for("n9"), Duration::ZERO, "it is no member");
}

#[test]
fn a_lost_node_concerns_the_workload_that_it_served() {
    let mut cluster = Cluster::of(4);
    cluster.open(of(4, 1));
    cluster.open(of(3, 2));
    let lost = cluster.nodes(2).into_iter().next().unwrap();
    let commands = cluster.step(Event::Left { incarnation: lost[1..].parse().unwrap(), node_name: lost });
    assert_eq!(applied(&commands).iter().map(|plan| plan.0).collect::<Vec<_>>(), [2]);
}

#[test]
fn live_sessions_come_before_batches_which_get_a_twentieth_at_least() {
    let mut cluster = Cluster::of(10);
    cluster.open(of(4, 1));
    cluster.open(rated(of(3, 2), 800.0));
    cluster.pass(80, &[1, 2]);
    assert_eq!((cluster.nodes(1).len(), cluster.nodes(2).len()), (2, 8), "8 nodes' worth of views of 10 ms");
}

#[test]
fn no_more_workloads_than_the_limit_are_opened() {
    let mut cluster = Cluster::of(2);
    cluster.step(Event::Limits { max_workloads: 2, audit_time_ratio: 0.0 });
    cluster.open(of(4, 1));
    cluster.open(of(3, 2));
    let refused = cluster.open(of(2, 3));
    assert_eq!(refusal(&refused).to_string(), "workloads: 2 are open, the limit of --max-workloads");
    let admits = |workload| cluster.scheduler.admits_workload(&workload, None, false);
    assert_eq!(admits(workload(2)), Err(ChoiceError::Workloads { most: 2 }), "before its costs are measured");
    assert_eq!(admits(workload(3)), Ok(()));
    assert_eq!(applied(&cluster.open(of(3, 4))).len(), 1, "one that is open has room");
    cluster.step(Event::Closed { session: 1 });
    assert_eq!(applied(&cluster.open(of(2, 5))).last().map(|plan| plan.2.clone()), Some(vec![5]));
}

#[test]
fn promises_to_one_workload_count_for_all() {
    let mut cluster = Cluster::of(4);
    cluster.open(rated(of(4, 1), 200.0));
    let refused = cluster.open(rated(of(3, 2), 200.0));
    assert!(
        matches!(refusal(&refused), ChoiceError::Overload { needed } if (needed - 1.0).abs() < 0.01),
        "{refused:?}"
    );
    assert!(!applied(&cluster.open(rated(of(3, 3), 100.0))).is_empty());
    assert!(matches!(cluster.scheduler.admits(3, 1, Some(180.0), None), Err(ChoiceError::Overload { .. })));
    assert!(!applied(&cluster.open(of(2, 4))).is_empty(), "a batch takes what is left");
    let refused = cluster.open(rated(of(2, 5), 100.0));
    assert!(matches!(refusal(&refused), ChoiceError::Overload { .. }), "beside a batch, too");
}

#[test]
fn what_a_session_forces_binds_its_own_workload_while_all_its_sessions_force_it() {
    let mut cluster = Cluster::of(4);
    let k = |session, k| Opening { policy_override: forced(PIPELINE, Some(k)), ..of(4, session) };
    cluster.open(k(1, 2));
    assert_eq!(cluster.plan_of(1).samplers.len(), 2);
    let refused = cluster.open(k(2, 1));
    let text = refusal(&refused).to_string();
    assert!(text.ends_with("the workload has other sessions, with policy pipeline, K = 2"), "{text}");
    assert!(!applied(&cluster.open(k(3, 2))).is_empty(), "the same");
    cluster.open(of(4, 4));
    assert!(!cluster.workloads()[0].plan.as_ref().unwrap().reason.contains("asked for"));
    let refused = cluster.open(k(5, 2));
    assert!(refusal(&refused).to_string().ends_with("with policy auto"), "{refused:?}");
    cluster.step(Event::Closed { session: 4 });
    assert_eq!(cluster.plan_of(1).samplers.len(), 2, "it is in force again");
    let other = Opening { policy_override: forced(PolicyChoice::Direct, None), ..of(3, 6) };
    assert!(!applied(&cluster.open(other)).is_empty(), "another workload is free to choose");
}

#[test]
fn a_node_that_cannot_take_a_plan_serves_the_other_workloads() {
    let mut cluster = Cluster::of(2);
    cluster.open(of(4, 1));
    cluster.open(of(3, 2));
    let mut commands = Vec::new();
    for _ in 0..2 {
        let Some(plan) = cluster.workloads()[1].plan.clone().map(|plan| plan.assignment) else { break };
        let plan_epoch = plan.plan_epoch;
        let node_name = plan.compositors[0].node_name.clone();
        commands.extend(cluster.step(Event::Unready { plan_epoch, node_name, reason: "no memory".to_owned() }));
    }
    let scopes = commands.iter().filter_map(|command| match command {
        Command::Quarantine { workload_number, .. } => Some(*workload_number),
        _ => None,
    });
    assert_eq!(scopes.collect::<Vec<_>>(), [Some(2), Some(2)]);
    assert!(cluster.workloads()[1].plan.is_none(), "its session waits");
    assert_eq!(cluster.nodes(1).len(), 2, "the first has all nodes");
    let commands = cluster.pass(5, &[1]);
    assert!(commands.iter().any(|command| matches!(command, Command::Readmit { workload_number: Some(2), .. })));
    assert!(cluster.workloads()[1].plan.is_some());
}

#[test]
fn a_sampler_of_faulty_images_serves_the_other_workloads_and_a_dead_node_none() {
    let mut cluster = Cluster::of(4);
    cluster.open(Opening { policy_override: forced(PIPELINE, Some(1)), ..of(4, 1) });
    cluster.open(of(3, 2));
    let plan = cluster.plan_of(1);
    let sampler = plan.samplers[0].node_name.clone();
    let compositor = plan.compositors[0].node_name.clone();
    let plan_epoch = plan.plan_epoch;
    let report = SamplerReport { plan_epoch, compositor, sampler: sampler.clone(), reason: "no images".to_owned() };
    cluster.step(Event::Reported(report));
    let incarnation = sampler[1..].parse().unwrap();
    let probed = |plan_epoch, kind| Event::Probed {
        plan_epoch,
        node_name: sampler.clone(),
        incarnation,
        kind,
        failure: Some("corrupt".to_owned()),
    };
    let commands = cluster.step(probed(plan_epoch, ProbeKind::Image));
    let scope = |command: &Command| match command {
        Command::Quarantine { workload_number, .. } => *workload_number,
        other => panic!("{other}"),
    };
    assert_eq!(scope(&commands[0]), Some(1));
    assert!(!cluster.nodes(1).contains(&sampler) && cluster.nodes(2).contains(&sampler), "{:?}", cluster.nodes(1));
    assert!(!cluster.plan_of(1).composites(&sampler));
    let commands = cluster.step(probed(cluster.plan_of(2).plan_epoch, ProbeKind::Liveness));
    assert_eq!(scope(&commands[0]), None);
    assert!(!cluster.nodes(2).contains(&sampler));
}

#[test]
fn an_idle_workload_gives_nodes_back_and_gets_one_when_it_works_again() {
    let mut cluster = Cluster::of(4);
    cluster.open(of(4, 1));
    cluster.open(of(3, 2));
    cluster.pass(80, &[1]);
    assert_eq!((cluster.nodes(1).len(), cluster.nodes(2).len()), (4, 1), "it shares its last");
    cluster.step(Event::DemandChanged { session: 2, views_per_set: 10, frames_per_s: None });
    let shared: Vec<_> = cluster.nodes(1).intersection(&cluster.nodes(2)).cloned().collect();
    assert_eq!(shared.len(), 1);
    cluster.pass(80, &[1, 2]);
    assert_eq!((cluster.nodes(1).len(), cluster.nodes(2).len()), (2, 2));
    assert_eq!(cluster.pass(40, &[1, 2]), [], "and then it rests");
}

#[test]
fn workloads_that_outnumber_nodes_share_them() {
    let mut cluster = Cluster::of(2);
    (1..=5).for_each(|number| drop(cluster.open(of(number, number as u64))));
    let busy = [1, 2, 3, 4, 5].map(|i: usize| cluster.workloads()[i - 1].number);
    cluster.pass(80, &busy);
    assert!(
        busy.iter().all(|&number| cluster.nodes(number).len() == 1 && cluster.plan_of(number).compositors.len() == 1)
    );
    let on = |name: &str| busy.iter().filter(|&&number| cluster.nodes(number).contains(name)).count();
    assert_eq!(on("n0").abs_diff(on("n1")), 1);
    let costs = cluster.workloads()[4].plan.as_ref().unwrap().costs;
    assert!(costs.reconstruct_view_s >= 2.0 * 0.009, "they take turns: {costs:?}");
}

#[test]
fn sessions_opened_and_dropped_in_numbers_move_nodes_seldom() {
    let mut cluster = Cluster::of(4);
    cluster.open(of(4, 1));
    let mut plans = 0;
    for i in 0..10_000 {
        let session = 2 + i;
        let mut commands = cluster.open(of(2, session));
        commands.extend(cluster.step(Event::Closed { session }));
        cluster.now += Duration::from_millis(1);
        if i % 250 == 0 {
            commands.extend(cluster.step(Event::Tick));
        }
        plans += applied(&commands).iter().filter(|plan| plan.2.contains(&1)).count();
    }
    assert!(plans <= 5, "{plans} plans in ten seconds");
}

#[test]
fn methods_and_sizes_of_views_belong_to_sessions() {
    let mut cluster = Cluster::of(3);
    let planes = SamplePlanes { normals: true, ..SamplePlanes::default() };
    let mut first = of(4, 1);
    first.workload.planes = planes;
    cluster.open(first.clone());
    let mut slow = Opening { method: "light_field_search".to_owned(), session: 2, ..first.clone() };
    slow.costs.reconstruct_view_s = 0.029;
    cluster.open(slow);
    assert_eq!(cluster.workloads().len(), 1);
    let mean_s = cluster.workloads()[0].conditions[0].costs.reconstruct_view_s;
    assert!((mean_s - 0.019).abs() < 1e-9, "of as many views each: {mean_s}");
    cluster.open(of(4, 3));
    assert_eq!(cluster.workloads().len(), 1, "it needs fewer planes");
    first.workload.planes.corner_inverse_depths = true;
    cluster.open(Opening { session: 4, ..first });
    assert_eq!(cluster.workloads().len(), 2, "it needs more");
    let counts: Vec<u32> = cluster.workloads().iter().map(|workload| workload.session_count).collect();
    assert_eq!(counts, [3, 1]);
    cluster.step(Event::Closed { session: 2 });
    let alone_s = cluster.workloads()[0].conditions[0].costs.reconstruct_view_s;
    assert!((alone_s - 0.009).abs() < 1e-9, "{alone_s}");
}

#[test]
fn a_session_that_does_not_accept_the_fallback_in_force_is_refused_where_it_is_needed() {
    let mut cluster = Cluster::of(2);
    let quality = Quality {
        lighting: "unlit".to_owned(),
        method: "joint_carve:1".to_owned(),
        sample_side_ratio: 1.0,
        frame_rate_ratio: 0.8,
    };
    let fallbacks = vec![quality];
    cluster.open(Opening { fallbacks: fallbacks.clone(), ..rated(of(4, 1), 170.0) });
    let slow = MeasuredCosts { reconstruct_view_s: Some(0.0115), ..MeasuredCosts::default() };
    for _ in 0..40 {
        for name in ["n0", "n1"] {
            let plan_epoch = cluster.plan_of(1).plan_epoch;
            cluster.step(Event::Measured {
                node_name: name.to_owned(),
                plan_epoch,
                costs: slow,
                busy_s: 0.5,
                views: 40,
                dropped_views: 0,
            });
        }
        cluster.pass(1, &[]);
    }
    assert!(cluster.workloads()[0].plan.as_ref().unwrap().fallback.is_some());
    let refused = cluster.open(rated(of(4, 2), 0.1));
    assert!(matches!(refusal(&refused), ChoiceError::Overload { .. }), "{refused:?}");
    assert!(!applied(&cluster.open(Opening { fallbacks, ..rated(of(4, 3), 0.1) })).is_empty());
    assert!(!applied(&cluster.open(of(4, 4))).is_empty(), "batches do not count");
}

#[test]
fn viewers_keep_their_quality_beside_batches() {
    let quality = Quality {
        lighting: "unlit".to_owned(),
        method: "joint_carve:1".to_owned(),
        sample_side_ratio: 1.0,
        frame_rate_ratio: 0.5,
    };
    let mut cluster = Cluster::of(2);
    cluster.open(Opening { fallbacks: vec![quality], ..rated(of(4, 1), 60.0) });
    cluster.open(Opening { views_per_set: 5000, ..of(4, 2) });
    let utilisation = |cluster: &Cluster| cluster.workloads()[0].utilisation.unwrap();
    assert!((utilisation(&cluster) - 0.3).abs() < 0.01, "60 views of 10 ms a second on 2 nodes");
    (3..=5).for_each(|number| drop(cluster.open(of(number - 2, number as u64))));
    cluster.pass(80, &[1, 2, 3, 4, 5]);
    assert!(cluster.nodes(1).len() == 1 && utilisation(&cluster) < 0.7, "{}", utilisation(&cluster));
    assert_eq!(cluster.workloads()[0].plan.as_ref().unwrap().fallback, None);
    assert_eq!(cluster.workloads()[1].utilisation, None, "a batch");
}

#[test]
fn a_batch_that_states_tiny_or_huge_views_and_asks_for_none_costs_viewers_nothing() {
    for reconstruct_view_s in [1e-6, 90.0] {
        let quality = Quality {
            lighting: "unlit".to_owned(),
            method: "joint_carve:1".to_owned(),
            sample_side_ratio: 1.0,
            frame_rate_ratio: 0.5,
        };
        let mut cluster = Cluster::of(2);
        let of = |session| Opening { policy_override: forced(PIPELINE, None), ..of(4, session) };
        cluster.open(Opening { fallbacks: vec![quality], ..rated(of(1), 60.0) });
        let mut other = Opening { views_per_set: 65_536, ..of(2) };
        (other.costs.reconstruct_view_s, other.costs.direct_view_s) = (reconstruct_view_s, 11.0 * reconstruct_view_s);
        cluster.open(other);
        let usual = MeasuredCosts { reconstruct_view_s: Some(0.009), ..MeasuredCosts::default() };
        for _ in 0..40 {
            for name in ["n0", "n1"] {
                let plan_epoch = cluster.plan_of(1).plan_epoch;
                let node_name = name.to_owned();
                let costs = usual;
                let busy_s = 0.3;
                let views = 30;
                cluster.step(Event::Measured { node_name, plan_epoch, costs, busy_s, views, dropped_views: 0 });
            }
            cluster.pass(1, &[]);
        }
        let utilisation = cluster.workloads()[0].utilisation.unwrap();
        assert!((0.2..0.7).contains(&utilisation), "{utilisation}");
        assert_eq!(cluster.workloads()[0].plan.as_ref().unwrap().fallback, None);
        assert_eq!(cluster.scheduler.admits(1, 1, Some(90.0), None), Ok(()));
        cluster.step(Event::Closed { session: 2 });
        let seconds = cluster.workloads()[0].conditions[0].costs.reconstruct_view_s;
        assert!((seconds / 0.009 - 1.0).abs() < 0.2, "{seconds}");
    }
}

#[test]
fn status_says_what_one_more_viewer_would_cost() {
    let mut cluster = Cluster::of(4);
    cluster.open(of(4, 1));
    let [batch] = &cluster.workloads()[..] else { panic!() };
    assert_eq!((batch.session_count, batch.viewer_count), (1, 0));
    assert!((batch.one_more_viewer - 10.0 * 0.01 / 4.0).abs() < 1e-9, "10 views a second of 10 ms on 4 nodes");
    cluster.open(rated(of(3, 2), 20.0));
    cluster.open(rated(of(3, 3), 40.0));
    let viewers = &cluster.workloads()[1];
    assert_eq!((viewers.session_count, viewers.viewer_count), (2, 2));
    assert!((viewers.one_more_viewer - 30.0 * 0.01 / 4.0).abs() < 1e-9, "the mean of theirs");
}
