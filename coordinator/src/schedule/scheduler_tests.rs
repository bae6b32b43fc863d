use std::num::NonZeroU32;

use cluster::{
    Assignment, CommonCell, CommonKind, Costs, Policy, PolicyChoice, Quality, SessionPlan, TileCosts, WorkloadStatus,
};

use super::*;
use crate::schedule::demand::{ChoiceError, PolicyOverride};
use crate::schedule::event::Opening;
use crate::schedule::test_support::{COSTS, Cluster, TILEABLE, join, opened, opening, workload};

const PIPELINE: PolicyChoice = PolicyChoice::Pipeline;

impl Cluster {
    fn left(&mut self, incarnation: u64, name: &str) -> Vec<Command> {
        self.step(Event::Left { incarnation, node_name: name.to_owned() })
    }

    /// All nodes of the plan in force are ready, and time passes, up to the next command.
    fn wait(&mut self, seconds: u64) -> Vec<Command> {
        let plan = self.plan();
        for node_name in self.scheduler.members.keys().cloned().collect::<Vec<_>>() {
            self.step(Event::Ready { plan_epoch: plan.plan_epoch, node_name });
        }
        for _ in 0..seconds * 2 {
            self.now += Duration::from_millis(500);
            let commands = self.step(Event::Tick);
            if !commands.is_empty() {
                return commands;
            }
        }
        Vec::new()
    }

    /// The only workload.
    fn workload(&self) -> WorkloadStatus {
        let [workload] = &self.workloads()[..] else { panic!("{:?}", self.scheduler) };
        workload.clone()
    }

    fn plan(&self) -> Assignment {
        self.workload().plan.expect("a plan").assignment
    }
}

fn timed(node_name: &str, plan_epoch: u64, costs: MeasuredCosts) -> Event {
    Event::Measured { node_name: node_name.to_owned(), plan_epoch, costs, busy_s: 0.1, views: 1, dropped_views: 0 }
}

fn forced_samplers(k: usize) -> PolicyOverride {
    PolicyOverride { policy: PIPELINE, forced_samplers: Some(k), forced_tiles: None }
}

fn applied(commands: &[Command]) -> (&[u64], &SessionPlan) {
    match commands.last() {
        Some(Command::Apply { sessions, plan, .. }) => (sessions, plan),
        other => panic!("{other:?}"),
    }
}

fn assignment_of(commands: &[Command]) -> &Assignment {
    &applied(commands).1.assignment
}

fn roles(plan: &Assignment) -> BTreeMap<&str, (bool, bool)> {
    let mut roles: BTreeMap<&str, (bool, bool)> = BTreeMap::new();
    plan.samplers.iter().for_each(|share| roles.entry(&share.node_name).or_default().0 = true);
    plan.compositors.iter().for_each(|share| roles.entry(&share.node_name).or_default().1 = true);
    roles
}

fn changes(from: &Assignment, to: &Assignment) -> usize {
    let from = roles(from);
    let to = roles(to);
    from.iter().filter(|(name, role)| to.get(*name).is_some_and(|new| new != *role)).count()
}

#[test]
fn every_member_has_a_role_in_a_plan() {
    let mut cluster = Cluster::of(5);
    let commands = cluster.step(opened(1, PIPELINE, 40));
    let plan = assignment_of(&commands);
    assert_eq!(plan.samplers.len() + plan.compositors.len(), 5);
    let images: usize = plan.samplers.iter().map(|share| share.image_indices.len()).sum();
    assert_eq!(images, 4);
    let commands = Cluster::of(5).step(opened(2, PolicyChoice::Direct, 40));
    let plan = assignment_of(&commands);
    assert_eq!((plan.samplers.len(), plan.compositors.len()), (0, 5));
    let commands = Cluster::of(5).step(opened(3, PolicyChoice::TimeShare, 40));
    let plan = assignment_of(&commands);
    assert_eq!((plan.samplers.len(), plan.compositors.len()), (4, 5), "four images");
}

#[test]
fn one_node_has_both_roles() {
    let commands = Cluster::of(1).step(opened(1, PIPELINE, 40));
    let plan = assignment_of(&commands);
    assert_eq!((plan.images_of("n0", 0).len(), plan.composites("n0")), (4, true));
}

#[test]
fn epochs_rise_above_what_any_node_has_seen() {
    let mut cluster = Cluster::of(2);
    assert_eq!(assignment_of(&cluster.step(opened(1, PIPELINE, 40))).plan_epoch, 1);
    assert_eq!(cluster.step(join("late", 9, 41)), []);
    assert_eq!(assignment_of(&cluster.left(1, "n1")).plan_epoch, 42);
}

#[test]
fn sessions_of_one_workload_share_a_plan() {
    let mut cluster = Cluster::of(3);
    cluster.step(opened(1, PIPELINE, 40));
    let commands = cluster.step(opened(2, PIPELINE, 2));
    assert_eq!((commands.len(), applied(&commands).0, assignment_of(&commands).plan_epoch), (1, &[2][..], 1));
    let WorkloadStatus { number, session_count, views_per_set, .. } = cluster.workload();
    assert_eq!((number, session_count, views_per_set), (1, 2, 42));
}

#[test]
fn a_lost_node_is_replaced_at_once() {
    let mut cluster = Cluster::of(4);
    cluster.step(opened(1, PIPELINE, 40));
    let before = cluster.plan();
    let commands = cluster.left(3, "n3");
    let (sessions, plan) = applied(&commands);
    assert_eq!((sessions, plan.assignment.plan_epoch), (&[1][..], 2));
    assert!(plan.reason.ends_with("Planned again: node n3 left the cluster."), "{}", plan.reason);
    assert!(!roles(&plan.assignment).contains_key("n3"));
    assert_eq!(changes(&before, &plan.assignment), 0, "the others keep their roles");
    assert_eq!(cluster.left(3, "n3"), [], "it was gone");
}

#[test]
fn sessions_without_nodes_wait_for_the_next_node() {
    let mut cluster = Cluster::of(1);
    cluster.step(opened(1, PIPELINE, 40));
    assert_eq!(cluster.left(0, "n0"), []);
    assert!(cluster.workload().plan.is_none());
    let refused = cluster.step(opened(2, PIPELINE, 40));
    assert_eq!(refused, [Command::Refuse { session: 2, error: ChoiceError::NoNodes }]);
    let commands = cluster.step(join("n9", 9, 0));
    assert_eq!((applied(&commands).0, assignment_of(&commands).plan_epoch), (&[1][..], 2));
}

#[test]
fn the_later_of_two_processes_with_one_name_counts() {
    let mut cluster = Cluster::of(2);
    cluster.step(opened(1, PIPELINE, 40));
    let commands = cluster.step(join("n0", 7, 1));
    assert!(applied(&commands).1.reason.contains("n0 was started again"));
    assert_eq!(cluster.left(0, "n0"), [], "the earlier one's end");
    assert_eq!(cluster.scheduler.status().nodes.len(), 2);
}

#[test]
fn a_new_node_gets_a_role_after_the_dwell() {
    let mut cluster = Cluster::of(2);
    cluster.step(opened(1, PIPELINE, 400));
    assert_eq!(cluster.step(join("n9", 9, 0)), []);
    let commands = cluster.wait(20);
    assert!((Duration::from_secs(5)..Duration::from_secs(7)).contains(&cluster.now), "{:?}", cluster.now);
    assert!(assignment_of(&commands).composites("n9"));
    assert_eq!(cluster.wait(60), [], "and then it rests");
}

#[test]
fn k_follows_the_views_two_roles_at_a_time() {
    let mut cluster = Cluster::of(11);
    cluster.step(opened(1, PIPELINE, 1));
    let mut k = vec![cluster.plan().samplers.len()];
    cluster.step(Event::DemandChanged { session: 1, views_per_set: 500, frames_per_s: None });
    loop {
        let before = cluster.plan();
        if cluster.wait(60).is_empty() {
            break;
        }
        assert!(changes(&before, &cluster.plan()) <= 2);
        k.push(cluster.plan().samplers.len());
    }
    assert!(k.len() > 1 && k.is_sorted_by(|a, b| a > b), "{k:?}");
    let plan = cluster.workload().plan.unwrap();
    assert!(plan.predicted_pipeline_s <= plan.predicted_k_fd_s * 1.1, "{}", plan.reason);
}

#[test]
fn a_sampler_that_reports_higher_costs_loses_its_role() {
    let mut cluster = Cluster::of(4);
    cluster.step(opened(1, PIPELINE, 30));
    let sampler = cluster.plan().samplers[0].node_name.clone();
    let costs = MeasuredCosts { sample_image_s: Some(10.0 * COSTS.sample_image_s), ..MeasuredCosts::default() };
    for _ in 0..20 {
        cluster.step(timed(&sampler, 1, costs));
    }
    let commands = cluster.wait(60);
    assert!(!assignment_of(&commands).samplers.iter().any(|share| share.node_name == sampler));
    let conditions = cluster.workload().conditions;
    assert!(conditions.iter().any(|c| c.node_name == sampler && c.costs.sample_image_s > 0.9));
}

#[test]
fn timings_of_another_plan_change_no_cost() {
    let mut cluster = Cluster::of(4);
    cluster.step(opened(1, PIPELINE, 30));
    let costs = MeasuredCosts { reconstruct_view_s: Some(1.0), ..MeasuredCosts::default() };
    let before = cluster.scheduler.costs_now(1);
    for plan_epoch in [0, 2] {
        (0..20).for_each(|_| drop(cluster.step(timed("n1", plan_epoch, costs))));
    }
    assert_eq!(cluster.scheduler.costs_now(1), before);
    assert_eq!(cluster.workload().conditions[1].views, 40, "its views count all the same");
    cluster.step(timed("n1", 1, costs));
    cluster.step(timed("n1", 1, costs));
    assert_ne!(cluster.scheduler.costs_now(1), before);
}

#[test]
fn events_of_old_plans_and_unknown_nodes_are_ignored() {
    let mut cluster = Cluster::of(2);
    cluster.step(opened(1, PIPELINE, 40));
    let ready = |plan_epoch, name: &str| Event::Ready { plan_epoch, node_name: name.to_owned() };
    for event in [
        ready(0, "n0"),
        ready(1, "unknown"),
        timed("unknown", 1, MeasuredCosts::default()),
        Event::DemandChanged { session: 77, views_per_set: 1, frames_per_s: None },
        Event::Closed { session: 77 },
    ] {
        assert_eq!(cluster.step(event), []);
    }
    let is_ready = |cluster: &Cluster| cluster.workload().conditions.iter().filter(|c| c.is_ready).count();
    assert_eq!(is_ready(&cluster), 0);
    cluster.step(ready(1, "n0"));
    assert_eq!(is_ready(&cluster), 1);
}

#[test]
fn an_impossible_forced_k_is_refused_and_later_reduced() {
    let mut cluster = Cluster::of(4);
    let forced = |k| Opening { policy_override: forced_samplers(k), ..opening(1, PIPELINE, 40) };
    assert!(matches!(
        cluster.step(Event::Opened(Box::new(forced(4))))[..],
        [Command::Refuse { error: ChoiceError::ForcedSamplers { forced: 4, most: 3, .. }, .. }]
    ));
    cluster.step(Event::Opened(Box::new(forced(3))));
    assert_eq!(cluster.plan().samplers.len(), 3);
    assert_eq!(assignment_of(&cluster.left(0, "n0")).samplers.len(), 2);
}

#[test]
fn closed_sessions_are_forgotten_and_a_refused_one_ends_no_other() {
    let mut cluster = Cluster::of(2);
    cluster.step(opened(1, PIPELINE, 40));
    let other = Opening { workload: workload(2), policy_override: forced_samplers(9), ..opening(2, PIPELINE, 40) };
    assert!(matches!(cluster.step(Event::Opened(Box::new(other)))[..], [Command::Refuse { session: 2, .. }]));
    cluster.step(Event::Closed { session: 1 });
    assert!(cluster.scheduler.status().workloads.is_empty());
    assert_eq!(cluster.left(0, "n0"), []);
}

#[test]
fn commands_have_a_text_form() {
    let mut cluster = Cluster::of(2);
    let text = cluster.step(opened(1, PIPELINE, 40))[0].to_string();
    assert!(
        text.starts_with(
            "apply plan 1 of workload 1 to sessions [1]: pipeline, samplers n0[0,1,2,3], compositors n1, "
        ),
        "{text}"
    );
    let refused = Command::Refuse { session: 3, error: ChoiceError::NoNodes };
    assert_eq!(refused.to_string(), "refuse session 3: no node has joined the cluster");
}

fn rated(session: u64, frames_per_s: f64, fallbacks: Vec<Quality>) -> Event {
    let asked = opening(session, PolicyChoice::Auto, 1);
    Event::Opened(Box::new(Opening { frames_per_s: Some(frames_per_s), fallbacks, ..asked }))
}

fn quality(method: &str, frame_rate_ratio: f64) -> Quality {
    Quality { lighting: "unlit".to_owned(), method: method.to_owned(), sample_side_ratio: 0.5, frame_rate_ratio }
}

#[test]
fn a_static_scene_with_a_rate_is_sampled_once_and_all_nodes_make_views() {
    let mut cluster = Cluster::of(5);
    let commands = cluster.step(rated(1, 100.0, Vec::new()));
    let plan = assignment_of(&commands);
    assert_eq!((plan.policy, plan.compositors.len()), (Policy::TimeShare, 5), "{}", applied(&commands).1.reason);
    let utilisation = cluster.workload().utilisation.unwrap();
    assert!((utilisation - 0.2).abs() < 1e-9, "100 views of 10 ms by 5 nodes: {utilisation}");
}

#[test]
fn views_that_take_longer_than_a_second_are_admitted_at_a_rate_that_leaves_them_time() {
    let costs = Costs { reconstruct_view_s: 3.0, direct_view_s: 9.0, ..COSTS };
    let rated = |session, frames_per_s| {
        let asked = opening(session, PIPELINE, 1);
        Event::Opened(Box::new(Opening { frames_per_s: Some(frames_per_s), costs, ..asked }))
    };
    let mut cluster = Cluster::of(2);
    let refused = cluster.step(rated(1, 0.5));
    assert!(matches!(refused[..], [Command::Refuse { session: 1, .. }]), "a view in two seconds: {refused:?}");
    cluster.step(rated(2, 0.1));
    let utilisation = cluster.workload().utilisation.unwrap();
    assert!((utilisation - 0.3).abs() < 0.01, "a view of three seconds in ten: {utilisation}");
}

#[test]
fn a_session_begins_at_the_fallback_that_has_room_where_its_time_is_known() {
    let fallbacks = vec![quality("fast", 1.0), quality("draft", 1.0), quality("draft", 0.8)];
    let rated = |session, frames_per_s, last_view_time_ratio| {
        let asked = opening(session, PIPELINE, 1);
        let frames_per_s = Some(frames_per_s);
        let fallbacks = fallbacks.clone();
        Event::Opened(Box::new(Opening { frames_per_s, fallbacks, last_view_time_ratio, ..asked }))
    };
    let step_at = |frames_per_s, ratio| {
        let mut cluster = Cluster::of(2);
        let commands = cluster.step(rated(1, frames_per_s, ratio));
        let [Command::Apply { plan, .. }] = &commands[..] else { panic!("{commands:?}") };
        plan.fallback.map_or(0, |step| step.get())
    };
    // A view takes 10 ms of one of two nodes, the other of which samples: a quarter of it at the last fallback.
    assert_eq!([80.0, 150.0, 300.0, 400.0].map(|rate| step_at(rate, 0.25)), [0, 1, 2, 3]);
    assert_eq!(step_at(80.0, 1.0), 0);
    let refused = |rate, ratio| matches!(Cluster::of(2).step(rated(1, rate, ratio))[..], [Command::Refuse { .. }]);
    assert!(refused(150.0, 1.0) && !refused(150.0, 0.25), "its times are not known");
    assert!(refused(500.0, 0.25));
}

#[test]
fn what_a_busy_machine_took_refuses_nothing_once_it_is_idle() {
    let mut cluster = Cluster::of(2);
    cluster.step(rated(1, 50.0, Vec::new()));
    cluster.wait(1);
    let plan_epoch = cluster.plan().plan_epoch;
    let now = cluster.now;
    let slow = MeasuredCosts { reconstruct_view_s: Some(4.0 * COSTS.reconstruct_view_s), ..MeasuredCosts::default() };
    for second in 1..30 {
        cluster.now = now + Duration::from_secs(second);
        for name in ["n0", "n1"] {
            cluster.step(timed(name, plan_epoch, slow));
        }
    }
    let admits = |cluster: &Cluster| cluster.scheduler.admits(1, 1, Some(60.0), None);
    assert!(matches!(admits(&cluster), Err(ChoiceError::Overload { .. })), "other programs use the machine");
    cluster.now += Duration::from_secs(11);
    cluster.step(Event::Tick);
    assert_eq!(admits(&cluster), Ok(()), "nothing has been timed for a while");
}

#[test]
fn sessions_beyond_the_nodes_time_are_refused() {
    let mut cluster = Cluster::of(2);
    let fallbacks = vec![quality("joint_carve:1", 0.8)];
    cluster.step(rated(1, 150.0, fallbacks.clone()));
    let refused = cluster.step(rated(2, 100.0, Vec::new()));
    let [Command::Refuse { session: 2, error }] = &refused[..] else { panic!("{refused:?}") };
    assert_eq!(error.to_string(), "frames_per_s: all sessions together would take 1.25 times what the nodes can do");
    assert_eq!(cluster.workload().session_count, 1);
    let admitted = cluster.step(rated(3, 70.0, fallbacks));
    assert!(matches!(admitted[..], [Command::Apply { .. }]), "220 are too many, 176 are not: {admitted:?}");
    let scheduler = &cluster.scheduler;
    assert!(
        matches!(scheduler.admits(3, 1, Some(140.0), None), Err(ChoiceError::Overload { .. })),
        "nor may one ask for it later"
    );
    assert_eq!(
        [scheduler.admits(3, 1, Some(60.0), None), scheduler.admits(1, 1, Some(1.0), None)],
        [Ok(()), Ok(())],
        "less, always"
    );
    let batch = cluster.step(opened(4, PolicyChoice::Auto, 1000));
    assert!(!batch.iter().any(|command| matches!(command, Command::Refuse { .. })), "a batch waits for its turn");
}

/// The plans of a session with two mirror cells, whose sampler makes views slower than they were alone.
#[test]
fn mirror_cells_leave_with_the_first_fallback_and_plans_stay_whole() {
    let mut cluster = Cluster::of(3);
    let asked = opening(1, PolicyChoice::Pipeline, 1);
    let mirror =
        CommonCell { kind: CommonKind::Mirrors, bounds: asked.workload.volume, sampling: "conventional".to_owned() };
    let cameras = asked.workload.sample_cameras.clone();
    let workload = asked.workload.clone().with_common_cells(vec![(mirror.clone(), cameras.clone()), (mirror, cameras)]);
    let whole = Quality { sample_side_ratio: 1.0, ..quality("joint_carve", 1.0) };
    let fallbacks = vec![whole, quality("joint_carve:1", 0.8)];
    let opening = Opening { workload, frames_per_s: Some(150.0), fallbacks, ..asked };
    let commands = cluster.step(Event::Opened(Box::new(opening)));
    let first = assignment_of(&commands);
    assert_eq!((first.image_count(), first.workload.common_cells.len(), first.validate()), (12, 2, Ok(())));
    let slow =
        MeasuredCosts { reconstruct_view_s: Some(0.0145), encode_view_s: Some(0.001), ..MeasuredCosts::default() };
    let mut plans = Vec::new();
    for _ in 0..240 {
        for name in ["n0", "n1", "n2"] {
            let node_name = name.to_owned();
            let plan_epoch = cluster.plan().plan_epoch;
            cluster.step(Event::Ready { plan_epoch, node_name: node_name.clone() });
            let busy_s = 0.5;
            let views = 40;
            let dropped_views = 0;
            cluster.step(Event::Measured { node_name, plan_epoch, costs: slow, busy_s, views, dropped_views });
        }
        cluster.now += Duration::from_millis(500);
        plans.extend(cluster.step(Event::Tick).into_iter().filter_map(|command| match command {
            Command::Apply { plan, .. } => Some(plan.assignment),
            _ => None,
        }));
    }
    assert!(plans.iter().all(|plan| plan.validate().is_ok()), "{plans:?}");
    let without = plans.iter().find(|plan| plan.workload.common_cells.is_empty()).expect("a fallback");
    assert_eq!((without.image_count(), without.workload.cell_count()), (4, 1));
}

#[test]
fn overload_steps_down_the_fallbacks_and_plans_name_them() {
    let mut cluster = Cluster::of(2);
    cluster.step(rated(1, 180.0, vec![quality("joint_carve:1", 1.0), quality("joint_carve:2", 0.8)]));
    // Views take a quarter longer than they did alone.
    let slow =
        MeasuredCosts { reconstruct_view_s: Some(0.0115), encode_view_s: Some(0.001), ..MeasuredCosts::default() };
    let mut seen = Vec::new();
    for _ in 0..240 {
        for name in ["n0", "n1"] {
            let node_name = name.to_owned();
            let plan_epoch = cluster.plan().plan_epoch;
            cluster.step(Event::Ready { plan_epoch, node_name: node_name.clone() });
            cluster.step(Event::Measured {
                node_name,
                plan_epoch,
                costs: slow,
                busy_s: 0.5,
                views: 40,
                dropped_views: 0,
            });
        }
        cluster.now += Duration::from_millis(500);
        let commands = cluster.step(Event::Tick);
        seen.extend(commands.iter().filter_map(|command| match command {
            Command::Apply { plan, .. } => Some(plan.fallback),
            _ => None,
        }));
    }
    assert_eq!(seen, [1, 2].map(NonZeroU32::new), "1.125 of their time at 180, 0.9 at 144");
    let plan = cluster.plan();
    assert_eq!(cluster.workload().plan.unwrap().method, "joint_carve:2");
    assert_eq!(plan.workload.sample_cameras[0].size_px().x, 4, "half of 8");
    cluster.step(Event::DemandChanged { session: 1, views_per_set: 1, frames_per_s: Some(20.0) });
    let plans: Vec<_> = (0..2).map(|_| applied(&cluster.wait(60)).1.fallback).collect();
    assert_eq!(plans, [1, 0].map(NonZeroU32::new), "with less to do they get all again");
    assert_eq!(cluster.workload().plan.unwrap().method, "joint_carve");
}

#[test]
fn the_achieved_time_of_a_set_is_that_of_the_busiest_node() {
    let mut cluster = Cluster::of(2);
    cluster.step(opened(1, PIPELINE, 40));
    let report = |plan_epoch: u64, name: &str, busy_s: f64, views: u64| Event::Measured {
        node_name: name.to_owned(),
        plan_epoch,
        costs: MeasuredCosts::default(),
        busy_s,
        views,
        dropped_views: 2,
    };
    cluster.step(report(1, "n0", 0.5, 0));
    assert!(cluster.workload().achieved.is_empty(), "no set is complete");
    cluster.step(report(1, "n1", 0.8, 80));
    cluster.step(report(7, "n1", 100.0, 80));
    let status = cluster.workload();
    let [achieved] = status.achieved[..] else { panic!("{:?}", status.achieved) };
    assert_eq!((achieved.policy, achieved.busy_s), (Policy::Pipeline, 0.4), "0.8 s for two sets");
    assert_eq!((status.conditions[1].views, status.conditions[1].dropped_views), (160, 4));
}

#[test]
fn expensive_images_are_tiled_so_that_more_nodes_sample_them() {
    let mut cluster = Cluster::of(11);
    let tiles = Some(TileCosts { overhead_s: 0.05, row_shares: None });
    let costs = Costs { sample_image_s: 10.0, tiles, ..COSTS };
    let commands = cluster.step(Event::Opened(Box::new(Opening { costs, ..opening(1, PIPELINE, 1000) })));
    let plan = assignment_of(&commands);
    let session = applied(&commands).1;
    assert!(plan.tile_count > 1 && plan.samplers.len() > 4, "{}", session.reason);
    let whole_s = 10.0f64.max(1000.0 * 0.01 / 7.0);
    let ideal_s = (4.0 * 10.0 + 1000.0 * 0.01) / 11.0;
    assert!(session.predicted_s() < 0.6 * whole_s && session.predicted_s() < 1.2 * ideal_s, "{}", session.reason);
    let mut parts: Vec<u32> = plan.samplers.iter().flat_map(|share| share.image_indices.clone()).collect();
    parts.sort_unstable();
    assert_eq!(parts, (0..4 * plan.tile_count).collect::<Vec<_>>());
    let forced_tiles = PolicyOverride { policy: PIPELINE, forced_tiles: Some(3), forced_samplers: None };
    let forced = Opening { policy_override: forced_tiles, workload: workload(3), ..opening(2, PIPELINE, 10) };
    let refused = cluster.step(Event::Opened(Box::new(forced)));
    assert!(matches!(&refused[..], [Command::Refuse { error: ChoiceError::ForcedTiles { forced: 3 }, .. }]));
}

/// Equal nodes that report the cost of their own tiles, some of which show the sky alone.
#[test]
fn tiles_of_different_cost_move_no_roles() {
    let mut cluster = Cluster::of(11);
    cluster.step(Event::Opened(Box::new(Opening { costs: TILEABLE, ..opening(1, PIPELINE, 100) })));
    let plan = cluster.plan();
    assert!(plan.tile_count > 1, "{}", plan.tile_count);
    for round in 0..120 {
        for share in &plan.samplers {
            let tile_s =
                |&part: &u32| TILEABLE.sample_this_tile_s((part % plan.tile_count) as usize, plan.tile_count as usize);
            // The first builds shaders.
            let more_or_less = if round == 0 { 3.0 } else { 1.0 } * (0.8 + 0.1 * f64::from(share.image_indices[0] % 5));
            let tiles_s: f64 = more_or_less * share.image_indices.iter().map(tile_s).sum::<f64>();
            let images = share.image_indices.len() as f64 / f64::from(plan.tile_count);
            let measured = MeasuredCosts { sample_image_s: Some(tiles_s / images), ..MeasuredCosts::default() };
            assert_eq!(cluster.step(timed(&share.node_name, plan.plan_epoch, measured)), []);
        }
        assert_eq!(cluster.wait(1), []);
    }
}

#[test]
fn images_are_relayed_over_slow_links() {
    let mut cluster = Cluster::of(8);
    cluster.step(opened(1, PIPELINE, 1000));
    assert_eq!(cluster.plan().relay_fanout, None);
    let costs = MeasuredCosts { transfer_bytes_per_s: Some(1e6), image_bytes: Some(1e5), ..MeasuredCosts::default() };
    for name in (0..8).map(|i| format!("n{i}")) {
        cluster.step(Event::Measured {
            node_name: name,
            plan_epoch: 1,
            costs,
            busy_s: 0.0,
            views: 0,
            dropped_views: 0,
        });
    }
    // 4 images of 0.1 s to each of 7 compositors: 2.8 s from one sampler, more than their views take.
    let commands = cluster.wait(30);
    assert_eq!(assignment_of(&commands).relay_fanout.map(NonZeroU32::get), Some(2));
}
