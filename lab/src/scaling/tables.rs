//! Tables of measured points.

use cluster::{Costs, PolicyChoice};
use report::{Cell, Table};

use super::costs::mean;
use super::matrix::{FEW_NODES, HEADLINE_VIEWS, PAPER_VIEWS, predicted_s};
use super::paper::{HEADLINE_S, table_1};
use super::point::Point;
use super::results::{PredictedPoint, Results};

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
        let at = |policy| results.find(policy, nodes, PAPER_VIEWS);
        let pipeline = at(PolicyChoice::Pipeline);
        let auto = at(PolicyChoice::Auto);
        if pipeline.is_none() && auto.is_none() {
            continue;
        }
        let of = |point: Option<&Point>| point.map(|point| results.efficiency(point));
        let period = |point: Option<&Point>| point.map(|point| point.period_s);
        let direct = results.naive(nodes);
        table.push([
            nodes.into(),
            table_1(nodes).map(|row| row.proposed).into(),
            of(pipeline).into(),
            pipeline.map(Point::samplers).into(),
            period(pipeline).into(),
            of(auto).into(),
            auto.map(|point| point.policy().to_string()).into(),
            period(auto).into(),
            table_1(nodes).map(|row| row.naive).into(),
            direct.map(|(efficiency, _)| efficiency).into(),
            direct.map(|(_, point)| point.settings.views).into(),
            period(direct.map(|(_, point)| point)).into(),
        ])?;
    }
    Ok(table)
}

/// A table of all points with their predictions.
pub fn points_table(results: &Results) -> anyhow::Result<Table> {
    let columns = [
        ("P", ""),
        ("V", ""),
        ("asked for", ""),
        ("policy", ""),
        ("K", ""),
        ("sets counted", ""),
        ("T", "s"),
        ("first set", "s"),
        ("efficiency", ""),
        ("equation", "s"),
        ("schedule", "s"),
        ("simulated", "s"),
        ("simulated / T", ""),
        ("used of quotas", ""),
        ("changes of plan", ""),
        ("other programs", "cores"),
    ];
    let mut table = Table::new(format!("All points, {}", results.lighting), &columns);
    for PredictedPoint { point, prediction } in &results.points {
        table.push([
            point.nodes.into(),
            point.settings.views.into(),
            point.settings.policy.to_string().into(),
            point.policy().to_string().into(),
            point.samplers().into(),
            point.settings.counted_sets.into(),
            point.period_s.into(),
            point.fill_s.into(),
            results.efficiency(point).into(),
            prediction.equation_s.into(),
            prediction.schedule_s.into(),
            prediction.simulated_s.into(),
            (prediction.simulated_s / point.period_s).into(),
            point.window.used_share().into(),
            (point.later_plans as f64).into(),
            point.window.others_cores().into(),
        ])?;
    }
    Ok(table)
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
    let limited = results.timed.iter().map(|timed| (timed.nodes, results.quota_cores, &timed.costs));
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
        let c_ms = |costs: &Costs| costs.reconstruct_view_s * 1e3;
        let least_ms = timings.iter().map(c_ms).fold(f64::INFINITY, f64::min);
        let most_ms = timings.iter().map(c_ms).fold(0.0, f64::max);
        let numbers = seconds.map(|seconds| seconds * 1e3).into_iter().chain([ratio, least_ms, most_ms]);
        let head = [nodes.into(), cores.into(), timings.len().into()];
        table.push(head.into_iter().chain(numbers.map(Cell::from)))?;
    }
    Ok(table)
}

/// 290 views by five nodes; five whole machines are predicted from the costs without a limit.
pub fn headline_table(results: &Results) -> anyhow::Result<Table> {
    let mut table = Table::new("290 views by five nodes", &[("what", ""), ("time between sets", "s")]);
    table.push(["the paper, five GPUs".into(), HEADLINE_S.into()])?;
    let point = results.find(PolicyChoice::Pipeline, FEW_NODES, HEADLINE_VIEWS);
    if let Some(point) = point {
        let what = format!("measured, five nodes of {:.3} cores", results.quota_cores);
        table.push([what.into(), point.period_s.into()])?;
        let whole = mean(&results.unlimited);
        let seconds = predicted_s(&whole, results.images, FEW_NODES, PolicyChoice::Pipeline, HEADLINE_VIEWS);
        let what = format!("predicted, five machines of {:.0} cores", results.cores);
        table.push([what.into(), seconds.into()])?;
    }
    Ok(table)
}
