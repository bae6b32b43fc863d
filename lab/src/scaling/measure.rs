//! The measurement of all points, from the start of the processes to their end.

use std::path::PathBuf;
use std::time::Instant;

use app_core::process::StopSignals;
use app_core::progress::bar;
use cluster::Costs;
use gpu::DevicePreference;
use indicatif::ProgressBar;

use super::costs::{self, Timed};
use super::matrix::{Extent, Planned, planned};
use super::measure_point::measure;
use super::nodes::Nodes;
use super::point::{Point, PointSettings};
use super::prediction::Traffic;
use super::results::Results;
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
    pub event_log: PathBuf,
}

/// Cores of each of `nodes` nodes, which share all cores but the client's.
pub fn default_quota(nodes: usize) -> f64 {
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
    // The kernel takes thousandths.
    ((cores - CLIENT_CORES).max(0.5 * cores) / nodes as f64 * 1000.0).floor() / 1000.0
}

/// Measures everything. All processes end and their groups are removed on every way out, a signal included.
///
/// # Errors
/// Processes or groups are not to be had, a point cannot be measured, or a signal came.
pub async fn take(request: &Request, subject: &Subject) -> anyhow::Result<Results> {
    let signals = StopSignals::listen()?;
    tokio::select! {
        results = take_undisturbed(request, subject) => results,
        () = signals.first.cancelled() => anyhow::bail!("stopped by a signal"),
    }
}

async fn take_undisturbed(request: &Request, subject: &Subject) -> anyhow::Result<Results> {
    let start = Instant::now();
    let count = request.extent.nodes;
    let quota_cores = request.quota_cores.unwrap_or_else(|| default_quota(count));
    let mut nodes = Nodes::start(&subject.args, request.device, count, &request.event_log).await?;
    let device = nodes.device().to_owned();
    println!("{count} nodes of {quota_cores:.3} cores each on {device}");
    let unlimited = warm(&nodes, subject).await?;
    println!("all are ready after {:.0} s", start.elapsed().as_secs_f64());
    nodes.limit(quota_cores)?;
    nodes.rest().await?;
    let mut timed = Vec::new();
    let points = points(&mut nodes, subject, request.extent, &mut timed).await?;
    let results = Results {
        device,
        lighting: subject.args.lighting,
        cores: std::thread::available_parallelism().map_or(1, usize::from) as f64,
        quota_cores,
        images: subject.images(),
        unlimited,
        timed,
        points: Vec::new(),
        traffic: Traffic::default(),
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok(results.with_points(points))
}

/// Lets every node do all kinds of work once, alone and without a limit. Shaders are then built, the scene is loaded,
/// and rays and triangles are timed undisturbed.
async fn warm(nodes: &Nodes, subject: &Subject) -> anyhow::Result<Vec<Costs>> {
    let progress = bar("nodes load the scene and build shaders", nodes.count());
    let request = subject.measurement(subject.views(MEASURED_BATCH as usize)?, MEASURED_BATCH);
    let unlimited = nodes.measure_in_turn(&request, || progress.inc(1)).await;
    progress.finish_and_clear();
    unlimited
}

/// Times the costs at this number of nodes.
async fn time(nodes: &Nodes, subject: &Subject, timed: &mut Vec<Timed>) -> anyhow::Result<()> {
    let start = Instant::now();
    if timed.last().is_none_or(|timed| timed.nodes != nodes.count()) {
        let alone = costs::measure(nodes, subject, 1).await?;
        timed.push(Timed { nodes: nodes.count(), alone, ..Timed::default() });
    }
    let costs = costs::measure(nodes, subject, MEASURED_BATCH).await?;
    timed.iter_mut().last().into_iter().for_each(|timed| timed.costs.extend(&costs));
    println!("{} nodes have timed their work in {:.0} s", nodes.count(), start.elapsed().as_secs_f64());
    nodes.rest().await
}

async fn points(
    nodes: &mut Nodes,
    subject: &Subject,
    extent: Extent,
    timed: &mut Vec<Timed>,
) -> anyhow::Result<Vec<Point>> {
    time(nodes, subject, timed).await?;
    let costs = timed.first().map_or_else(Costs::default, Timed::mean);
    let all = all_points(extent, &costs, subject.images());
    let about_s: f64 = all.iter().map(|point| point.about_s).sum();
    println!("{} points, about {:.0} minutes", all.len(), (about_s / 60.0).ceil());
    let progress = bar("", about_s.ceil() as usize);
    let mut points = Vec::with_capacity(all.len());
    let mut done_s = 0.0;
    for Planned { settings, nodes: count, about_s } in all {
        if count < nodes.count() {
            time(nodes, subject, timed).await?;
            nodes.shrink_to(count).await?;
            time(nodes, subject, timed).await?;
        }
        progress.set_message(format!("P = {count}, V = {}, {}", settings.views, settings.policy));
        let point = point(nodes, subject, settings, done_s, about_s, &progress).await?;
        progress.suspend(|| println!("{}", in_words(&point)));
        points.push(point);
        done_s += about_s;
        progress.set_position(done_s as u64);
        nodes.rest().await?;
    }
    progress.finish_and_clear();
    time(nodes, subject, timed).await?;
    Ok(points)
}

fn in_words(point: &Point) -> String {
    let PointSettings { policy: asked_for, views, counted_sets } = point.settings;
    format!(
        "P = {}, V = {views}, {asked_for}: {}, T = {:.3} s by {counted_sets} sets after {:.2} s; changes of plan: {}; \
         {:.2} cores for other programs",
        point.nodes,
        point.policy(),
        point.period_s,
        point.fill_s,
        point.later_plans,
        point.window.others_cores()
    )
}

/// By falling numbers of nodes, as nodes are only ever ended.
fn all_points(extent: Extent, costs: &Costs, images: usize) -> Vec<Planned> {
    let points = extent.node_counts().into_iter().flat_map(|nodes| {
        let points = extent.points(nodes).into_iter();
        points.map(move |(policy, views)| planned(extent, costs, images, nodes, policy, views))
    });
    points.collect()
}

async fn point(
    nodes: &Nodes,
    subject: &Subject,
    settings: PointSettings,
    done_s: f64,
    about_s: f64,
    progress: &ProgressBar,
) -> anyhow::Result<Point> {
    let frames = settings.awaited_views().max(1) as f64;
    for attempt in 1.. {
        let mut arrived = 0.0;
        let point = measure(nodes, subject, settings, || {
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
