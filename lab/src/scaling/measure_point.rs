//! The measurement of one point.
//!
//! T is the time between two sets in the steady state, at the client. It starts when the last view of set 0 is decoded
//! and checksummed, and ends when the same holds of the last set that counts; the number of sets between divides it.
//! Set 0 fills the pipeline. The client asks for all sets at once, in order. Where samples are shared, more sets
//! follow, so that the last set that counts is sampled ahead as all others are.

use std::time::Instant;

use app_core::delivery::{open, requests};
use client::{Frame, Session, ViewRequest};
use cluster::{Policy, SessionRequest};
use codec::FrameHeader;
use depth_image::PinholeCamera;

use super::fetched::fetch;
use super::machine::MachineTime;
use super::point::{Point, PointSettings, Steps, Window};
use super::processes::NodeProcesses;
use super::subject::Subject;

/// Frames that have arrived.
struct Arrivals {
    start: Instant,
    /// Views of each set that are still missing, and the arrival of the last one.
    sets: Vec<(usize, f64)>,
    frames: usize,
    /// Sums over frames.
    steps: Steps,
}

impl Arrivals {
    fn new(settings: &PointSettings) -> Self {
        let sets = vec![(settings.views, 0.0); settings.sets() as usize];
        Self { start: Instant::now(), sets, frames: 0, steps: Steps::default() }
    }

    /// Notes a frame; true where it completes its set.
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

    /// Times of the steps of one set of `views` views.
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

/// Measures one point, and calls `arrived` for every frame.
pub async fn measure(
    processes: &NodeProcesses,
    subject: &Subject,
    settings: PointSettings,
    arrived: impl FnMut(),
) -> anyhow::Result<Point> {
    let views = subject.views(settings.views)?;
    let request = SessionRequest {
        forced_tile_count: settings.forced_tiles(),
        ..subject.request(&views, settings.lighting, settings.policy, settings.sets())?
    };
    let session = open(&processes.client, request).await?;
    let plan = session.plan();
    let before = processes.counters().await?;
    let (arrivals, window) = receive(processes, &session, &views, &settings, arrived).await?;
    let counted = processes.counters().await?.since(&before);
    let fetched = match plan.assignment.policy {
        // Nodes that have a later plan refuse: other points of the lighting show the transfer.
        Policy::Pipeline => fetch(&plan.assignment, settings.counted_sets).await.ok(),
        _ => None,
    };
    let later_plans = session.plan().assignment.plan_epoch.saturating_sub(plan.assignment.plan_epoch);
    let (first_s, sets) = (arrivals.complete_s(0), f64::from(settings.counted_sets));
    let steps = Steps {
        sample_s: counted.image_s / counted.images.max(1.0) * subject.images() as f64,
        client_s: window.machine.client_s / sets,
        ..arrivals.steps_of(settings.views)
    };
    let period_s = (arrivals.complete_s(settings.counted_sets) - first_s) / sets;
    Ok(Point {
        settings,
        nodes: processes.nodes(),
        plan,
        later_plans,
        period_s,
        fill_s: first_s,
        steps,
        window,
        fetched,
    })
}

async fn receive(
    processes: &NodeProcesses,
    session: &Session,
    views: &[PinholeCamera],
    settings: &PointSettings,
    mut arrived: impl FnMut(),
) -> anyhow::Result<(Arrivals, Window)> {
    // One request for all views: several streams would take turns.
    let mut frames = session.render_views(requests(settings.sets(), views.into()))?;
    let (mut arrivals, mut begun) = (Arrivals::new(settings), None);
    while let Some(frame) = frames.next().await {
        let Frame { request: ViewRequest { set_index: set, .. }, header, .. } = frame?;
        let complete = arrivals.note(set, Instant::now(), &header);
        arrived();
        if complete && set == 0 {
            begun = Some((Instant::now(), processes.usage()?, MachineTime::now()));
        }
        if let (true, Some((since, nodes, machine))) = (complete && set == settings.counted_sets, &begun) {
            let window = Window {
                seconds: since.elapsed().as_secs_f64(),
                nodes: processes.usage()?.iter().zip(nodes).map(|(now, then)| now.since(then)).collect(),
                quota_cores: processes.quota_cores(),
                machine: MachineTime::now().since(machine),
            };
            return Ok((arrivals, window));
        }
    }
    anyhow::bail!("the stream of views ended before their sets")
}
