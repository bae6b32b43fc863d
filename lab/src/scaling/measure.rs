//! The measurement of all points, from the start of the processes to their end.

use std::path::PathBuf;
use std::time::Instant;

use app_core::process::stop_signal;
use app_core::progress::bar;
use cluster::Costs;
use gpu::DevicePreference;
use indicatif::ProgressBar;
use render::Lighting;

use super::costs;
use super::matrix::{Extent, Planned, planned};
use super::measure_point::measure;
use super::measured::{Measured, MeasuredLighting, Timed};
use super::point::{Point, PointSettings};
use super::processes::NodeProcesses;
use super::subject::{MEASURED_BATCH, Subject};

/// Attempts at a point whose plan changes while it is measured; the last one counts.
const ATTEMPTS: u32 = 2;

/// Cores for the client, the coordinator and the kernel's part in their traffic.
const CLIENT_CORES: f64 = 0.35;

/// A measurement to make.
#[derive(Debug, Clone)]
pub struct Request {
    pub device: DevicePreference,
    pub extent: Extent,
    /// Cores of a node; by default as many as fit this machine.
    pub quota_cores: Option<f64>,
    pub lighting: Lighting,
    pub expensive_lighting: Option<Lighting>,
    pub event_log: PathBuf,
}

/// Cores of each of `nodes` nodes, which share all cores but the client's.
#[must_use]
pub fn default_quota(nodes: usize) -> f64 {
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
    // The kernel takes thousandths.
    ((cores - CLIENT_CORES).max(0.5 * cores) / nodes as f64 * 1000.0).floor() / 1000.0
}

/// Measures everything. All processes end and their groups are removed on every way out, a signal included.
///
/// # Errors
/// Processes or groups are not to be had, a point cannot be measured, or a signal came.
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
    let mut processes = NodeProcesses::start(&subject.args, request.device, nodes, &request.event_log).await?;
    let device =
        processes.client.status().await?.nodes.first().map_or_else(String::new, |node| node.device_name.clone());
    println!("{nodes} nodes of {quota_cores:.3} cores each on {device}");
    let unlimited = warm(&processes, subject, request.lighting).await?;
    println!("all are ready after {:.0} s", start.elapsed().as_secs_f64());
    processes.limit(Some(quota_cores))?;
    processes.rest().await?;
    let lightings = [request.lighting].into_iter().chain(request.expensive_lighting);
    let mut lit: Vec<MeasuredLighting> =
        lightings.map(|lighting| MeasuredLighting { lighting, timed: Vec::new(), points: Vec::new() }).collect();
    points(&mut processes, subject, request.extent, &mut lit).await?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
    let (images, seconds) = (subject.images(), start.elapsed().as_secs_f64());
    Ok(Measured { device, cores, quota_cores, images, unlimited, lit, seconds })
}

/// Lets every node do all kinds of work once, alone and without a limit. Shaders are then built, the scene is loaded,
/// and rays and triangles are timed undisturbed.
async fn warm(processes: &NodeProcesses, subject: &Subject, lighting: Lighting) -> anyhow::Result<Vec<Costs>> {
    let progress = bar("nodes load the scene and build shaders", processes.nodes());
    let request = subject.measurement(lighting, subject.views(MEASURED_BATCH as usize)?, MEASURED_BATCH);
    let unlimited = processes.measure_in_turn(&request, || progress.inc(1)).await;
    progress.finish_and_clear();
    unlimited
}

/// Times the costs of all lightings that have points at this number of nodes.
async fn time(
    processes: &NodeProcesses,
    subject: &Subject,
    extent: Extent,
    lit: &mut [MeasuredLighting],
) -> anyhow::Result<()> {
    let (nodes, start) = (processes.nodes(), Instant::now());
    let with_points =
        lit.iter_mut().enumerate().filter(|(which, _)| !extent.points(nodes, is_expensive(*which)).is_empty());
    for (_, lit) in with_points {
        if lit.timed.last().is_none_or(|timed| timed.nodes != nodes) {
            let alone = costs::measure(processes, subject, lit.lighting, 1).await?;
            lit.timed.push(Timed { nodes, alone, ..Timed::default() });
        }
        let costs = costs::measure(processes, subject, lit.lighting, MEASURED_BATCH).await?;
        lit.timed.iter_mut().last().into_iter().for_each(|timed| timed.costs.extend(&costs));
    }
    println!("{nodes} nodes have timed their work in {:.0} s", start.elapsed().as_secs_f64());
    processes.rest().await
}

async fn points(
    processes: &mut NodeProcesses,
    subject: &Subject,
    extent: Extent,
    lit: &mut [MeasuredLighting],
) -> anyhow::Result<()> {
    time(processes, subject, extent, lit).await?;
    let all = all_points(subject, extent, lit);
    let about_s: f64 = all.iter().map(|(_, point)| point.about_s).sum();
    println!("{} points, about {:.0} minutes", all.len(), (about_s / 60.0).ceil());
    let progress = bar("", about_s.ceil() as usize);
    let mut done_s = 0.0;
    for (which, Planned { settings, nodes, about_s }) in all {
        if nodes < processes.nodes() {
            time(processes, subject, extent, lit).await?;
            processes.shrink_to(nodes).await?;
            time(processes, subject, extent, lit).await?;
        }
        progress.set_message(format!("P = {nodes}, V = {}, {}", settings.views, settings.policy));
        let point = point(processes, subject, settings, done_s, about_s, &progress).await?;
        progress.suspend(|| println!("{}", in_words(&point)));
        lit[which].points.push(point);
        done_s += about_s;
        progress.set_position(done_s as u64);
        processes.rest().await?;
    }
    progress.finish_and_clear();
    time(processes, subject, extent, lit).await
}

fn in_words(point: &Point) -> String {
    let (Point { settings, nodes, period_s, fill_s, later_plans, .. }, policy) = (point, point.policy());
    let (counted, others) = (settings.counted_sets, point.window.others_cores());
    format!(
        "P = {nodes}, V = {}, {}: {policy}, T = {period_s:.3} s by {counted} sets after {fill_s:.2} s; changes of plan: \
         {later_plans}; {others:.2} cores for other programs",
        settings.views, settings.policy
    )
}

/// All lightings but the first, the paper's, are expensive.
fn is_expensive(which: usize) -> bool {
    which > 0
}

/// All lightings at one number of nodes come before the next: nodes are only ever ended.
fn all_points(subject: &Subject, extent: Extent, lit: &[MeasuredLighting]) -> Vec<(usize, Planned)> {
    let of = |nodes: usize| {
        lit.iter().enumerate().flat_map(move |(which, lit)| {
            let points = extent.points(nodes, is_expensive(which));
            let (costs, images) = (lit.timed.first().map_or_else(Costs::default, Timed::mean), subject.images());
            points.into_iter().map(move |point| (which, planned(extent, &costs, images, nodes, lit.lighting, point)))
        })
    };
    extent.node_counts().into_iter().flat_map(of).collect()
}

async fn point(
    processes: &NodeProcesses,
    subject: &Subject,
    settings: PointSettings,
    done_s: f64,
    about_s: f64,
    progress: &ProgressBar,
) -> anyhow::Result<Point> {
    let frames = settings.awaited_views().max(1) as f64;
    for attempt in 1.. {
        let mut arrived = 0.0;
        let point = measure(processes, subject, settings, || {
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
    fn the_default_quota_leaves_cores_for_the_client() {
        let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
        assert!(default_quota(11) * 11.0 < cores && default_quota(11) * 11.0 > 0.4 * cores);
    }
}
