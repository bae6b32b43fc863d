//! A cluster with budgets for tests: its nodes answer every probe at once.

use std::collections::VecDeque;
use std::time::Duration;

use cluster::{Costs, PolicyChoice, Promise, SamplePlanes, SessionPlan};
use depth_image::{Camera, PinholeCamera};
use glam::{UVec2, Vec3};
use planner::{Event as PlannerEvent, Kept, Probed, Row, RowCosts, Timed, ViewErrors};

use super::test_support::{COSTS, join, opening};
use super::{Budgeted, Command, Event, Opening, Recorder, Scheduler, ViewProbe};

/// FLIP of a row of S cameras: 0.16 / S.
pub(super) fn errors(row: &Row) -> ViewErrors {
    let flip = 0.16 / f64::from(row.camera_count);
    ViewErrors { foreground_ratio: 0.5, flip, flip_whole: flip / 2.0, mean_square: flip / 10.0, disoccluded_ratio: 0.0 }
}

pub(super) fn rows() -> Vec<Row> {
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
pub(super) fn rig() -> Vec<Camera> {
    let camera = |x: f32, y: f32| {
        let eye = Vec3::new(x, y, 3.0);
        Camera::Pinhole(PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.8, UVec2::splat(64)))
    };
    vec![camera(-0.5, -0.5), camera(0.5, -0.5), camera(-0.5, 0.5), camera(0.5, 0.5)]
}

pub(super) fn budgeted(budget: &str) -> Budgeted {
    let view = *rig()[0].reference();
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
pub(super) fn viewer(session: u64, budget: &str) -> Opening {
    let mut opening = opening(session, PolicyChoice::Pipeline, 1);
    opening.workload.sample_cameras = rig().into_iter().map(Into::into).collect();
    opening.frames_per_s = Some(10.0);
    opening.budgeted = Some(budgeted(budget));
    opening
}

/// A cluster whose nodes answer every probe with the errors of its row.
pub(super) struct Cluster {
    pub(super) scheduler: Scheduler,
    pub(super) log: Vec<(Duration, Event)>,
    pub(super) now: Duration,
    pub(super) commands: Vec<Command>,
    pub(super) probes: Vec<ViewProbe>,
    pub(super) promises: Vec<(Vec<u64>, Promise)>,
    pub(super) plans: Vec<SessionPlan>,
    pub(super) kept: Option<Kept>,
    pub(super) error_scale: f64,
    pub(super) busy_s: f64,
    /// Probes are answered one by one.
    pub(super) is_slow: bool,
    /// Nodes never take a plan.
    pub(super) is_unapplied: bool,
    /// The method of a row whose costs cannot be measured.
    pub(super) refused: Option<String>,
}

impl Cluster {
    pub(super) fn of(nodes: usize) -> Self {
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
            refused: None,
        };
        (0..nodes).for_each(|number| cluster.tell(join(&format!("n{number}"), number as u64 + 1, 0)));
        cluster
    }

    /// Takes an event, and all answers that follow from it.
    pub(super) fn tell(&mut self, event: Event) {
        let mut events = VecDeque::from([event]);
        while let Some(event) = events.pop_front() {
            self.log.push((self.now, event.clone()));
            let commands = self.scheduler.step(self.now, event);
            self.commands.extend(commands.clone());
            events.extend(commands.into_iter().filter_map(|command| self.execute(command)));
        }
    }

    pub(super) fn execute(&mut self, command: Command) -> Option<Event> {
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
            Command::Represent { workload_number, choice, measurement }
                if self.refused == Some(measurement.method.clone()) =>
            {
                return Some(Event::Unrepresented { workload_number, choice, reason: "out of memory".to_owned() });
            }
            Command::Represent { workload_number, choice, measurement } => {
                let images = measurement.workload.sample_cameras.len() as f64;
                let costs = Costs { reconstruct_view_s: COSTS.reconstruct_view_s * images, ..COSTS };
                let planes = SamplePlanes { normals: true, ..SamplePlanes::default() };
                return Some(Event::Represented { workload_number, choice, costs, planes });
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

    pub(super) fn answer(&self, probe: &ViewProbe) -> PlannerEvent {
        let costs = |row: usize| {
            let cameras = f64::from(rows()[row].camera_count);
            RowCosts { sample_image_s: 0.01, load_set_s: 0.001 * cameras, reconstruct_view_s: 0.001 * cameras }
        };
        let id = probe.id;
        let busy_s = self.busy_s;
        if probe.views.is_empty() {
            let rows = probe.requests.iter().map(|(row, _)| (*row, costs(*row))).collect();
            return PlannerEvent::Timed(Timed { id, rows, busy_s });
        }
        let (row, request) = &probe.requests[0];
        assert_eq!(request.typical_views.len(), probe.views.len());
        let of = errors(&rows()[*row]);
        let of = ViewErrors { flip: of.flip * self.error_scale, ..of };
        let views = probe.views.iter().map(|view| (*view, of)).collect();
        PlannerEvent::Probed(Probed { id, row: *row, views, costs: costs(*row), busy_s })
    }

    pub(super) fn open(&mut self, opening: Opening) {
        self.tell(Event::Opened(Box::new(opening)));
    }

    pub(super) fn answer_one(&mut self) {
        let probe = self.probes.last().unwrap().clone();
        let event = self.answer(&probe);
        self.tell(planned(probe.workload_number, event));
    }

    pub(super) fn wait(&mut self, seconds: u64) {
        self.wait_ticks(seconds * 4);
    }

    pub(super) fn wait_ticks(&mut self, ticks: u64) {
        for _ in 0..ticks {
            self.now += Duration::from_millis(250);
            self.tell(Event::Tick);
        }
    }

    pub(super) fn promise(&self) -> &Promise {
        &self.promises.last().unwrap().1
    }

    /// The last promise to a session.
    pub(super) fn promise_to(&self, session: u64) -> &Promise {
        let to = self.promises.iter().rev().find(|(sessions, _)| sessions.contains(&session));
        &to.unwrap().1
    }

    pub(super) fn plan(&self) -> &SessionPlan {
        self.plans.last().unwrap()
    }
}

pub(super) fn recorded(log: &[(Duration, Event)]) -> Vec<u8> {
    let mut text = Vec::new();
    let mut recorder = Recorder::new(&mut text).unwrap();
    log.iter().for_each(|(now, event)| recorder.record(*now, event).unwrap());
    text
}

pub(super) fn planned(workload_number: u64, event: PlannerEvent) -> Event {
    Event::Planned { workload_number, event: Box::new(event) }
}
