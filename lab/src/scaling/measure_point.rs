//! The measurement of one point.
//!
//! T is the time between two sets in the steady state, at the client. It starts when the last view of set 0 is decoded
//! and checksummed, and ends when the same holds of the last set that counts; the number of sets between divides it.
//! Set 0 fills the pipeline. The client asks for all sets at once, in order. Where samples are shared, more sets
//! follow, so that the last set that counts is sampled ahead as all others are.

use std::time::Instant;

use app_core::delivery::{open, requests};
use client::{Frame, Session, ViewRequest};
use cluster::Policy;
use depth_image::PinholeCamera;

use super::fetched::fetch;
use super::machine::MachineTime;
use super::nodes::Nodes;
use super::point::{Point, PointSettings, Window};
use super::subject::Subject;

/// Frames that have arrived.
struct Arrivals {
    start: Instant,
    /// Views of each set that are still missing, and the arrival of the last one.
    sets: Vec<(usize, f64)>,
    frames: usize,
    bytes: u64,
}

impl Arrivals {
    fn new(settings: &PointSettings) -> Self {
        let sets = vec![(settings.views, 0.0); settings.sets() as usize];
        Self { start: Instant::now(), sets, frames: 0, bytes: 0 }
    }

    /// Records a frame; true where it completes its set.
    fn record(&mut self, set: u32, bytes: u64) -> bool {
        self.frames += 1;
        self.bytes += bytes;
        let Some((due, last_s)) = self.sets.get_mut(set as usize) else { return false };
        *due = due.saturating_sub(1);
        *last_s = self.start.elapsed().as_secs_f64();
        *due == 0
    }

    fn complete_s(&self, set: u32) -> f64 {
        self.sets.get(set as usize).map_or(f64::NAN, |(_, last_s)| *last_s)
    }
}

/// Measures one point, and calls `arrived` for every frame.
pub async fn measure(
    nodes: &Nodes,
    subject: &Subject,
    settings: PointSettings,
    arrived: impl FnMut(),
) -> anyhow::Result<Point> {
    let views = subject.views(settings.views)?;
    let request = subject.request(&views, settings.policy, settings.sets())?;
    let session = open(&nodes.client, request).await?;
    let plan = session.plan();
    let (arrivals, window) = receive(nodes, &session, &views, &settings, arrived).await?;
    let fetched = match plan.assignment.policy {
        // Nodes that have a later plan refuse: other points show the transfer.
        Policy::Pipeline => fetch(&plan.assignment, settings.counted_sets).await.ok(),
        _ => None,
    };
    let later_plans = session.plan().assignment.plan_epoch.saturating_sub(plan.assignment.plan_epoch);
    let fill_s = arrivals.complete_s(0);
    Ok(Point {
        settings,
        nodes: nodes.count(),
        plan,
        later_plans,
        period_s: (arrivals.complete_s(settings.counted_sets) - fill_s) / f64::from(settings.counted_sets),
        fill_s,
        frame_bytes: arrivals.bytes as f64 / arrivals.frames.max(1) as f64,
        window,
        fetched,
    })
}

async fn receive(
    nodes: &Nodes,
    session: &Session,
    views: &[PinholeCamera],
    settings: &PointSettings,
    mut arrived: impl FnMut(),
) -> anyhow::Result<(Arrivals, Window)> {
    // One request for all views: several streams would take turns.
    let mut frames = session.render_views(requests(settings.sets(), views.into()))?;
    let mut arrivals = Arrivals::new(settings);
    let mut begun = None;
    while let Some(frame) = frames.next().await {
        let Frame { request: ViewRequest { set_index: set, .. }, header, .. } = frame?;
        let is_complete = arrivals.record(set, header.total_bytes());
        arrived();
        if is_complete && set == 0 {
            begun = Some((Instant::now(), nodes.used_s()?, MachineTime::now()));
        }
        if let (true, Some((since, used_s, machine))) = (is_complete && set == settings.counted_sets, &begun) {
            let seconds = since.elapsed().as_secs_f64();
            let window = Window {
                seconds,
                nodes_s: nodes.used_s()?.iter().zip(used_s).map(|(now_s, then_s)| now_s - then_s).sum(),
                quotas_s: nodes.quota_cores * nodes.count() as f64 * seconds,
                machine: MachineTime::now().since(machine),
            };
            return Ok((arrivals, window));
        }
    }
    anyhow::bail!("the stream of views ended before their sets")
}
