//! Budgets in the schedule: plans, representations and promises, on nodes that answer at once.

use std::collections::VecDeque;
use std::time::Duration;

use cluster::{Costs, MeasuredCosts, Policy, PolicyChoice, Promise, PromiseState, SamplePlanes, SessionPlan};
use depth_image::{Camera, PinholeCamera};
use glam::{UVec2, Vec3};
use planner::{Event as PlannerEvent, Kept, Probed, Row, RowCosts, Timed, ViewErrors};

use super::test_support::{COSTS, join, opening};
use super::{Budgeted, Command, Event, Opening, PolicyOverride, Recorder, Scheduler, ViewProbe, replay};

/// FLIP of a row of S cameras: 0.16 / S.
fn errors(row: &Row) -> ViewErrors {
    let flip = 0.16 / f64::from(row.camera_count);
    ViewErrors { foreground_ratio: 0.5, flip, flip_whole: flip / 2.0, mean_square: flip / 10.0, disoccluded_ratio: 0.0 }
}

fn rows() -> Vec<Row> {
    let row = |camera_count| Row {
        sampling: "conventional".to_owned(),
        method: format!("carve:{camera_count}"),
        camera_count,
        place_count: camera_count,
        side_ratio: 1.0,
        kind: "conventional carve".to_owned(),
        rank: 0,
    };
    [1, 2, 4, 8].map(row).to_vec()
}

/// A rig of four cameras, so that a cell lies between them.
fn rig() -> Vec<Camera> {
    let camera = |x: f32, y: f32| {
        let eye = Vec3::new(x, y, 3.0);
        Camera::Pinhole(PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, UVec2::splat(64)))
    };
    vec![camera(-0.5, -0.5), camera(0.5, -0.5), camera(-0.5, 0.5), camera(0.5, 0.5)]
}

fn budgeted(budget: &str) -> Budgeted {
    let Camera::Pinhole(view) = rig()[0];
    Budgeted {
        budget: budget.parse().unwrap(),
        rows: rows(),
        whole_px: UVec2::splat(64),
        keeps_cameras: false,
        typical_view: view,
        antialias_samples: 1,
        codec: "lz4".to_owned(),
        screening_lighting: "unlit".to_owned(),
    }
}

/// A viewer with a budget; the pipeline is forced, so that views are not drawn directly.
fn viewer(session: u64, budget: &str) -> Opening {
    let mut opening = opening(session, PolicyChoice::Pipeline, 1);
    opening.workload.sample_cameras = rig();
    opening.frames_per_s = Some(10.0);
    opening.budgeted = Some(budgeted(budget));
    opening
}

/// A cluster whose nodes answer every probe with the errors of its row.
struct Cluster {
    scheduler: Scheduler,
    log: Vec<(Duration, Event)>,
    now: Duration,
    commands: Vec<Command>,
    probes: Vec<ViewProbe>,
    promises: Vec<(Vec<u64>, Promise)>,
    plans: Vec<SessionPlan>,
    kept: Option<Kept>,
    error_scale: f64,
    busy_s: f64,
    /// Probes are answered one by one.
    is_slow: bool,
    /// Nodes never take a plan.
    is_unapplied: bool,
}

impl Cluster {
    fn of(nodes: usize) -> Self {
        let mut cluster = Self {
            scheduler: Scheduler::default(),
            log: Vec::new(),
            now: Duration::ZERO,
            commands: Vec::new(),
            probes: Vec::new(),
            promises: Vec::new(),
            plans: Vec::new(),
            kept: None,
            error_scale: 1.0,
            busy_s: 0.01,
            is_slow: false,
            is_unapplied: false,
        };
        (0..nodes).for_each(|number| cluster.tell(join(&format!("n{number}"), number as u64 + 1, 0)));
        cluster
    }

    /// Takes an event, and all answers that follow from it.
    fn tell(&mut self, event: Event) {
        let mut events = VecDeque::from([event]);
        while let Some(event) = events.pop_front() {
            self.log.push((self.now, event.clone()));
            let commands = self.scheduler.step(self.now, event);
            self.commands.extend(commands.clone());
            events.extend(commands.into_iter().filter_map(|command| self.execute(command)));
        }
    }

    fn execute(&mut self, command: Command) -> Option<Event> {
        match command {
            Command::Recall { workload_number, key } => {
                let kept = self.kept.clone().filter(|kept| kept.key == key).unwrap_or_else(|| Kept::empty(key));
                return Some(planned(workload_number, PlannerEvent::Remembered(kept)));
            }
            Command::ProbeViews(probe) => {
                self.probes.push((*probe).clone());
                if self.is_slow {
                    return None;
                }
                let event = self.answer(&probe);
                return Some(planned(probe.workload_number, event));
            }
            Command::Keep(kept) => self.kept = Some(*kept),
            Command::Represent { workload_number, plan, measurement } => {
                let images = measurement.workload.sample_cameras.len() as f64;
                let costs = Costs { reconstruct_view_s: COSTS.reconstruct_view_s * images, ..COSTS };
                let planes = SamplePlanes { normals: true, ..SamplePlanes::default() };
                return Some(Event::Represented { workload_number, plan, costs, planes });
            }
            Command::Promise { sessions, promise } => self.promises.push((sessions, *promise)),
            Command::Apply { plan, .. } => {
                let plan_epoch = plan.assignment.plan_epoch;
                self.plans.push(*plan);
                return (!self.is_unapplied).then_some(Event::Applied { plan_epoch });
            }
            _ => (),
        }
        None
    }

    fn answer(&self, probe: &ViewProbe) -> PlannerEvent {
        let costs = |row: usize| {
            let cameras = f64::from(rows()[row].camera_count);
            RowCosts { sample_image_s: 0.01, load_set_s: 0.001 * cameras, reconstruct_view_s: 0.001 * cameras }
        };
        let (id, busy_s) = (probe.id, self.busy_s);
        if probe.views.is_empty() {
            let rows = probe.requests.iter().map(|(row, _)| (*row, costs(*row))).collect();
            return PlannerEvent::Timed(Timed { id, rows, busy_s });
        }
        let (row, request) = &probe.requests[0];
        assert_eq!(request.views.len(), probe.views.len());
        let of = errors(&rows()[*row]);
        let of = ViewErrors { flip: of.flip * self.error_scale, ..of };
        let views = probe.views.iter().map(|view| (*view, of)).collect();
        PlannerEvent::Probed(Probed { id, row: *row, views, costs: costs(*row), busy_s })
    }

    fn open(&mut self, opening: Opening) {
        self.tell(Event::Opened(Box::new(opening)));
    }

    fn answer_one(&mut self) {
        let probe = self.probes.last().unwrap().clone();
        let event = self.answer(&probe);
        self.tell(planned(probe.workload_number, event));
    }

    fn wait(&mut self, seconds: u64) {
        self.wait_ticks(seconds * 4);
    }

    fn wait_ticks(&mut self, ticks: u64) {
        for _ in 0..ticks {
            self.now += Duration::from_millis(250);
            self.tell(Event::Tick);
        }
    }

    fn promise(&self) -> &Promise {
        &self.promises.last().unwrap().1
    }

    fn plan(&self) -> &SessionPlan {
        self.plans.last().unwrap()
    }
}

fn recorded(log: &[(Duration, Event)]) -> Vec<u8> {
    let mut text = Vec::new();
    let mut recorder = Recorder::new(&mut text).unwrap();
    log.iter().for_each(|(now, event)| recorder.record(*now, event).unwrap());
    text
}

fn planned(workload_number: u64, event: PlannerEvent) -> Event {
    Event::Planned { workload_number, event: Box::new(event) }
}

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
    let (sessions, promise) = cluster.promises.last().unwrap();
    assert_eq!((sessions.as_slice(), promise.budget.as_str()), (&[1, 2][..], "flip 0.05"));
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
    let (mut begun, mut answered) = (Vec::new(), 0);
    for _ in 0..200 {
        let plan_epoch = cluster.plan().assignment.plan_epoch;
        for node in ["n0", "n1", "n2"] {
            let (node_name, costs) = (node.to_owned(), MeasuredCosts::default());
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
