//! Tables, charts and checks of the study of plans.

use planner::{Budget, Row};
use report::{Axis, Bar, Check, Point, Report, Series, XyChart};

use super::defaults::DefaultRow;
use super::held_out::HeldOutPlan;
use super::table::TableRow;
use crate::pareto::{Better, with_front};
use crate::statistics::median_of;
use crate::study::{Column, table};

/// The median price of choices over that of the cheapest rows that keep their budgets, at most.
const MOST_PRICE_RATIO: f64 = 1.10;
/// The share of plans whose budgets are kept on views that they did not see, at least.
const LEAST_KEPT: f64 = 0.95;
/// The median time of a plan over that of 24 directly drawn views, at most.
const MOST_TIME_RATIO: f64 = 1.5;
/// The price of a default over that of the best row at the same quality, at most.
const MOST_DEFAULT_RATIO: f64 = 1.25;
/// Of charts.
const VIEWS_A_SET: usize = 290;

const PLAN_COLUMNS: [Column<HeldOutPlan>; 8] = [
    Column::new("scene", |plan| plan.scene.into()),
    Column::new("budget", |plan| plan.budget.to_string().into()),
    Column::new("V", |plan| plan.views_a_set.into()),
    Column::new("choice", |plan| plan.chosen.as_ref().map_or("none".to_owned(), ToString::to_string).into()),
    Column::with_unit("error over budget", "×", |plan| plan.error_over_budget.into()),
    Column::with_unit("price over cheapest", "×", |plan| plan.price_ratio.into()),
    Column::with_unit("time over 24 direct views", "×", |plan| plan.time_ratio.into()),
    Column::new("measurements", |plan| (plan.measurements as usize).into()),
];

const DEFAULT_COLUMNS: [Column<DefaultRow>; 4] = [
    Column::new("scene", |row| row.scene.into()),
    Column::new("V", |row| row.views_a_set.into()),
    Column::new("default", |row| row.row.to_string().into()),
    Column::with_unit("price over that of the best", "×", |row| row.price_ratio.into()),
];

/// The beginning of the names of tables of rows, and their columns that other commands read.
pub const ROWS: &str = "Rows, ";
pub const RECONSTRUCTION: &str = "reconstruction";
pub const COST: &str = "cost of a view";
pub const FOREGROUND_FLIP: &str = "foreground FLIP";

const ROW_COLUMNS: [Column<TableRow>; 7] = [
    Column::new("row", |row| row.row.to_string().into()),
    Column::new(RECONSTRUCTION, |row| method_of(&row.row).into()),
    Column::with_unit("g_s", "ms", |row| (row.costs.sample_image_s * 1e3).into()),
    Column::with_unit("d", "ms", |row| (row.costs.load_set_s * 1e3).into()),
    Column::with_unit("c", "ms", |row| (row.costs.view_s * 1e3).into()),
    Column::with_unit(COST, "ms", |row| (row.price_s(VIEWS_A_SET) * 1e3).into()),
    Column::new(FOREGROUND_FLIP, |row| row.error_ratio(&flip()).into()),
];

/// Adds a scene's table and chart.
///
/// # Errors
/// A row that does not fit its table.
pub fn add_scene(report: &mut Report, scene: &str, rows: &[TableRow]) -> anyhow::Result<()> {
    report.tables.push(table(format!("{ROWS}{scene}"), &ROW_COLUMNS, rows)?);
    let mut chart = XyChart::new(
        format!("Cost against error, {scene}"),
        Axis::log("nodes' time for a view", "ms"),
        Axis::linear("FLIP over surfaces", ""),
    );
    for (name, prefix) in [("shared light", "light_cache"), ("samples alone", ""), ("direct drawing", "direct")] {
        let own = rows.iter().filter(|row| family_of(&row.row) == prefix);
        let points = own
            .map(|row| Point::labelled(row.price_s(VIEWS_A_SET) * 1e3, row.error_ratio(&flip()), row.row.to_string()));
        chart = chart.with(Series::points(name, points));
    }
    report.charts.push(with_front(chart, [Better::Low, Better::Low]));
    Ok(())
}

/// Adds the plans of all scenes, and the checks.
///
/// # Errors
/// A row that does not fit its table.
pub fn add_plans(report: &mut Report, plans: &[HeldOutPlan]) -> anyhow::Result<()> {
    report.tables.push(table("Plans", &PLAN_COLUMNS, plans)?);
    let kept = plans.iter().filter(|plan| plan.error_over_budget <= 1.0).count() as f64 / plans.len().max(1) as f64;
    let price = median_of(plans, |plan| plan.price_ratio);
    let time = median_of(plans, |plan| plan.time_ratio);
    report.checks.extend([
        Check::new(
            "price over that of the cheapest row that keeps the budget, median",
            price,
            "×",
            Bar::AtMost(MOST_PRICE_RATIO),
        ),
        Check::new("budgets kept on views that no plan saw", kept, "", Bar::AtLeast(LEAST_KEPT)),
        Check::new("time of a plan over that of 24 direct views, median", time, "×", Bar::AtMost(MOST_TIME_RATIO)),
    ]);
    Ok(())
}

/// Adds the defaults of sessions without a budget, and a check of each.
///
/// # Errors
/// A row that does not fit its table.
pub fn add_defaults(report: &mut Report, rows: &[DefaultRow]) -> anyhow::Result<()> {
    report.tables.push(table("Defaults", &DEFAULT_COLUMNS, rows)?);
    report.checks.extend(rows.iter().map(|row| {
        let name = format!("default of {}, {} views a set: price over that of the best", row.scene, row.views_a_set);
        Check::new(name, row.price_ratio, "×", Bar::AtMost(MOST_DEFAULT_RATIO))
    }));
    Ok(())
}

fn method_of(row: &Row) -> &str {
    match row {
        Row::Direct { .. } => "direct",
        Row::Samples { method, .. } => method,
    }
}

fn family_of(row: &Row) -> &'static str {
    match row {
        Row::Direct { .. } => "direct",
        Row::Samples { method, .. } if method.starts_with("light_cache") => "light_cache",
        Row::Samples { .. } => "",
    }
}

fn flip() -> Budget {
    "flip 1".parse().expect("it is a budget")
}
