//! Budgets in the schedule: plans, rows in force, promises and audits.

use std::collections::VecDeque;
use std::time::Duration;

use cluster::{AuditReport, AuditedView, Policy, PolicyChoice, Promise, PromiseState, SamplePlanes, SessionPlan};
use depth_image::{Camera, PinholeCamera};
use glam::{UVec2, Vec3};
use planner::{Probed, Row, RowCosts, ViewErrors};

use super::test_support::{join, opening};
use super::{Budgeted, Command, Event, Opening, Recorder, Scheduler, ViewProbe, replay};

const LIGHTING: &str = "unlit";

/// Rows whose FLIP is 0.16 over S, and direct drawing with a quarter of the rays, and with all.
fn rows() -> Vec<Row> {
    let of = |camera_count| Row::Samples { method: format!("carve:{camera_count}"), camera_count, density: 1.0 };
    let direct = |lighting: &str, ray_ratio| Row::Direct { lighting: lighting.to_owned(), ray_ratio };
    [1, 2, 4, 8].map(of).into_iter().chain([direct("quarter", 0.25), direct(LIGHTING, 1.0)]).collect()
}

fn errors(request: &cluster::MeasureCosts) -> ViewErrors {
    let images = request.workload.sample_cameras.len() as f64;
    let flip = match request.workload.lighting.as_str() {
        LIGHTING if request.method == cluster::DIRECT => 0.0,
        LIGHTING => 0.16 / images,
        _ => 0.1,
    };
    ViewErrors { foreground_ratio: 0.5, flip, mean_square: flip * flip }
}

/// A rig of four cameras, so that a cell lies between them.
fn rig() -> Vec<Camera> {
    let camera = |x: f32, y: f32| {
        let eye = Vec3::new(x, y, 3.0);
        Camera::Pinhole(PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, UVec2::splat(64)))
    };
    vec![camera(-0.5, -0.5), camera(0.5, -0.5), camera(-0.5, 0.5), camera(0.5, 0.5)]
}

fn viewer(session: u64, budget: &str) -> Opening {
    let mut opening = opening(session, PolicyChoice::Auto, 1);
    opening.workload.sample_cameras = rig().into_iter().map(Into::into).collect();
    opening.workload.lighting = LIGHTING.to_owned();
    opening.frames_per_s = Some(10.0);
    opening.costs.direct_view_s = 1.0;
    opening.budgeted = Some(Budgeted {
        budget: budget.parse().unwrap(),
        rows: rows(),
        full_px: UVec2::splat(64),
        typical_view: *rig()[0].reference(),
        antialias_samples: 1,
        codec: "lz4".to_owned(),
    });
    opening
}

/// A cluster whose nodes answer every probe with the errors of its row.
struct Cluster {
    scheduler: Scheduler,
    log: Vec<(Duration, Event)>,
    now: Duration,
    commands: Vec<Command>,
    probes: Vec<ViewProbe>,
    promises: Vec<Promise>,
    plans: Vec<SessionPlan>,
    error_scale: f64,
    /// Probes are not answered.
    is_slow: bool,
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
            error_scale: 1.0,
            is_slow: false,
        };
        cluster.tell(Event::Limits { max_workloads: 8, audit_time_ratio: 0.01 });
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
            Command::ProbeViews(probe) => {
                self.probes.push((*probe).clone());
                (!self.is_slow).then(|| self.answer(&probe))
            }
            Command::Promise { promise, .. } => {
                self.promises.push(*promise);
                None
            }
            Command::Apply { plan, .. } => {
                let plan_epoch = plan.assignment.plan_epoch;
                self.plans.push(*plan);
                Some(Event::Applied { plan_epoch })
            }
            _ => None,
        }
    }

    fn answer(&self, probe: &ViewProbe) -> Event {
        let images = probe.request.workload.sample_cameras.len() as f64;
        let of = errors(&probe.request);
        let of = ViewErrors { flip: of.flip * self.error_scale, ..of };
        let view_s = match probe.request.method == cluster::DIRECT {
            true if of.flip > 0.0 => 0.5,
            true => 1.0,
            false => 0.01 * images,
        };
        let probed = Probed {
            id: probe.id,
            views: vec![of; probe.request.typical_views.len()],
            costs: RowCosts { sample_image_s: 0.01, load_set_s: 0.001, view_s },
            busy_s: 0.01,
        };
        let planes = SamplePlanes { normals: true, ..SamplePlanes::default() };
        Event::ViewsProbed { workload_number: probe.workload_number, probed: Box::new(probed), planes }
    }

    fn open(&mut self, opening: Opening) {
        self.tell(Event::Opened(Box::new(opening)));
    }

    fn wait(&mut self, seconds: u64) {
        for _ in 0..4 * seconds {
            self.now += Duration::from_millis(250);
            self.tell(Event::Tick);
        }
    }

    fn promise(&self) -> Promise {
        self.scheduler.status().workloads[0].promise.clone().unwrap()
    }

    fn plan(&self) -> &SessionPlan {
        self.plans.last().unwrap()
    }

    fn method(&self) -> Option<&str> {
        self.plan().assignment.method.as_deref()
    }

    fn count(&self, state: PromiseState) -> usize {
        let mut states: Vec<PromiseState> = self.promises.iter().map(|promise| promise.state).collect();
        states.dedup();
        states.into_iter().filter(|other| *other == state).count()
    }

    /// Tells of audited views with these errors, one a second; the number after which the promise was broken.
    fn audit(&mut self, flips: impl IntoIterator<Item = f64>) -> Option<usize> {
        let before = self.count(PromiseState::Broken);
        let mut broken = None;
        for (place, flip) in flips.into_iter().enumerate() {
            let view = AuditedView {
                plan_epoch: self.plan().assignment.plan_epoch,
                errors: ViewErrors { foreground_ratio: 0.5, flip, mean_square: flip * flip },
                is_part: false,
            };
            let report = AuditReport { views: vec![view], covered_views: 10, uncovered_views: 1 };
            self.tell(Event::Audited { workload_number: 1, node_name: "n0".to_owned(), report });
            broken = broken.or((self.count(PromiseState::Broken) > before).then_some(place + 1));
            self.wait(1);
        }
        broken
    }
}

/// A cluster that audits, with a promise that is kept by four cameras.
fn kept(budget: &str) -> Cluster {
    let mut cluster = Cluster::of(3);
    cluster.open(viewer(1, budget));
    cluster.wait(20);
    assert_eq!(cluster.promise().state, PromiseState::Kept, "{}", cluster.promise());
    cluster
}

#[test]
fn a_session_opens_at_once_and_gets_the_cheapest_row_that_keeps_its_budget() {
    let mut cluster = Cluster::of(3);
    cluster.open(viewer(1, "flip 0.06"));
    let first = &cluster.plans[0].assignment;
    assert_eq!((first.method.clone(), first.audit.clone()), (None, None), "what was asked for");
    assert_eq!(cluster.promises[0].state, PromiseState::Measuring);
    cluster.wait(20);
    let promise = cluster.promise();
    assert_eq!(promise.state, PromiseState::Kept, "{promise}");
    assert!((promise.expected_ratio - 0.04).abs() < 1e-9 && promise.bound_ratio <= 0.06, "{promise:?}");
    let assignment = &cluster.plan().assignment;
    assert_eq!((assignment.method.as_deref(), assignment.workload.sample_cameras.len()), (Some("carve:4"), 4));
    assert!(assignment.workload.planes.normals, "planes of the method");
    let order = assignment.audit.clone().unwrap();
    assert_eq!((order.time_ratio, order.planned_pixel_count, order.truth_lighting.as_str()), (0.01, 64 * 64, LIGHTING));
    // Another session with the same budget shares the promise; one with another budget has a plan of its own.
    cluster.open(viewer(2, "flip 0.06"));
    assert_eq!(cluster.scheduler.status().workloads.len(), 1);
    cluster.open(viewer(3, "flip 0.05"));
    assert_eq!(cluster.scheduler.status().workloads.len(), 2);
}

#[test]
fn direct_drawing_with_fewer_rays_is_put_in_force_and_audited_against_all_rays() {
    let mut cluster = Cluster::of(2);
    cluster.error_scale = 4.0;
    cluster.open(viewer(1, "flip 0.45"));
    // Samples have errors of 0.64, 0.32, 0.16, 0.08, and a quarter of the rays 0.4: four cameras are cheaper.
    cluster.wait(20);
    assert_eq!(cluster.method(), Some("carve:2"), "{}", cluster.promise());
    let mut cluster = Cluster::of(2);
    let mut only_direct = viewer(1, "flip 0.15");
    only_direct.budgeted.as_mut().unwrap().rows.drain(..4);
    cluster.open(only_direct);
    cluster.wait(20);
    let assignment = &cluster.plan().assignment;
    assert_eq!((assignment.policy, assignment.workload.lighting.as_str()), (Policy::Direct, "quarter"));
    assert_eq!(assignment.audit.as_ref().map(|order| order.truth_lighting.as_str()), Some(LIGHTING));
    assert!(cluster.audit([0.5; 20]).is_some(), "{}", cluster.promise());
    let assignment = &cluster.plan().assignment;
    assert_eq!((assignment.policy, assignment.workload.lighting.as_str()), (Policy::Direct, LIGHTING));
    assert_eq!(assignment.audit, None, "views with all rays have no error");
    assert_eq!(cluster.promise().state, PromiseState::Kept);
}

#[test]
fn a_budget_that_nothing_keeps_is_unreachable() {
    let mut cluster = Cluster::of(2);
    let mut opening = viewer(1, "flip 0.01");
    opening.budgeted.as_mut().unwrap().rows.truncate(4);
    cluster.open(opening);
    cluster.wait(20);
    let promise = cluster.promise();
    assert_eq!(promise.state, PromiseState::Unreachable, "{promise}");
    assert!(
        promise.reason.contains("carve:8") && promise.reason.contains("comes nearest with FLIP 0.0200"),
        "{promise}"
    );
    assert_eq!(cluster.method(), None, "what was asked for stays");
}

#[test]
fn a_replayed_log_gives_the_same_commands() {
    let mut cluster = kept("flip 0.06");
    cluster.audit([0.2; 20]);
    let mut text = Vec::new();
    let mut recorder = Recorder::new(&mut text).unwrap();
    cluster.log.iter().for_each(|(now, event)| recorder.record(*now, event).unwrap());
    let replayed: Vec<Command> = replay(&text[..]).unwrap().into_iter().flat_map(|step| step.commands).collect();
    assert_eq!(replayed, cluster.commands);
}

#[test]
fn a_node_that_is_lost_while_it_measures_is_replaced_and_a_row_that_fails_is_not_chosen() {
    let mut cluster = Cluster::of(2);
    cluster.is_slow = true;
    cluster.open(viewer(1, "flip 0.06"));
    let first = cluster.probes[0].clone();
    cluster.tell(Event::ProbeFailed { workload_number: 1, id: first.id, is_lost: true });
    assert_eq!(cluster.probes.len(), 1, "after a pause");
    cluster.is_slow = false;
    cluster.wait(20);
    assert_eq!((cluster.probes[1].id, cluster.probes[1].request == first.request), (first.id, true));
    assert_eq!(cluster.method(), Some("carve:4"), "{}", cluster.promise());

    let mut cluster = Cluster::of(2);
    cluster.is_slow = true;
    cluster.open(viewer(1, "flip 0.06"));
    for _ in 0..60 {
        let probe = cluster.probes.last().unwrap().clone();
        let workload_number = probe.workload_number;
        let event = match probe.request.method.as_str() {
            "carve:4" => Event::ProbeFailed { workload_number, id: probe.id, is_lost: false },
            _ => cluster.answer(&probe),
        };
        cluster.tell(event);
        cluster.wait(1);
    }
    assert_eq!(cluster.method(), Some("carve:8"), "{}", cluster.promise());
}

#[test]
fn measuring_takes_a_fifth_of_one_nodes_time_while_anybody_is_served() {
    let mut cluster = Cluster::of(2);
    cluster.is_slow = true;
    cluster.open(viewer(1, "flip 0.06"));
    let plan_epoch = cluster.plan().assignment.plan_epoch;
    let costs = Default::default();
    let node_name = "n1".to_owned();
    cluster.tell(Event::Measured { node_name, plan_epoch, costs, busy_s: 0.5, views: 1, dropped_views: 0 });
    let Event::ViewsProbed { workload_number, mut probed, planes } = cluster.answer(&cluster.probes[0].clone()) else {
        panic!()
    };
    probed.busy_s = 1.0;
    cluster.tell(Event::ViewsProbed { workload_number, probed, planes });
    cluster.wait(3);
    assert_eq!(cluster.probes.len(), 1, "a second of measuring is followed by four of others' work");
    cluster.wait(2);
    assert_eq!(cluster.probes.len(), 2);
}

#[test]
fn a_client_that_leaves_ends_its_plan() {
    let mut cluster = Cluster::of(2);
    cluster.is_slow = true;
    cluster.open(viewer(1, "flip 0.06"));
    let answer = cluster.answer(&cluster.probes[0].clone());
    cluster.tell(Event::Closed { session: 1 });
    cluster.tell(answer);
    cluster.wait(20);
    assert_eq!((cluster.probes.len(), cluster.scheduler.status().workloads.len()), (1, 0));
}

#[test]
fn audits_within_the_budget_break_no_promise_and_their_figures_are_shown() {
    let mut cluster = kept("flip 0.06");
    assert_eq!(cluster.audit((0..400).map(|place| if place % 2 == 0 { 0.09 } else { 0.005 })), None);
    let promise = cluster.promise();
    let summary = promise.audit.unwrap();
    assert!(summary.audited_views == 400 && summary.uncovered_ratio() > 0.08, "{summary:?}");
    let error = summary.error.unwrap();
    assert!(error.low <= 0.0475 && error.high >= 0.0475 && (error.mean - 0.0475).abs() < 1e-6, "{error:?}");
    assert!(promise.reason.contains("Audits found FLIP 0.0475 ("), "{promise}");
}

#[test]
fn an_error_that_grows_threefold_is_reported_and_the_row_replaced_within_20_audited_views() {
    let mut cluster = kept("flip 0.06");
    assert_eq!(cluster.audit([0.04; 60]), None, "a minute of what was promised");
    cluster.is_slow = true;
    let broken = cluster.audit([0.12; 20]).expect("it is found");
    assert!(broken <= 20, "{broken}");
    let reported = cluster.promises.iter().find(|promise| promise.state == PromiseState::Broken).unwrap();
    assert!(reported.reason.contains("Audits found FLIP 0.0"), "{reported}");
    assert_eq!(cluster.promise().state, PromiseState::Kept, "{}", cluster.promise());
    assert_eq!(cluster.method(), Some("carve:8"), "the next safer row that was tested");
    assert!(cluster.promise().reason.contains("took its place. Audits found"), "{}", cluster.promise());
}

#[test]
fn each_broken_promise_brings_a_safer_row_and_at_last_direct_drawing() {
    let mut cluster = kept("flip 0.06");
    assert!(cluster.audit([0.4; 5]).is_some());
    assert_eq!(cluster.method(), Some("carve:8"));
    assert!(cluster.audit([0.4; 5]).is_some());
    assert_eq!(cluster.plan().assignment.policy, Policy::Direct, "{}", cluster.promise());
    let probes = cluster.probes.len();
    cluster.wait(120);
    assert_eq!((cluster.probes.len(), cluster.promise().state), (probes, PromiseState::Kept));
}

#[test]
fn a_broken_promise_that_nothing_can_keep_stays_broken() {
    let mut cluster = Cluster::of(2);
    let mut opening = viewer(1, "flip 0.03");
    opening.budgeted.as_mut().unwrap().rows.truncate(4);
    cluster.open(opening);
    cluster.wait(20);
    assert_eq!(cluster.method(), Some("carve:8"));
    assert!(cluster.audit([0.4; 5]).is_some());
    let promise = cluster.promise();
    assert_eq!(promise.state, PromiseState::Broken);
    assert!(promise.reason.contains("Nothing safer is known"), "{promise}");
}
