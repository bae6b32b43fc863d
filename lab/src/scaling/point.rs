//! One measured point: V views of several sample sets, delivered by P nodes.
//!
//! T is the steady state's time between two sets, at the client: from the moment when the last view of set 0 was
//! received, decoded and checksummed, until the same of the last set that counts, over the sets between. Set 0 fills
//! the pipeline. The client asks for all sets at once, in their order. Where samples are shared more sets follow the last
//! that counts, so that they are sampled ahead as all before were; they are not waited for.

use std::time::Instant;

use app_core::delivery::{Wishes, open};
use client::{Frame, Session, ViewRequest};
use cluster::{Policy, PolicyChoice, SessionPlan};
use codec::FrameHeader;
use depth_image::PinholeCamera;
use render::Lighting;

use super::cpu_share::Usage;
use super::fetched::{Fetched, fetch};
use super::fleet::Fleet;
use super::machine::MachineTime;
use super::subject::Subject;

/// What is asked of the cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ask {
    /// How surfaces are lit.
    pub lighting: Lighting,
    /// Who decides.
    pub policy: PolicyChoice,
    /// V.
    pub views: usize,
    /// Whether sample images stay whole; else the schedule may cut them into tiles.
    pub whole_images: bool,
    /// Sets between which time is taken.
    pub counted_sets: u32,
}

/// Sets of a timeline that follow the last that counts: one that is being made by then, and what is sampled ahead.
const SETS_BEHIND: u32 = 2;

impl Ask {
    /// Sets that can be asked for: the first fills.
    fn sets(&self) -> u32 {
        1 + self.counted_sets + if self.policy == PolicyChoice::Direct { 0 } else { SETS_BEHIND }
    }

    /// What the session wishes.
    #[must_use]
    pub fn forced_tiles(&self) -> Option<u32> {
        self.whole_images.then_some(1)
    }

    /// Views that are waited for.
    #[must_use]
    pub fn awaited_views(&self) -> usize {
        self.views * (1 + self.counted_sets as usize)
    }
}

/// What one set takes, summed over its images and views.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Steps {
    /// On samplers' devices.
    pub sample_s: f64,
    /// On compositors' devices.
    pub reconstruct_s: f64,
    /// Encoding frames, waiting for a processor included.
    pub encode_s: f64,
    /// The client's processor time, the system's for receiving included.
    pub client_s: f64,
    /// Bytes of frames.
    pub frame_bytes: f64,
}

/// While the counted sets were made.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Window {
    /// Of the wall clock.
    pub seconds: f64,
    /// Of each node.
    pub nodes: Vec<Usage>,
    /// What each had.
    pub quota_cores: f64,
    /// Of all.
    pub machine: MachineTime,
}

/// One measured point.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// What was asked.
    pub ask: Ask,
    /// P.
    pub nodes: usize,
    /// What the coordinator decided.
    pub plan: SessionPlan,
    /// Plans that came while sets were made: each throws away what was sampled ahead.
    pub later_plans: u64,
    /// T.
    pub period_s: f64,
    /// From the request to the last view of the first set.
    pub fill_s: f64,
    /// Of one set.
    pub steps: Steps,
    /// While the counted sets were made.
    pub window: Window,
    /// What a compositor gets from a sampler, in the pipeline.
    pub fetched: Option<Fetched>,
}

impl Window {
    /// Processor time of all nodes together, in seconds of one core.
    #[must_use]
    pub fn nodes_s(&self) -> f64 {
        self.nodes.iter().map(|usage| usage.cpu_s).sum()
    }

    /// Of the processor time that all nodes had.
    #[must_use]
    pub fn used_share(&self) -> f64 {
        self.nodes_s() / (self.quota_cores * self.nodes.len() as f64 * self.seconds)
    }

    /// Cores that programs had which have nothing to do with this.
    #[must_use]
    pub fn others_cores(&self) -> f64 {
        let own_s = self.nodes_s() + self.machine.client_s;
        ((self.machine.busy_s + self.machine.stolen_s - own_s) / self.seconds).max(0.0)
    }
}

impl Point {
    /// How the views came about.
    #[must_use]
    pub fn policy(&self) -> Policy {
        self.plan.assignment.policy
    }

    /// K; 0 where nothing is sampled.
    #[must_use]
    pub fn samplers(&self) -> usize {
        self.plan.sampler_count()
    }

    /// P − K, or P where every node makes views.
    #[must_use]
    pub fn compositors(&self) -> usize {
        self.plan.assignment.compositors.len()
    }

    /// Of the periods in which nodes that make views and sample nothing had something to do, the share in which they
    /// used up their quota. Near 1 it is the quota that they wait for, and nothing else.
    #[must_use]
    pub fn throttled_share(&self) -> f64 {
        let assignment = &self.plan.assignment;
        let samples = |name: &str| assignment.samplers.iter().any(|share| share.node_name == name);
        let all_sample = assignment.compositors.iter().all(|share| samples(&share.node_name));
        let counts = |number: usize| all_sample || !samples(&Fleet::name_of(number));
        let used = self.window.nodes.iter().enumerate().filter(|(number, _)| counts(*number));
        let (periods, throttled) = used.fold((0, 0), |sum, (_, node)| (sum.0 + node.periods, sum.1 + node.throttled));
        throttled as f64 / periods as f64
    }
}

/// What came so far.
struct Arrivals {
    start: Instant,
    /// Views of each set that are still to come, and when the last of them came.
    sets: Vec<(usize, f64)>,
    frames: usize,
    /// Sums over frames.
    steps: Steps,
}

impl Arrivals {
    fn new(ask: &Ask) -> Self {
        let sets = vec![(ask.views, 0.0); ask.sets() as usize];
        Self { start: Instant::now(), sets, frames: 0, steps: Steps::default() }
    }

    /// Whether the frame completes its set.
    fn note(&mut self, set: u32, at: Instant, header: &FrameHeader) -> bool {
        self.frames += 1;
        self.steps.reconstruct_s += header.stage_times.reconstruct_s;
        self.steps.encode_s += header.stage_times.encode_s;
        self.steps.frame_bytes += header.total_bytes() as f64;
        let Some((due, last_s)) = self.sets.get_mut(set as usize) else { return false };
        *due = due.saturating_sub(1);
        *last_s = at.duration_since(self.start).as_secs_f64();
        *due == 0
    }

    fn complete_s(&self, set: u32) -> f64 {
        self.sets.get(set as usize).map_or(f64::NAN, |(_, last_s)| *last_s)
    }

    /// Of one set of so many views.
    fn steps_of(&self, views: usize) -> Steps {
        let share = views as f64 / self.frames.max(1) as f64;
        Steps {
            reconstruct_s: self.steps.reconstruct_s * share,
            encode_s: self.steps.encode_s * share,
            frame_bytes: self.steps.frame_bytes * share,
            ..Steps::default()
        }
    }
}

/// Measures one point; `arrived` hears of every frame.
///
/// # Errors
/// The cluster's.
pub async fn measure(fleet: &Fleet, subject: &Subject, ask: Ask, arrived: impl FnMut()) -> anyhow::Result<Point> {
    let views = subject.views(ask.views)?;
    let wishes = Wishes { tiles: ask.forced_tiles(), ..subject.wishes(ask.lighting, ask.policy, ask.sets()) };
    let session = open(&fleet.client, &wishes, &views).await?;
    let plan = session.plan();
    let before = fleet.counters().await?;
    let (arrivals, window) = receive(fleet, &session, &views, &ask, arrived).await?;
    let counted = fleet.counters().await?.since(&before);
    let fetched = match plan.assignment.policy {
        // Nodes that have gone on to another plan refuse: others of the lighting's points show it.
        Policy::Pipeline => fetch(&plan.assignment, ask.counted_sets).await.ok(),
        _ => None,
    };
    let later_plans = session.plan().assignment.plan_epoch.saturating_sub(plan.assignment.plan_epoch);
    let (first_s, sets) = (arrivals.complete_s(0), f64::from(ask.counted_sets));
    let steps = Steps {
        sample_s: counted.image_s / counted.images.max(1.0) * subject.images() as f64,
        client_s: window.machine.client_s / sets,
        ..arrivals.steps_of(ask.views)
    };
    let period_s = (arrivals.complete_s(ask.counted_sets) - first_s) / sets;
    Ok(Point { ask, nodes: fleet.nodes(), plan, later_plans, period_s, fill_s: first_s, steps, window, fetched })
}

async fn receive(
    fleet: &Fleet,
    session: &Session,
    views: &[PinholeCamera],
    ask: &Ask,
    mut arrived: impl FnMut(),
) -> anyhow::Result<(Arrivals, Window)> {
    let all = (0..ask.sets()).flat_map(|set_index| views.iter().map(move |camera| (set_index, *camera)));
    let request = |(frame, (set_index, camera))| ViewRequest { frame, set_index, camera };
    // One request for all: streams of their own would take turns.
    let mut frames = session.render_views((0..).zip(all).map(request).collect())?;
    let (mut arrivals, mut begun) = (Arrivals::new(ask), None);
    while let Some(frame) = frames.next().await {
        let Frame { request: ViewRequest { set_index: set, .. }, header, .. } = frame?;
        let complete = arrivals.note(set, Instant::now(), &header);
        arrived();
        if complete && set == 0 {
            begun = Some((Instant::now(), fleet.usage()?, MachineTime::now()));
        }
        if let (true, Some((since, nodes, machine))) = (complete && set == ask.counted_sets, &begun) {
            let window = Window {
                seconds: since.elapsed().as_secs_f64(),
                nodes: fleet.usage()?.iter().zip(nodes).map(|(now, then)| now.since(then)).collect(),
                quota_cores: fleet.quota_cores(),
                machine: MachineTime::now().since(machine),
            };
            return Ok((arrivals, window));
        }
    }
    anyhow::bail!("the stream of views ended before their sets")
}
