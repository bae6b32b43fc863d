//! Tables and charts of fronts.

use planner::{Choice, Metric};
use report::{Axis, Cell, Point, Report, Series, XyChart};

use super::measure::{Front, Planned};
use super::row::MeasuredRow;
use crate::pareto::{Better, with_front};
use crate::study::{Column, table};

/// The beginning of the names of tables of rows, and their columns that other commands read.
pub const ROWS: &str = "Rows, ";
pub const RECONSTRUCTION: &str = "reconstruction";
pub const COST: &str = "cost of a view";
pub const FOREGROUND_FLIP: &str = "foreground FLIP";

/// A figure over which costs are charted.
struct Figure {
    name: &'static str,
    unit: &'static str,
    better: Better,
    of: fn(&MeasuredRow) -> f64,
    /// That of direct drawing; `None` where it has none.
    direct: Option<f64>,
    /// That of a plan, on views of its own; `None` where it measures none.
    planned: Option<fn(&Planned) -> f64>,
}

const FIGURES: [Figure; 4] = [
    Figure {
        name: "Foreground FLIP",
        unit: "",
        better: Better::Low,
        of: |row| row.error_ratio(Metric::Flip),
        direct: Some(0.0),
        planned: Some(|planned| planned.error_ratio),
    },
    Figure {
        name: "Foreground PSNR",
        unit: "dB",
        better: Better::High,
        of: MeasuredRow::psnr_db,
        direct: None,
        planned: None,
    },
    Figure {
        name: "Disocclusion",
        unit: "%",
        better: Better::Low,
        of: |row| 100.0 * row.error_ratio(Metric::Disocclusion),
        direct: Some(0.0),
        planned: None,
    },
    Figure {
        name: "Bytes of a set",
        unit: "kB",
        better: Better::Low,
        of: |row| row.set_bytes as f64 / 1e3,
        direct: Some(0.0),
        planned: None,
    },
];

const ROW_COLUMNS: [Column<MeasuredRow>; 15] = [
    Column::new("sampling", |row| row.row.sampling.as_str().into()),
    Column::new("S", |row| row.row.camera_count.into()),
    Column::new("side", |row| row.row.side_ratio.into()),
    Column::new(RECONSTRUCTION, |row| row.row.method.as_str().into()),
    Column::with_unit(COST, "ms", |row| (row.price.node_s * 1e3).into()),
    Column::with_unit("g_s", "ms", |row| (row.costs.sample_image_s * 1e3).into()),
    Column::with_unit("d", "ms", |row| (row.costs.load_set_s * 1e3).into()),
    Column::with_unit("c", "ms", |row| (row.costs.reconstruct_view_s * 1e3).into()),
    Column::with_unit("set", "kB", |row| (row.set_bytes as f64 / 1e3).into()),
    Column::new(FOREGROUND_FLIP, |row| row.error_ratio(Metric::Flip).into()),
    Column::new("FLIP", |row| row.error_ratio(Metric::FlipWhole).into()),
    Column::with_unit("foreground PSNR", "dB", |row| row.psnr_db().into()),
    Column::with_unit("disocclusion", "%", |row| (100.0 * row.error_ratio(Metric::Disocclusion)).into()),
    Column::with_unit("wrong hits", "%", |row| (100.0 * row.wrong_hits).into()),
    Column::with_unit("filled", "%", |row| (100.0 * row.filled).into()),
];

/// A plan beside the front within its budget.
struct PlanRow<'f> {
    planned: &'f Planned,
    cheapest_s: f64,
}

fn plan_columns<'f>() -> [Column<PlanRow<'f>>; 6] {
    [
        Column::new("budget", |row| row.planned.budget.to_string().into()),
        Column::new("choice", |row| row.planned.name.as_str().into()),
        Column::with_unit("cost of a view", "ms", |row| (row.planned.price.node_s * 1e3).into()),
        Column::new("expected error", |row| row.planned.error_ratio.into()),
        Column::with_unit("time of the plan", "s", |row| row.planned.spent_s.into()),
        Column::with_unit("the front's cost within the budget", "ms", |row| (row.cheapest_s * 1e3).into()),
    ]
}

/// Adds a subject's tables and charts.
///
/// # Errors
/// A row that does not fit its table.
pub fn add_to(report: &mut Report, front: &Front) -> anyhow::Result<()> {
    let name = front.conditions.name;
    report.parameter(format!("{name}: scene"), front.scene_hash.as_str());
    let mut rows = table(format!("{ROWS}{name}"), &ROW_COLUMNS, &front.rows)?;
    let direct =
        [Cell::from("direct"), Cell::Missing, Cell::Missing, Cell::Missing, (front.direct.node_s * 1e3).into()];
    rows.push(direct.into_iter().chain(vec![Cell::Missing; ROW_COLUMNS.len() - 5]))?;
    let plans = front.planned.iter().map(|planned| PlanRow { planned, cheapest_s: cheapest_s(front, planned) });
    let plans: Vec<PlanRow<'_>> = plans.collect();
    report.tables.extend([rows, table(format!("Plans, {name}"), &plan_columns(), &plans)?]);
    report.charts.extend(FIGURES.iter().map(|figure| chart(front, figure)));
    Ok(())
}

/// The cost of the cheapest row within a budget, or of direct drawing.
fn cheapest_s(front: &Front, planned: &Planned) -> f64 {
    let most = planned.budget.error().map_or(f64::INFINITY, |term| term.most_ratio());
    let within = front.rows.iter().filter(|row| row.error_ratio(Metric::Flip) <= most);
    within.map(|row| row.price.node_s).fold(front.direct.node_s, f64::min)
}

fn chart(front: &Front, figure: &Figure) -> XyChart {
    let title = format!("{} against cost, {}", figure.name, front.conditions.name);
    let cost = Axis::log("cost of a view", "ms");
    let mut chart = XyChart::new(title, cost, Axis::linear(figure.name, figure.unit));
    let mut samplings: Vec<&str> = front.rows.iter().map(|row| row.row.sampling.as_str()).collect();
    samplings.dedup();
    for sampling in samplings {
        let rows = front.rows.iter().filter(|row| row.row.sampling == sampling);
        chart = chart.with(Series::points(sampling, rows.map(|row| (row.price.node_s * 1e3, (figure.of)(row)))));
    }
    if let Some(direct) = figure.direct {
        chart = chart.with(Series::points("direct", [(front.direct.node_s * 1e3, direct)]));
    }
    let taken = front.planned.iter().filter_map(|planned| {
        let row = front.rows.iter().find(|row| planned.choice == Choice::Row(row.place));
        let y = figure.planned.map(|of| of(planned)).or_else(|| row.map(figure.of))?;
        Some(Point::labelled(planned.price.node_s * 1e3, y, planned.budget.to_string()))
    });
    chart = with_front(chart.with(Series::points("chosen by the planner", taken)), [Better::Low, figure.better]);
    chart.note = format!("Direct drawing costs {:.2} ms a view.", front.direct.node_s * 1e3);
    chart
}
