//! Tables and charts of fronts.

use planner::{Choice, Metric, Price};
use report::{Axis, Better, Cell, Point, Report, Series, Table, XyChart};

use super::measure::{Front, Planned};
use super::row::{CLASSES, MeasuredRow};

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

/// Adds a subject's tables and charts.
///
/// # Errors
/// A row that does not fit its table.
pub fn add_to(report: &mut Report, front: &Front) -> anyhow::Result<()> {
    let name = &front.conditions.name;
    report.parameter(format!("{name}: scene"), front.scene_hash.as_str());
    report.parameter(format!("{name}: rows left out"), front.left_out);
    report.tables.push(rows_table(&format!("{ROWS}{name}"), &front.rows, front.direct)?);
    if let Some(direct) = front.antialiased_direct {
        let title = format!("Rows of the front with four samples a pixel, {name}");
        report.tables.push(rows_table(&title, &front.antialiased, direct)?);
    }
    if !front.planned.is_empty() {
        report.tables.push(planned_table(front)?);
    }
    report.charts.extend(FIGURES.iter().map(|figure| chart(front, figure).into()));
    Ok(())
}

/// The figures of rows, and of direct drawing.
///
/// # Errors
/// A row that does not fit the table.
pub fn rows_table(name: &str, rows: &[MeasuredRow], direct: Price) -> anyhow::Result<Table> {
    let columns = [
        ("sampling", ""),
        ("S", ""),
        ("side", ""),
        (RECONSTRUCTION, ""),
        (COST, "ms"),
        ("g_s", "ms"),
        ("d", "ms"),
        ("c", "ms"),
        ("set", "kB"),
        ("samples", ""),
        (FOREGROUND_FLIP, ""),
        ("FLIP", ""),
        ("foreground PSNR", "dB"),
        ("foreground SSIM", ""),
        (CLASSES[0].1, ""),
        (CLASSES[1].1, ""),
        (CLASSES[2].1, ""),
        ("disocclusion", "%"),
        ("wrong hits", "%"),
        ("filled", "%"),
    ];
    let mut table = Table::new(name, &columns);
    for row in rows {
        let head = [
            Cell::from(row.row.sampling.clone()),
            (row.row.camera_count as usize).into(),
            row.row.side_ratio.into(),
            row.row.method.clone().into(),
        ];
        let costs = [row.costs.sample_image_s, row.costs.load_set_s, row.costs.reconstruct_view_s];
        let numbers = [
            row.price.node_s * 1e3,
            costs[0] * 1e3,
            costs[1] * 1e3,
            costs[2] * 1e3,
            row.set_bytes as f64 / 1e3,
            row.samples as f64,
            row.error_ratio(Metric::Flip),
            row.error_ratio(Metric::FlipWhole),
            row.psnr_db(),
        ];
        let pictures =
            [row.ssim].into_iter().chain(row.class_flips).map(|figure| figure.map_or(Cell::Missing, Cell::from));
        let shares = [row.error_ratio(Metric::Disocclusion), row.wrong_hits, row.filled];
        let shares = shares.map(|share| Cell::from(100.0 * share));
        table.push(head.into_iter().chain(numbers.map(Cell::from)).chain(pictures).chain(shares))?;
    }
    let direct = [Cell::from("direct"), Cell::Missing, Cell::Missing, Cell::Missing, (direct.node_s * 1e3).into()];
    table.push(direct.into_iter().chain(vec![Cell::Missing; columns.len() - 5]))?;
    Ok(table)
}

fn planned_table(front: &Front) -> anyhow::Result<Table> {
    let columns = [
        ("budget", ""),
        ("choice", ""),
        ("cost of a view", "ms"),
        ("expected error", ""),
        ("time of the plan", "s"),
        ("the front's cost within the budget", "ms"),
    ];
    let mut table = Table::new(format!("Plans, {}", front.conditions.name), &columns);
    for planned in &front.planned {
        table.push([
            Cell::from(planned.budget.to_string()),
            planned.name.clone().into(),
            (planned.price.node_s * 1e3).into(),
            planned.error_ratio.into(),
            planned.spent_s.into(),
            (cheapest_s(front, planned) * 1e3).into(),
        ])?;
    }
    Ok(table)
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
    chart = chart.with(Series::points("chosen by the planner", taken)).with_front(Better::Low, figure.better);
    chart.note = format!("Direct drawing costs {:.2} ms a view.", front.direct.node_s * 1e3);
    chart
}
