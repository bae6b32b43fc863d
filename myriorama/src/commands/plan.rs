//! `myriorama plan`: the cheapest way to make the views of a scene that keeps a budget.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context as _;
use app_core::exit::Outcome;
use app_core::planning::{PlannedViews, measure};
use app_core::print_line;
use app_core::setup::{DeviceArgs, SceneArgs};
use app_core::sizes::SizePx;
use clap::Args;
use depth_image::{Antialias, ViewCell};
use engine::GpuEngine;
use glam::Vec2;
use indicatif::ProgressBar;
use planner::{Budget, Demand, Metric, PlanRequest, Planner, Row, RowSummary};
use probe::Probers;
use reconstruction::ReconstructionMethod;
use report::{Axis, Limit, Point, Series, Table, XyChart};

/// Finds the cheapest way to make views of a scene that keeps a budget: shared light of some quality from some samples, views
/// from samples alone, or direct drawing with all rays or fewer. Prints the front of cost against error, the choice and the
/// reason. docs/planner.md says what is promised.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct PlanArgs {
    /// The most error of views in the mean, over the pixels that show a surface: "flip LIMIT" or "psnr DB"
    #[arg(long, value_name = "BUDGET")]
    budget: Budget,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    scene: SceneArgs,
    /// Size of the views
    #[arg(long, default_value = "640x360", value_name = "WxH")]
    size: SizePx,
    /// Samples a pixel of the views: 1, 2, 4, 8 or 16
    #[arg(long, default_value = "4", value_name = "N")]
    antialias: Antialias,
    /// Views that share a sample set: of a moving viewer those of a minute
    #[arg(long, default_value_t = 290, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    views: u32,
    /// Nodes that share the work
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    nodes: u32,
    /// Draws the rows and their front, as SVG
    #[arg(long, value_name = "FILE.svg")]
    chart: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  myriorama plan --scene urban --lighting \"soft 16, occlusion 16\" --budget \"flip 0.02\" --chart plan.svg
  myriorama plan --scene helmet.gltf --lighting \"soft 16\" --budget \"psnr 34\" --views 24 --size 1280x720

Exit status: 0 the budget is kept; 2 arguments or input that cannot be used; 3 nothing keeps the budget, or a failure.";

/// Series of the chart.
const SHARED: &str = "shared light";
const IMAGES: &str = "samples alone";
const DIRECT: &str = "direct drawing";
/// The time of a plan is compared with that of so many views.
const COMPARED_VIEWS: f64 = 24.0;

/// Plans, prints and draws.
///
/// # Errors
/// The scene cannot be used, the device fails, the chart cannot be written, or nothing keeps the budget.
pub fn run(args: &PlanArgs) -> anyhow::Result<Outcome> {
    args.scene.check_for_budget(args.budget)?;
    let setup = args.scene.load()?;
    let cell = ViewCell::between(&setup.around).context("no sample cameras")?;
    let views = PlannedViews {
        budget: args.budget,
        typical_view: cell.camera_at(Vec2::ZERO, args.size.0),
        antialias: args.antialias,
        lighting: args.scene.lighting,
        demand: Demand { nodes: args.nodes as usize, cells: 1, views_a_set: args.views as usize },
        number: 1,
    };
    let engine = GpuEngine::shared(args.device.device)?;
    engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
    let mut plan = views.begin(&setup, engine.as_ref())?;
    let progress = ProgressBar::new_spinner();
    progress.enable_steady_tick(Duration::from_millis(200));
    measure(&mut plan, &Probers::new(engine), |plan| {
        let (spent_s, count) = plan.planner.spent();
        progress.set_message(format!("{}: {count} measurements in {spent_s:.1} s", args.budget));
    })?;
    progress.finish_and_clear();
    let lines = lines(&plan.planner);
    print_line!("{}", table(&front(&lines)).to_text());
    if let Some(path) = &args.chart {
        let svg = chart(args.budget, &lines).to_svg()?;
        path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        std::fs::write(path, svg).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let outcome = plan.planner.outcome().context("the plan has no end")?;
    print_line!("\n{}", outcome.reason);
    let (spent_s, count) = plan.planner.spent();
    let exact = plan.planner.request().exact.and_then(|exact| plan.planner.summary(exact));
    let ratio = exact.map_or(f64::NAN, |exact| spent_s / (COMPARED_VIEWS * exact.price_s));
    print_line!(
        "{count} measurements in {spent_s:.1} s, {ratio:.2} times the time of {COMPARED_VIEWS} directly drawn views."
    );
    anyhow::ensure!(!outcome.kept.is_empty(), "the budget {} is not kept", args.budget);
    Ok(Outcome::Done)
}

/// A row that was measured.
struct Line {
    name: String,
    /// The series of the chart.
    family: &'static str,
    price_ms: f64,
    error_ratio: f64,
    /// The error as a person reads it.
    error: String,
    is_chosen: bool,
}

impl Line {
    fn point(&self) -> Point {
        Point::labelled(self.price_ms, self.error_ratio, self.name.as_str())
    }
}

/// All measured rows, the cheapest first.
fn lines(planner: &Planner) -> Vec<Line> {
    let chosen = planner.outcome().and_then(|outcome| outcome.kept.first().copied());
    let PlanRequest { rows, budget, .. } = planner.request();
    let lines = rows.iter().enumerate().filter_map(|(place, row)| {
        let RowSummary { error_ratio, price_s, tested } = planner.summary(place)?;
        let error_ratio = tested.map(|tested| tested.mean_ratio).or(error_ratio)?;
        Some(Line {
            name: row.to_string(),
            family: family_of(row),
            price_ms: price_s * 1e3,
            error_ratio,
            error: budget.shown(error_ratio),
            is_chosen: chosen == Some(place),
        })
    });
    let mut lines: Vec<Line> = lines.collect();
    lines.sort_by(|a, b| a.price_ms.total_cmp(&b.price_ms));
    lines
}

fn family_of(row: &Row) -> &'static str {
    let Row::Samples { method, .. } = row else { return DIRECT };
    let shares_light = method.parse().is_ok_and(|method: ReconstructionMethod| method.light_cache_quality().is_some());
    if shares_light { SHARED } else { IMAGES }
}

/// The lines with an error below that of every cheaper one, and the choice.
fn front(by_price: &[Line]) -> Vec<&Line> {
    let mut least = f64::INFINITY;
    let lines = by_price.iter().filter(|line| {
        let is_better = line.error_ratio < least;
        least = least.min(line.error_ratio);
        is_better || line.is_chosen
    });
    lines.collect()
}

fn table(front: &[&Line]) -> Table {
    Table::of_rows(
        "Front of cost against error",
        front,
        &[
            ("error", "", |line| line.error.as_str().into()),
            ("a view", "ms", |line| line.price_ms.into()),
            ("row", "", |line| line.name.as_str().into()),
            ("", "", |line| if line.is_chosen { "chosen" } else { "" }.into()),
        ],
    )
}

/// Cost against error of all measured rows, with their front, the budget and the choice.
fn chart(budget: Budget, lines: &[Line]) -> XyChart {
    let error = match budget.metric() {
        Metric::Flip => "FLIP over surfaces",
        Metric::Psnr => "mean squared error over surfaces",
    };
    let cost = Axis::log("nodes' time for a view", "ms");
    let mut chart = XyChart::new(format!("Cost against error, {budget}"), cost, Axis::linear(error, ""));
    for family in [SHARED, IMAGES, DIRECT] {
        let own = lines.iter().filter(|line| line.family == family);
        chart = chart.with(Series::points(family, own.map(Line::point)));
    }
    let chosen = lines.iter().filter(|line| line.is_chosen);
    chart = chart.with(Series::points("chosen", chosen.map(Line::point)));
    chart.staircase = front(lines).into_iter().map(Line::point).collect();
    chart.limits = vec![Limit { name: budget.to_string(), y: budget.most_ratio() }];
    chart
}
