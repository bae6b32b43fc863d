//! Delivery times against the number of views, by method.

use app_core::experiment::{Delivered, Experiment, PAPER_VIEWS};
use app_core::progress::bar;
use cluster::{Costs, PolicyChoice, SessionPlan};
use coordinator::schedule::k_fd;
use depth_image::View;
use metrics::{flip_map, pdiff_map, psnr_db};
use reconstruction::ReconstructionMethod;
use report::{Cell, Report, Table};

use crate::balance::{brute_force_k, k_fd_printed};
use crate::delivery::{self, DeliverySettings};
use crate::study::{Column, table};

/// The paper's method, with its 100 steps.
const SEARCH: ReconstructionMethod = ReconstructionMethod::LightFieldSearch { steps: 100 };
/// Numbers of views that direct rendering is timed on; more are extended linearly.
const DIRECT_VIEWS: [usize; 3] = [1, 10, 32];

/// The number of views whose errors beside direct rendering are stated.
const COMPARED_VIEWS: usize = 10;

/// One delivery.
pub struct Run {
    pub views: usize,
    /// Seconds until the last view was decoded.
    pub seconds: f64,
    /// The longest wait of a frame for its sample set.
    pub set_wait_s: f64,
    pub plan: SessionPlan,
    /// The views in their order, in runs of [`COMPARED_VIEWS`].
    made: Vec<View>,
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
    let mut frames = Vec::new();
    let settings = DeliverySettings { method, ..DeliverySettings::new(experiment, policy, views) };
    let delivered = delivery::deliver(experiment, settings, |frame| {
        set_wait_s = set_wait_s.max(frame.header.stage_times.set_wait_s);
        progress.inc(1);
        if views == COMPARED_VIEWS {
            frames.push(frame);
        }
    });
    progress.finish_and_clear();
    let Delivered { plan, seconds } = delivered?;
    frames.sort_by_key(|frame| frame.request.frame);
    let made = frames.into_iter().map(|frame| frame.view).collect();
    Ok(Run { views, seconds, set_wait_s, plan, made })
}

impl Times {
    /// The runs of the first method.
    pub fn first_pipeline(&self) -> &[Run] {
        self.pipelines.first().map_or(&[], |(_, runs)| runs)
    }

    /// Seconds a view of direct rendering, when many are asked for.
    pub fn direct_view_s(&self) -> f64 {
        self.direct.last().map_or(f64::NAN, |run| run.seconds / run.views as f64)
    }

    /// The run of the headline.
    pub fn headline(&self) -> Option<&Run> {
        self.first_pipeline().iter().find(|run| run.views == self.headline_views)
    }

    /// Throughput of the default method over that of direct rendering.
    pub fn headline_ratio(&self) -> f64 {
        let seconds = self.headline().map_or(f64::NAN, |run| run.seconds);
        self.direct_view_s() * self.headline_views as f64 / seconds
    }

    /// The difference of the coordinator's K from the formula's, with whole images.
    pub fn headline_k_off_formula(&self) -> f64 {
        let Some(run) = self.headline() else { return f64::NAN };
        let formula = SamplersRow { times: self, run }.k_by(k_fd).clamp(1, self.images.max(1));
        run.plan.sampler_count().abs_diff(formula) as f64
    }
}

/// A method, and its run of the most views.
struct CostRow<'t> {
    method: &'t str,
    costs: Costs,
    errors: Errors,
}

/// Errors of views beside direct rendering, as means over whole views.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Errors {
    pub(super) psnr_db: f64,
    pub(super) flip: f64,
    /// Pixels that differ perceptibly.
    pub(super) different_px: f64,
}

impl Errors {
    pub(super) fn new(direct: &[View], made: &[View]) -> anyhow::Result<Self> {
        let mut sums = Self::default();
        for (direct, view) in direct.iter().zip(made) {
            sums.psnr_db += psnr_db(direct, view, None)?.unwrap_or(f64::NAN);
            sums.flip += flip_map(direct, view)?.mean(None)?.unwrap_or(f64::NAN);
            sums.different_px += pdiff_map(direct, view)?.into_iter().filter(|&differs| differs).count() as f64;
        }
        let count = made.len() as f64;
        let Self { psnr_db, flip, different_px } = sums;
        Ok(Self { psnr_db: psnr_db / count, flip: flip / count, different_px: different_px / count })
    }
}

impl<'t> CostRow<'t> {
    fn new(times: &Times, method: &'t str, runs: &[Run]) -> anyhow::Result<Option<Self>> {
        let compared = [&times.direct[..], runs].map(|runs| runs.iter().find(|run| run.views == COMPARED_VIEWS));
        let [Some(direct), Some(own)] = compared else { return Ok(None) };
        let errors = Errors::new(&direct.made, &own.made)?;
        Ok(runs.last().map(|last| Self { method, costs: last.plan.costs, errors }))
    }
}

fn cost_columns<'t>() -> [Column<CostRow<'t>>; 10] {
    [
        Column::new("method", |row| row.method.into()),
        Column::with_unit("g_s a sample", "ms", |row| (row.costs.sample_image_s * 1e3).into()),
        Column::with_unit("g_v a view", "ms", |row| (row.costs.direct_view_s * 1e3).into()),
        Column::with_unit("c a view", "ms", |row| (row.costs.reconstruct_view_s * 1e3).into()),
        Column::with_unit("d a set", "ms", |row| (row.costs.load_set_s * 1e3).into()),
        Column::with_unit("e a view", "ms", |row| (row.costs.encode_view_s * 1e3).into()),
        Column::new("c / g_v", |row| (row.costs.reconstruct_view_s / row.costs.direct_view_s).into()),
        Column::with_unit("PSNR", "dB", |row| row.errors.psnr_db.into()),
        Column::new("FLIP", |row| row.errors.flip.into()),
        Column::with_unit("pdiff", "px a view", |row| row.errors.different_px.into()),
    ]
}

/// A run, and what rules say of its K.
struct SamplersRow<'t> {
    times: &'t Times,
    run: &'t Run,
}

impl SamplersRow<'_> {
    fn k_by(&self, rule: fn(usize, f64, usize, f64, usize) -> usize) -> usize {
        let Costs { sample_image_s, reconstruct_view_s, encode_view_s, .. } = self.run.plan.costs;
        rule(self.times.images, sample_image_s, self.run.views, reconstruct_view_s + encode_view_s, self.times.nodes)
    }
}

fn samplers_columns<'t>() -> [Column<SamplersRow<'t>>; 8] {
    [
        Column::new("views V", |row| row.run.views.into()),
        Column::new("chosen K", |row| row.run.plan.sampler_count().into()),
        Column::new("formula, floor", |row| row.k_by(k_fd).into()),
        Column::new("as printed, ceil", |row| row.k_by(k_fd_printed).into()),
        Column::new("brute force", |row| row.k_by(brute_force_k).into()),
        Column::with_unit("pipeline predicted", "s", |row| row.run.plan.predicted_pipeline_s.into()),
        Column::with_unit("direct predicted", "s", |row| row.run.plan.predicted_direct_s.into()),
        Column::new("policy by prediction", |row| {
            let plan = &row.run.plan;
            if plan.predicted_direct_s < plan.predicted_pipeline_s { "direct".into() } else { "pipeline".into() }
        }),
    ]
}

/// Adds total times, costs with errors, and K.
///
/// # Errors
/// A row does not fit its table, or views differ in size.
pub fn tables(times: &Times, report: &mut Report) -> anyhow::Result<()> {
    report.tables.push(totals(times)?);
    let mut costs = Vec::new();
    for (method, runs) in &times.pipelines {
        costs.extend(CostRow::new(times, method, runs)?);
    }
    report.tables.push(table("Costs of one operation, alone and warm, and errors of views", &cost_columns(), &costs)?);
    let samplers: Vec<SamplersRow<'_>> = times.first_pipeline().iter().map(|run| SamplersRow { times, run }).collect();
    report.tables.push(table(format!("K of P = {} nodes", times.nodes), &samplers_columns(), &samplers)?);
    Ok(())
}

fn totals(times: &Times) -> anyhow::Result<Table> {
    let mut columns = vec![("views V", ""), ("direct", "s"), ("direct is", "")];
    columns.extend(times.pipelines.iter().map(|(name, _)| (name.as_str(), "s")));
    columns.push(("direct over the first", "×"));
    let mut table = Table::new("Total time until delivered", &columns);
    for (place, run) in times.first_pipeline().iter().enumerate() {
        let timed = times.direct.iter().find(|direct| direct.views == run.views);
        let how = if timed.is_some() { "timed" } else { "extended" };
        let direct_s = timed.map_or(times.direct_view_s() * run.views as f64, |direct| direct.seconds);
        let seconds = times.pipelines.iter().map(|(_, runs)| Cell::from(runs[place].seconds));
        let head = [Cell::from(run.views), direct_s.into(), how.into()];
        table.push(head.into_iter().chain(seconds).chain([Cell::from(direct_s / run.seconds)]))?;
    }
    Ok(table)
}

/// A sentence with the headline.
pub fn summary(times: &Times) -> String {
    let Some(run) = times.headline() else { return String::new() };
    let views = run.views;
    let seconds = run.seconds;
    let ratio = times.headline_ratio();
    let paper = if views == PAPER_VIEWS { " The paper's five GPUs took 2.61 s." } else { "" };
    format!(
        "{views} views delivered in {seconds:.2} s, {ratio:.1} times the throughput of drawing each from the scene.{paper}"
    )
}
