//! Tables of measured points.

use cluster::PolicyChoice;
use report::{Cell, Table};

use super::costs::mean;
use super::matrix::{FEW_NODES, HEADLINE_VIEWS, PAPER_VIEWS, predicted_s};
use super::paper::{HEADLINE_S, table_1};
use super::point::Point;
use super::prediction::Prediction;
use super::results::{PredictedPoint, Results};
use crate::study::{Column, table};

/// Table 1: efficiency at V = 1000, the paper's beside ours. `direct` is measured at fewer views.
pub fn paper_table(results: &Results) -> anyhow::Result<Table> {
    let columns = [
        ("P", ""),
        ("proposed, paper", ""),
        ("pipeline", ""),
        ("K", ""),
        ("pipeline T", "s"),
        ("auto", ""),
        ("auto is", ""),
        ("auto T", "s"),
        ("naive, paper", ""),
        ("direct", ""),
        ("direct at V", ""),
        ("direct T", "s"),
    ];
    let mut table = Table::new("Table 1: efficiency at V = 1000", &columns);
    for nodes in results.node_counts() {
        let [pipeline, auto] =
            [PolicyChoice::Pipeline, PolicyChoice::Auto].map(|policy| results.find(policy, nodes, PAPER_VIEWS));
        if pipeline.is_none() && auto.is_none() {
            continue;
        }
        let direct = results.naive(nodes);
        let efficiencies = [pipeline, auto].map(|point| point.map(|point| results.efficiency(point)));
        let periods_s = [pipeline, auto, direct.map(|(_, point)| point)].map(|point| point.map(|point| point.period_s));
        table.push([
            nodes.into(),
            table_1(nodes).map(|row| row.proposed).into(),
            efficiencies[0].into(),
            pipeline.map(Point::samplers).into(),
            periods_s[0].into(),
            efficiencies[1].into(),
            auto.map(|point| point.policy().to_string()).into(),
            periods_s[1].into(),
            table_1(nodes).map(|row| row.naive).into(),
            direct.map(|(efficiency, _)| efficiency).into(),
            direct.map(|(_, point)| point.settings.views).into(),
            periods_s[2].into(),
        ])?;
    }
    Ok(table)
}

/// A point with its predictions and its efficiency.
struct PointRow<'r> {
    point: &'r Point,
    prediction: &'r Prediction,
    efficiency: f64,
}

fn point_columns<'r>() -> [Column<PointRow<'r>>; 16] {
    [
        Column::new("P", |row| row.point.nodes.into()),
        Column::new("V", |row| row.point.settings.views.into()),
        Column::new("asked for", |row| row.point.settings.policy.to_string().into()),
        Column::new("policy", |row| row.point.policy().to_string().into()),
        Column::new("K", |row| row.point.samplers().into()),
        Column::new("sets counted", |row| row.point.settings.counted_sets.into()),
        Column::with_unit("T", "s", |row| row.point.period_s.into()),
        Column::with_unit("first set", "s", |row| row.point.fill_s.into()),
        Column::new("efficiency", |row| row.efficiency.into()),
        Column::with_unit("equation", "s", |row| row.prediction.equation_s.into()),
        Column::with_unit("schedule", "s", |row| row.prediction.schedule_s.into()),
        Column::with_unit("simulated", "s", |row| row.prediction.simulated_s.into()),
        Column::new("simulated / T", |row| (row.prediction.simulated_s / row.point.period_s).into()),
        Column::new("used of quotas", |row| row.point.window.used_share().into()),
        Column::new("changes of plan", |row| (row.point.later_plans as f64).into()),
        Column::with_unit("other programs", "cores", |row| row.point.window.others_cores().into()),
    ]
}

/// A table of all points with their predictions.
pub fn points_table(results: &Results) -> anyhow::Result<Table> {
    let rows = results.points.iter().map(|PredictedPoint { point, prediction }| PointRow {
        point,
        prediction,
        efficiency: results.efficiency(point),
    });
    let rows: Vec<PointRow<'_>> = rows.collect();
    table(format!("All points, {}", results.lighting), &point_columns(), &rows)
}

/// Costs of one operation, by share of the machine.
pub fn costs_table(results: &Results) -> anyhow::Result<Table> {
    let columns = [
        ("nodes at the same time", ""),
        ("cores", ""),
        ("timings", ""),
        ("g_s", "ms"),
        ("g_v", "ms"),
        ("d", "ms"),
        ("c", "ms"),
        ("e", "ms"),
        ("(c + e) / g_s", ""),
        ("least c", "ms"),
        ("most c", "ms"),
    ];
    let mut table = Table::new("Costs of one operation on one node", &columns);
    let limited = results.timed.iter().map(|timed| (timed.nodes, timed.quota_cores, &timed.costs));
    for (nodes, cores, timings) in limited.chain([(1, results.cores, &results.unlimited)]) {
        let costs = mean(timings);
        let seconds = [
            costs.sample_image_s,
            costs.direct_view_s,
            costs.load_set_s,
            costs.reconstruct_view_s,
            costs.encode_view_s,
        ];
        let ratio = (costs.reconstruct_view_s + costs.encode_view_s) / costs.sample_image_s;
        let c_ms = timings.iter().map(|costs| costs.reconstruct_view_s * 1e3);
        let least_ms = c_ms.clone().fold(f64::INFINITY, f64::min);
        let most_ms = c_ms.fold(0.0, f64::max);
        let numbers = seconds.map(|seconds| seconds * 1e3).into_iter().chain([ratio, least_ms, most_ms]);
        let head = [nodes.into(), cores.into(), timings.len().into()];
        table.push(head.into_iter().chain(numbers.map(Cell::from)))?;
    }
    Ok(table)
}

/// Costs by size of the set.
pub fn set_costs_table(results: &Results) -> anyhow::Result<Table> {
    let columns = [("S", ""), ("density", ""), ("S g_s", "s"), ("d", "ms"), ("c", "ms")];
    let mut table = Table::new("Costs of sets of light on one node without a limit", &columns);
    for (set, costs) in &results.sets {
        table.push([
            set.images.into(),
            set.density.into(),
            (set.images as f64 * costs.sample_image_s).into(),
            (costs.load_set_s * 1e3).into(),
            (costs.reconstruct_view_s * 1e3).into(),
        ])?;
    }
    Ok(table)
}

/// 290 views by five nodes; five whole machines are predicted from the costs without a limit.
pub fn headline_table(results: &Results) -> anyhow::Result<Table> {
    let mut table = Table::new("290 views by five nodes", &[("what", ""), ("time between sets", "s")]);
    table.push(["the paper, five GPUs".into(), HEADLINE_S.into()])?;
    let point = results.find(PolicyChoice::Pipeline, FEW_NODES, HEADLINE_VIEWS);
    if let Some(point) = point {
        let quota_cores = point.window.quotas_s / (point.nodes as f64 * point.window.seconds);
        let what = format!("measured, five nodes of {quota_cores:.3} cores");
        table.push([what.into(), point.period_s.into()])?;
        let whole = mean(&results.unlimited);
        let seconds = predicted_s(&whole, results.set.images, FEW_NODES, PolicyChoice::Pipeline, HEADLINE_VIEWS);
        let what = format!("predicted, five machines of {:.0} cores", results.cores);
        table.push([what.into(), seconds.into()])?;
    }
    Ok(table)
}
