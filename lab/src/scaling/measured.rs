//! The measuring itself: from no process at all to every point, and back to none.

use std::path::PathBuf;
use std::time::Instant;

use app_core::process::stop_signal;
use cluster::Costs;
use gpu::DevicePreference;
use indicatif::ProgressBar;
use render::Lighting;
use simulation::Calls;

use super::costs;
use super::fleet::Fleet;
use super::matrix::{Extent, Planned, planned};
use super::point::{Ask, Point, measure};
use super::subject::{MEASURED_BATCH, Subject};
use crate::progress::bar;

/// Of a point whose plan changes while it is measured: the last counts, whatever its plan did.
const ATTEMPTS: u32 = 2;

/// Cores that the client, the coordinator and the kernel's part in their traffic need beside the nodes'.
const CLIENT_CORES: f64 = 0.35;

/// What is to be measured.
#[derive(Debug, Clone)]
pub struct Request {
    /// Which device nodes open.
    pub device: DevicePreference,
    /// How much.
    pub extent: Extent,
    /// Cores a node; as many as fit this machine without it.
    pub quota_cores: Option<f64>,
    /// Whose points are the paper's.
    pub lighting: Lighting,
    /// A second table's.
    pub dear_lighting: Option<Lighting>,
    /// Where all that happens to the schedule is written.
    pub event_log: PathBuf,
}

/// What P nodes timed at the same time, each with its quota, before the points and after them.
#[derive(Debug, Clone, Default)]
pub struct Timed {
    /// P.
    pub nodes: usize,
    /// Of every node, as often as it was asked.
    pub costs: Vec<Costs>,
    /// The same with one view a call.
    pub alone: Vec<Costs>,
}

/// One lighting's costs and points.
#[derive(Debug, Clone)]
pub struct Lit {
    /// Which.
    pub lighting: Lighting,
    /// By P, falling.
    pub timed: Vec<Timed>,
    /// In the order they were measured.
    pub points: Vec<Point>,
}

/// All that was measured.
#[derive(Debug, Clone)]
pub struct Measured {
    /// As nodes name it.
    pub device: String,
    /// Of this machine.
    pub cores: f64,
    /// Cores a node.
    pub quota_cores: f64,
    /// S.
    pub images: usize,
    /// One node's costs without a limit: on all cores, the others at rest; one after the other.
    pub unlimited: Vec<Costs>,
    /// The paper's lighting, then the dear one.
    pub lit: Vec<Lit>,
    /// Of all of it.
    pub seconds: f64,
}

impl Lit {
    /// The mean of what so many nodes timed; zeros where they did not.
    #[must_use]
    pub fn mean(&self, nodes: usize) -> Costs {
        self.timed.iter().find(|timed| timed.nodes == nodes).map_or_else(Costs::default, Timed::mean)
    }
}

impl Timed {
    /// Of all nodes and times.
    #[must_use]
    pub fn mean(&self) -> Costs {
        costs::mean(&self.costs)
    }

    /// What a call to the device takes, and each view of it: both follow from calls of one view and of many.
    #[must_use]
    pub fn by_view_and_call(&self) -> (Costs, Calls) {
        let (costs, alone) = (self.mean(), costs::mean(&self.alone));
        let split = |alone_s: f64, of_many_s: f64| {
            let many = f64::from(MEASURED_BATCH);
            let view_s = ((many * of_many_s - alone_s) / (many - 1.0)).clamp(0.0, of_many_s);
            (view_s, ((of_many_s - view_s) * many).max(0.0))
        };
        let (reconstruct_view_s, reconstruct_s) = split(alone.reconstruct_view_s, costs.reconstruct_view_s);
        let (direct_view_s, direct_s) = split(alone.direct_view_s, costs.direct_view_s);
        (Costs { reconstruct_view_s, direct_view_s, ..costs }, Calls { reconstruct_s, direct_s })
    }
}

/// So many nodes share all cores but the client's.
#[must_use]
pub fn default_quota(nodes: usize) -> f64 {
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
    // In thousandths, as they are written to the kernel.
    ((cores - CLIENT_CORES).max(0.5 * cores) / nodes as f64 * 1000.0).floor() / 1000.0
}

/// Measures everything. Ends all processes and removes their groups whatever happens, a signal included.
///
/// # Errors
/// Where processes or groups cannot be had, a point cannot be measured, or a signal came.
pub async fn take(request: &Request, subject: &Subject) -> anyhow::Result<Measured> {
    tokio::select! {
        measured = take_undisturbed(request, subject) => measured,
        signal = stop_signal() => {
            signal?;
            anyhow::bail!("stopped by a signal")
        }
    }
}

async fn take_undisturbed(request: &Request, subject: &Subject) -> anyhow::Result<Measured> {
    let start = Instant::now();
    let nodes = request.extent.nodes;
    let quota_cores = request.quota_cores.unwrap_or_else(|| default_quota(nodes));
    let mut fleet = Fleet::start(&subject.args, request.device, nodes, &request.event_log).await?;
    let device = fleet.client.status().await?.nodes.first().map_or_else(String::new, |node| node.device_name.clone());
    println!("{nodes} nodes of {quota_cores:.3} cores each on {device}");
    let unlimited = warm(&fleet, subject, request.lighting).await?;
    println!("all are ready after {:.0} s", start.elapsed().as_secs_f64());
    fleet.limit(Some(quota_cores))?;
    fleet.rest().await?;
    let lightings = [request.lighting].into_iter().chain(request.dear_lighting);
    let mut lit: Vec<Lit> = lightings.map(|lighting| Lit { lighting, timed: Vec::new(), points: Vec::new() }).collect();
    points(&mut fleet, subject, request.extent, &mut lit).await?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
    let (images, seconds) = (subject.images(), start.elapsed().as_secs_f64());
    Ok(Measured { device, cores, quota_cores, images, unlimited, lit, seconds })
}

/// Every node once does all kinds of work, alone and without a limit: shaders are built, the scene is there, and
/// whether rays or triangles are faster is found out undisturbed.
async fn warm(fleet: &Fleet, subject: &Subject, lighting: Lighting) -> anyhow::Result<Vec<Costs>> {
    let progress = bar("nodes load the scene and build shaders", fleet.nodes());
    let request = subject.measurement(lighting, subject.views(MEASURED_BATCH as usize)?, MEASURED_BATCH);
    let unlimited = fleet.measure_in_turn(&request, || progress.inc(1)).await;
    progress.finish_and_clear();
    unlimited
}

/// Costs of all lightings that are measured at as many nodes as there are.
async fn time(fleet: &Fleet, subject: &Subject, extent: Extent, lit: &mut [Lit]) -> anyhow::Result<()> {
    let (nodes, start) = (fleet.nodes(), Instant::now());
    let with_points = lit.iter_mut().enumerate().filter(|(which, _)| !extent.points(nodes, is_dear(*which)).is_empty());
    for (_, lit) in with_points {
        if lit.timed.last().is_none_or(|timed| timed.nodes != nodes) {
            let alone = costs::measure(fleet, subject, lit.lighting, 1).await?;
            lit.timed.push(Timed { nodes, alone, ..Timed::default() });
        }
        let costs = costs::measure(fleet, subject, lit.lighting, MEASURED_BATCH).await?;
        lit.timed.iter_mut().last().into_iter().for_each(|timed| timed.costs.extend(&costs));
    }
    println!("{nodes} nodes have timed their work in {:.0} s", start.elapsed().as_secs_f64());
    fleet.rest().await
}

async fn points(fleet: &mut Fleet, subject: &Subject, extent: Extent, lit: &mut [Lit]) -> anyhow::Result<()> {
    time(fleet, subject, extent, lit).await?;
    let all = all_points(subject, extent, lit);
    let about_s: f64 = all.iter().map(|(_, point)| point.about_s).sum();
    println!("{} points, about {:.0} minutes", all.len(), (about_s / 60.0).ceil());
    let progress = bar("", about_s.ceil() as usize);
    let mut done_s = 0.0;
    for (which, Planned { ask, nodes, about_s }) in all {
        if nodes < fleet.nodes() {
            time(fleet, subject, extent, lit).await?;
            fleet.shrink_to(nodes).await?;
            time(fleet, subject, extent, lit).await?;
        }
        progress.set_message(format!("P = {nodes}, V = {}, {}", ask.views, ask.policy));
        let point = point(fleet, subject, ask, done_s, about_s, &progress).await?;
        progress.suspend(|| println!("{}", in_words(&point)));
        lit[which].points.push(point);
        done_s += about_s;
        progress.set_position(done_s as u64);
        fleet.rest().await?;
    }
    progress.finish_and_clear();
    time(fleet, subject, extent, lit).await
}

fn in_words(point: &Point) -> String {
    let (Point { ask, nodes, period_s, fill_s, later_plans, .. }, policy) = (point, point.policy());
    let (counted, others) = (ask.counted_sets, point.window.others_cores());
    format!(
        "P = {nodes}, V = {}, {}: {policy}, T = {period_s:.3} s by {counted} sets after {fill_s:.2} s; changes of plan: \
         {later_plans}; {others:.2} cores for other programs",
        ask.views, ask.policy
    )
}

/// The first lighting is the paper's.
fn is_dear(which: usize) -> bool {
    which > 0
}

/// Nodes are only ever ended: all lightings at one P before the next.
fn all_points(subject: &Subject, extent: Extent, lit: &[Lit]) -> Vec<(usize, Planned)> {
    let of = |nodes: usize| {
        lit.iter().enumerate().flat_map(move |(which, lit)| {
            let points = extent.points(nodes, is_dear(which));
            let (costs, images) = (lit.timed.first().map_or_else(Costs::default, Timed::mean), subject.images());
            points.into_iter().map(move |point| (which, planned(extent, &costs, images, nodes, lit.lighting, point)))
        })
    };
    extent.node_counts().into_iter().flat_map(of).collect()
}

async fn point(
    fleet: &Fleet,
    subject: &Subject,
    ask: Ask,
    done_s: f64,
    about_s: f64,
    progress: &ProgressBar,
) -> anyhow::Result<Point> {
    let frames = ask.awaited_views().max(1) as f64;
    for attempt in 1.. {
        let mut arrived = 0.0;
        let point = measure(fleet, subject, ask, || {
            arrived += 1.0;
            progress.set_position((done_s + about_s * (arrived / frames).min(1.0)) as u64);
        });
        let point = point.await?;
        if point.later_plans == 0 || attempt == ATTEMPTS {
            return Ok(point);
        }
    }
    anyhow::bail!("no attempt was made")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calls_and_views_are_told_apart() {
        // 10 ms a call and 2 ms a view, drawn directly at 5 ms a view and nothing a call.
        let many = f64::from(MEASURED_BATCH);
        let of_many = Costs { reconstruct_view_s: 0.01 / many + 0.002, direct_view_s: 0.005, ..Costs::default() };
        let alone = Costs { reconstruct_view_s: 0.012, direct_view_s: 0.005, ..Costs::default() };
        let timed = Timed { nodes: 1, costs: vec![of_many], alone: vec![alone] };
        let (costs, calls) = timed.by_view_and_call();
        assert!((costs.reconstruct_view_s - 0.002).abs() < 1e-12 && (calls.reconstruct_s - 0.01).abs() < 1e-12);
        assert!((costs.direct_view_s - 0.005).abs() < 1e-12 && calls.direct_s.abs() < 1e-12);
    }

    #[test]
    fn the_default_quota_leaves_cores_for_the_client() {
        let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
        assert!(default_quota(11) * 11.0 < cores && default_quota(11) * 11.0 > 0.4 * cores);
    }
}
