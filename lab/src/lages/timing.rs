//! Delivery times against the number of views, by method.

use app_core::experiment::{Delivered, DeliverySettings, Experiment, PAPER_VIEWS};
use app_core::progress::bar;
use cluster::{Costs, PolicyChoice, SessionPlan};
use coordinator::schedule::k_fd;
use reconstruction::ReconstructionMethod;
use report::{Report, Table};

use crate::balance::{brute_force_k, k_fd_printed};

/// The paper's method, with its 100 steps.
const SEARCH: ReconstructionMethod = ReconstructionMethod::LightFieldSearch { steps: 100 };
/// Numbers of views that direct rendering is timed on; more are extended linearly.
const DIRECT_VIEWS: [usize; 3] = [1, 10, 32];

/// One delivery.
pub struct Run {
    pub views: usize,
    /// Seconds until the last view was decoded.
    pub seconds: f64,
    /// The longest wait of a frame for its sample set.
    pub set_wait_s: f64,
    pub plan: SessionPlan,
}

/// All deliveries.
pub struct Times {
    /// The number of views of the headline and of the stages.
    pub headline_views: usize,
    pub images: usize,
    pub nodes: usize,
    /// Names and runs of the methods that reconstruct; the default one first.
    pub pipelines: Vec<(String, Vec<Run>)>,
    /// Runs of few views, drawn from the scene.
    pub direct: Vec<Run>,
}

/// The numbers of views along the chart's axis.
fn view_counts(quick: bool) -> Vec<usize> {
    if quick { vec![1, 10, 64] } else { vec![1, 10, 32, 100, PAPER_VIEWS, 1000] }
}

/// The method asked for, and the paper's method or else the default.
fn compared(method: ReconstructionMethod) -> [ReconstructionMethod; 2] {
    let other = if method == SEARCH { ReconstructionMethod::default() } else { SEARCH };
    [method, other]
}

/// Makes all deliveries.
pub fn measure(experiment: &Experiment, quick: bool) -> anyhow::Result<Times> {
    let counts = view_counts(quick);
    let mut times = Times {
        headline_views: if quick { 64 } else { PAPER_VIEWS },
        images: experiment.setup.samples.len(),
        nodes: 0,
        pipelines: Vec::new(),
        direct: Vec::new(),
    };
    for method in compared(experiment.args.method()) {
        let mut runs = Vec::new();
        for &count in &counts {
            runs.push(deliver(experiment, PolicyChoice::Pipeline, method, count)?);
        }
        times.pipelines.push((method.to_string(), runs));
    }
    for count in DIRECT_VIEWS {
        times.direct.push(deliver(experiment, PolicyChoice::Direct, experiment.args.method(), count)?);
    }
    let assignment = times.direct.first().map(|run| &run.plan.assignment);
    times.nodes = assignment.map_or(0, |assignment| assignment.compositors.len());
    Ok(times)
}

fn deliver(
    experiment: &Experiment,
    policy: PolicyChoice,
    method: ReconstructionMethod,
    views: usize,
) -> anyhow::Result<Run> {
    let name = if policy == PolicyChoice::Direct { "direct".to_owned() } else { method.to_string() };
    let progress = bar(format!("{views} views by {name}"), views);
    let mut set_wait_s = 0.0_f64;
    let settings = DeliverySettings { method, ..experiment.delivery(policy, views) };
    let delivered = experiment.deliver(settings, |frame| {
        set_wait_s = set_wait_s.max(frame.header.stage_times.set_wait_s);
        progress.inc(1);
    });
    progress.finish_and_clear();
    let Delivered { plan, seconds } = delivered?;
    Ok(Run { views, seconds, set_wait_s, plan })
}

impl Times {
    /// Seconds a view of direct rendering, when many are asked for.
    pub fn direct_view_s(&self) -> f64 {
        self.direct.last().map_or(f64::NAN, |run| run.seconds / run.views as f64)
    }

    /// The run of the headline.
    pub fn headline(&self) -> Option<&Run> {
        let runs = self.pipelines.first().map(|(_, runs)| runs)?;
        runs.iter().find(|run| run.views == self.headline_views)
    }

    /// Throughput of the default method over that of direct rendering.
    pub fn headline_ratio(&self) -> f64 {
        let seconds = self.headline().map_or(f64::NAN, |run| run.seconds);
        self.direct_view_s() * self.headline_views as f64 / seconds
    }

    /// The difference of the coordinator's K from the formula's, with whole images.
    pub fn headline_k_off_formula(&self) -> f64 {
        let Some(run) = self.headline() else { return f64::NAN };
        let formula = self.formula(run).clamp(1, self.images.max(1));
        run.plan.sampler_count().abs_diff(formula) as f64
    }

    fn formula(&self, run: &Run) -> usize {
        let Costs { sample_image_s, reconstruct_view_s, encode_view_s, .. } = run.plan.costs;
        k_fd(self.images, sample_image_s, run.views, reconstruct_view_s + encode_view_s, self.nodes)
    }
}

/// Adds total times, costs and K.
pub fn tables(times: &Times, report: &mut Report) -> anyhow::Result<()> {
    report.tables.push(totals(times)?);
    report.tables.push(costs(times)?);
    report.tables.push(samplers(times)?);
    Ok(())
}

fn totals(times: &Times) -> anyhow::Result<Table> {
    let names: Vec<&str> = times.pipelines.iter().map(|(name, _)| name.as_str()).collect();
    let mut columns = vec![("views V", ""), ("direct", "s"), ("direct is", "")];
    columns.extend(names.iter().map(|name| (*name, "s")));
    columns.push(("direct over the first", "×"));
    let mut table = Table::new("Total time until delivered", &columns);
    let counts = times
        .pipelines
        .first()
        .map(|(_, runs)| runs.iter().map(|run| run.views).collect::<Vec<_>>())
        .unwrap_or_default();
    for (index, views) in counts.into_iter().enumerate() {
        let timed = times.direct.iter().find(|run| run.views == views).map(|run| run.seconds);
        let direct = timed.unwrap_or(times.direct_view_s() * views as f64);
        let seconds: Vec<f64> = times.pipelines.iter().map(|(_, runs)| runs[index].seconds).collect();
        let how = if timed.is_some() { "timed" } else { "extended" };
        let ratio = direct / seconds.first().copied().unwrap_or(f64::NAN);
        let cells = [views.into(), direct.into(), how.into()]
            .into_iter()
            .chain(seconds.into_iter().map(Into::into))
            .chain([ratio.into()]);
        table.push(cells)?;
    }
    Ok(table)
}

fn costs(times: &Times) -> anyhow::Result<Table> {
    let columns = [
        ("method", ""),
        ("g_s a sample", "ms"),
        ("g_v a view", "ms"),
        ("c a view", "ms"),
        ("d a set", "ms"),
        ("e a view", "ms"),
        ("c / g_v", ""),
    ];
    let mut table = Table::new("Costs of one operation, alone and warm", &columns);
    for (name, runs) in &times.pipelines {
        let Some(run) = runs.last() else { continue };
        let c = run.plan.costs;
        let ms =
            [c.sample_image_s, c.direct_view_s, c.reconstruct_view_s, c.load_set_s, c.encode_view_s].map(|s| s * 1e3);
        let ratio = c.reconstruct_view_s / c.direct_view_s;
        table.push([name.as_str().into()].into_iter().chain(ms.map(Into::into)).chain([ratio.into()]))?;
    }
    Ok(table)
}

fn samplers(times: &Times) -> anyhow::Result<Table> {
    let columns = [
        ("views V", ""),
        ("chosen K", ""),
        ("formula, floor", ""),
        ("as printed, ceil", ""),
        ("brute force", ""),
        ("pipeline predicted", "s"),
        ("direct predicted", "s"),
        ("policy by prediction", ""),
    ];
    let mut table = Table::new(format!("K of P = {} nodes", times.nodes), &columns);
    for run in times.pipelines.first().map(|(_, runs)| runs.as_slice()).unwrap_or_default() {
        let plan = &run.plan;
        let (g, c) = (plan.costs.sample_image_s, plan.costs.reconstruct_view_s + plan.costs.encode_view_s);
        let by = |rule: fn(usize, f64, usize, f64, usize) -> usize| rule(times.images, g, run.views, c, times.nodes);
        let would = if plan.predicted_direct_s < plan.predicted_pipeline_s { "direct" } else { "pipeline" };
        let ks = [run.views, plan.sampler_count(), by(k_fd), by(k_fd_printed), by(brute_force_k)];
        let predicted = [plan.predicted_pipeline_s, plan.predicted_direct_s];
        table.push(ks.map(Into::into).into_iter().chain(predicted.map(Into::into)).chain([would.into()]))?;
    }
    Ok(table)
}

/// A sentence with the headline.
pub fn summary(times: &Times) -> String {
    let Some(run) = times.headline() else { return String::new() };
    let (views, seconds, ratio) = (run.views, run.seconds, times.headline_ratio());
    let paper = if views == PAPER_VIEWS { " The paper's five GPUs took 2.61 s." } else { "" };
    format!(
        "{views} views delivered in {seconds:.2} s, {ratio:.1} times the throughput of drawing each from the scene.{paper}"
    )
}
