//! The measurement of all points, from the start of the processes to their end.

use std::path::PathBuf;
use std::time::Instant;

use app_core::process::StopSignals;
use app_core::progress::bar;
use cluster::{Costs, MeasureCosts};
use glam::UVec2;
use gpu::DevicePreference;
use indicatif::ProgressBar;

use super::costs::{self, Timed};
use super::matrix::{Extent, Planned, planned};
use super::measure_point::measure;
use super::nodes::Nodes;
use super::point::{Point, PointSettings};
use super::prediction::Traffic;
use super::results::Results;
use super::subject::{MEASURED_BATCH, SetSize, Subject};

/// Attempts at a point whose plan changes while it is measured; the last one counts.
const ATTEMPTS: u32 = 2;

/// The size of pictures for which only shaders are built.
const SMALL_PX: UVec2 = UVec2::new(16, 12);

/// Sizes of sets whose costs tell which is cheapest.
const SET_IMAGES: [usize; 3] = [1, 2, 4];
const SET_DENSITIES: [f32; 3] = [0.25, 0.5, 1.0];

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

impl Request {
    fn quota(&self, nodes: usize) -> f64 {
        self.quota_cores.unwrap_or_else(|| default_quota(nodes))
    }
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
    let mut nodes = Nodes::start(&subject.args, request.device, count, &request.event_log).await?;
    let device = nodes.device().to_owned();
    println!("{count} nodes on {device}");
    let unlimited = warm(&nodes, subject, request.extent.times_once()).await?;
    println!("all are ready after {:.0} s", start.elapsed().as_secs_f64());
    let sets = sets(&nodes, subject).await?;
    nodes.rest().await?;
    let mut timed = Vec::new();
    let points = points(&mut nodes, subject, request, &mut timed).await?;
    let results = Results {
        device,
        lighting: subject.args.lighting,
        cores: std::thread::available_parallelism().map_or(1, usize::from) as f64,
        set: subject.set(),
        unlimited,
        sets,
        timed,
        points: Vec::new(),
        traffic: Traffic::default(),
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok(results.with_points(points))
}

/// Lets every node do all kinds of work once, alone and without a limit. Shaders are then built, the scene is loaded,
/// and rays and triangles are timed undisturbed. With `times_once` one node tells the costs, and the others do small work.
async fn warm(nodes: &Nodes, subject: &Subject, times_once: bool) -> anyhow::Result<Vec<Costs>> {
    let progress = bar("nodes load the scene and build shaders", nodes.count());
    let request = subject.measurement(subject.set(), subject.views(MEASURED_BATCH as usize)?, MEASURED_BATCH)?;
    let small = small_request(&request);
    let mut unlimited = Vec::new();
    for node in 0..nodes.count() {
        if times_once && node > 0 {
            nodes.measure_on(node, small.clone()).await?;
        } else {
            unlimited.push(nodes.measure_on(node, request.clone()).await?);
        }
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok(unlimited)
}

/// The same work with images and views of few pixels.
fn small_request(request: &MeasureCosts) -> MeasureCosts {
    let mut small = request.clone();
    for camera in &mut small.workload.sample_cameras {
        *camera = camera.resized(SMALL_PX);
    }
    for view in &mut small.typical_views {
        *view = view.resized(SMALL_PX);
    }
    small
}

/// Lets one node do all kinds of work without a limit, with each size of a set of light.
async fn sets(nodes: &Nodes, subject: &Subject) -> anyhow::Result<Vec<(SetSize, Costs)>> {
    if !subject.takes_light() {
        return Ok(Vec::new());
    }
    let sizes = SET_IMAGES.into_iter().flat_map(|images| SET_DENSITIES.map(|density| SetSize { images, density }));
    let progress = bar("one node samples sets of other sizes", SET_IMAGES.len() * SET_DENSITIES.len());
    let mut sets = Vec::new();
    for set in sizes {
        let request = subject.measurement(set, subject.views(MEASURED_BATCH as usize)?, MEASURED_BATCH)?;
        sets.push((set, nodes.measure_on(0, request).await?));
        progress.inc(1);
    }
    progress.finish_and_clear();
    println!("one node has timed {} sizes of sets", sets.len());
    Ok(sets)
}

/// Times the costs at this number of nodes.
async fn time(nodes: &Nodes, subject: &Subject, timed: &mut Vec<Timed>, once: bool) -> anyhow::Result<()> {
    let start = Instant::now();
    if timed.last().is_none_or(|timed| timed.nodes != nodes.count()) {
        let alone = if once { Vec::new() } else { costs::measure(nodes, subject, 1).await? };
        timed.push(Timed { nodes: nodes.count(), quota_cores: nodes.quota_cores, alone, ..Timed::default() });
    } else if once {
        return Ok(());
    }
    let costs = costs::measure(nodes, subject, MEASURED_BATCH).await?;
    timed.iter_mut().last().into_iter().for_each(|timed| timed.costs.extend(&costs));
    println!("{} nodes have timed their work in {:.0} s", nodes.count(), start.elapsed().as_secs_f64());
    nodes.rest().await
}

async fn points(
    nodes: &mut Nodes,
    subject: &Subject,
    request: &Request,
    timed: &mut Vec<Timed>,
) -> anyhow::Result<Vec<Point>> {
    let extent = request.extent;
    let once = extent.times_once();
    nodes.limit(request.quota(nodes.count()))?;
    time(nodes, subject, timed, once).await?;
    let costs = timed.first().map_or_else(Costs::default, Timed::mean);
    let all = all_points(extent, &costs, subject.images());
    let about_s: f64 = all.iter().map(|point| point.about_s).sum();
    println!("{} points, about {:.0} minutes", all.len(), (about_s / 60.0).ceil());
    let progress = bar("", about_s.ceil() as usize);
    let mut points = Vec::with_capacity(all.len());
    let mut done_s = 0.0;
    for Planned { settings, nodes: count, about_s } in all {
        if count < nodes.count() {
            time(nodes, subject, timed, once).await?;
            nodes.shrink_to(count).await?;
            nodes.limit(request.quota(count))?;
            time(nodes, subject, timed, once).await?;
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
    time(nodes, subject, timed, once).await?;
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
