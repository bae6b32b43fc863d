//! Tables of measured points.

use cluster::{Costs, Policy, PolicyChoice};
use report::{Cell, Table};

use super::costs::mean;
use super::matrix::{FEW_NODES, HEADLINE_VIEWS, PAPER_VIEWS, predicted_s};
use super::measured::Measured;
use super::paper::{HEADLINE_S, table_1};
use super::point::Point;
use super::results::{Results, STEPS};

/// Table 1: efficiency at V = 1000, the paper's beside ours. `direct` is measured at fewer views.
pub fn paper_table(results: &Results<'_>) -> anyhow::Result<Table> {
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
        let (pipeline, auto) = (at(PolicyChoice::Pipeline), at(PolicyChoice::Auto));
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
pub fn points_table(results: &Results<'_>) -> anyhow::Result<Table> {
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
    let mut table = Table::new(format!("All points, {}", results.lit.lighting), &columns);
    for (point, prediction) in results.lit.points.iter().zip(&results.predictions) {
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

/// Costs of one operation, by lighting and share of the machine.
pub fn costs_table(measured: &Measured, all: &[Results<'_>]) -> anyhow::Result<Table> {
    let columns = [
        ("lighting", ""),
        ("nodes at the same time", ""),
        ("cores", ""),
        ("timings", ""),
        ("g_s", "ms"),
        ("g_v", "ms"),
        ("d", "ms"),
        ("c", "ms"),
        ("e", "ms"),
        ("(c + e) / g_s", ""),
        ("least and most c", "ms"),
    ];
    let mut table = Table::new("Costs of one operation on one node", &columns);
    let mut push = |lighting: &str, nodes: usize, cores: f64, timings: &[Costs]| {
        let mean_costs = mean(timings);
        let ms = [
            mean_costs.sample_image_s,
            mean_costs.direct_view_s,
            mean_costs.load_set_s,
            mean_costs.reconstruct_view_s,
            mean_costs.encode_view_s,
        ]
        .map(|seconds| Cell::from(seconds * 1e3));
        let ratio = (mean_costs.reconstruct_view_s + mean_costs.encode_view_s) / mean_costs.sample_image_s;
        let c_ms = timings.iter().map(|costs| costs.reconstruct_view_s * 1e3);
        let spread = format!("{:.1}–{:.1}", c_ms.clone().fold(f64::INFINITY, f64::min), c_ms.fold(0.0, f64::max));
        let head = [lighting.into(), nodes.into(), cores.into(), timings.len().into()];
        table.push(head.into_iter().chain(ms).chain([ratio.into(), spread.into()]))
    };
    for results in all {
        for timed in &results.lit.timed {
            push(&results.lit.lighting.to_string(), timed.nodes, measured.quota_cores, &timed.costs)?;
        }
    }
    push(&measured.lit[0].lighting.to_string(), 1, measured.cores, &measured.unlimited)?;
    Ok(table)
}

/// The uses of the nodes' processor time, at the most views.
pub fn shares_table(results: &Results<'_>) -> anyhow::Result<Table> {
    let columns = [
        ("P", ""),
        ("V", ""),
        ("policy", ""),
        ("work that counts", ""),
        ("loading sets", ""),
        ("all else", ""),
        ("not used", ""),
        ("client", "cores"),
        ("periods stopped, compositors", ""),
    ];
    let mut table = Table::new("Where the nodes' processor time goes", &columns);
    for point in results.lit.points.iter().filter(|point| point.settings.views >= PAPER_VIEWS) {
        let (of_time, costs) = (1.0 / (point.nodes as f64 * point.period_s), results.lit.mean(point.nodes));
        let counts = match point.policy() {
            Policy::Direct => point.settings.views as f64 * (costs.direct_view_s + costs.encode_view_s) * of_time,
            _ => results.efficiency(point),
        };
        let loads = if point.policy() == Policy::Direct { 0 } else { point.compositors() };
        let loading = loads as f64 * costs.load_set_s * of_time;
        let used = point.window.used_share();
        table.push([
            point.nodes.into(),
            point.settings.views.into(),
            point.policy().to_string().into(),
            counts.into(),
            loading.into(),
            (used - counts - loading).into(),
            (1.0 - used).into(),
            (point.steps.client_s / point.period_s).into(),
            point.throttled_share().into(),
        ])?;
    }
    Ok(table)
}

/// Fig. 6 as a table.
pub fn steps_table(results: &Results<'_>, nodes: usize) -> anyhow::Result<Table> {
    let columns: Vec<(&str, &str)> = [("V", "")].into_iter().chain(STEPS.map(|step| (step, "s"))).collect();
    let mut table = Table::new(format!("Fig. 6: main steps of one set, P = {nodes}, pipeline"), &columns);
    for (views, seconds) in results.steps(nodes) {
        table.push([views.into()].into_iter().chain(seconds.map(Cell::from)))?;
    }
    Ok(table)
}

/// 290 views by five nodes; five whole machines are predicted from the costs without a limit.
pub fn headline_table(measured: &Measured, results: &Results<'_>) -> anyhow::Result<Table> {
    let mut table = Table::new("290 views by five nodes", &[("what", ""), ("time between sets", "s")]);
    table.push(["the paper, five GPUs".into(), HEADLINE_S.into()])?;
    let point = results.find(PolicyChoice::Pipeline, FEW_NODES, HEADLINE_VIEWS);
    if let Some(point) = point {
        let what = format!("measured, five nodes of {:.3} cores", measured.quota_cores);
        table.push([what.into(), point.period_s.into()])?;
        let whole = mean(&measured.unlimited);
        let seconds = predicted_s(&whole, results.images, FEW_NODES, PolicyChoice::Pipeline, HEADLINE_VIEWS);
        let what = format!("predicted, five machines of {:.0} cores", measured.cores);
        table.push([what.into(), seconds.into()])?;
    }
    Ok(table)
}
