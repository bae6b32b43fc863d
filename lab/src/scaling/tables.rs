//! The tables of what was measured.

use cluster::{Costs, Policy, PolicyChoice};
use study::{Cell, Table};

use super::costs::efficiency;
use super::foretold::Foretold;
use super::matrix::{FEW_NODES, HEADLINE_VIEWS, PAPER_VIEWS};
use super::measured::{Lit, Measured};
use super::paper::{HEADLINE_S, table_1};
use super::point::Point;

/// A lighting with what was foretold of its points, one each.
pub struct Told<'a> {
    /// What was measured.
    pub lit: &'a Lit,
    /// In the order of its points.
    pub foretold: Vec<Foretold>,
    /// S.
    pub images: usize,
}

impl Told<'_> {
    /// (S·g_s + V·(c+e)) / (P·T) of a measured point.
    #[must_use]
    pub fn efficiency(&self, point: &Point) -> f64 {
        efficiency(&self.lit.mean(point.nodes), self.images, point.ask.views, point.nodes, point.period_s)
    }

    /// What was asked for and measured, images being cut as the schedule likes.
    #[must_use]
    pub fn find(&self, policy: PolicyChoice, nodes: usize, views: usize) -> Option<&Point> {
        let asked = |point: &&Point| (point.ask.policy, point.nodes, point.ask.views) == (policy, nodes, views);
        self.lit.points.iter().filter(|point| !point.ask.whole_images).find(asked)
    }

    /// P of all points, rising.
    #[must_use]
    pub fn node_counts(&self) -> Vec<usize> {
        let mut counts: Vec<usize> = self.lit.points.iter().map(|point| point.nodes).collect();
        counts.sort_unstable();
        counts.dedup();
        counts
    }
}

/// Table 1: efficiency at V = 1000, the paper's beside ours. `direct` where it was measured at most views.
pub fn paper_table(told: &Told<'_>) -> anyhow::Result<Table> {
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
    for nodes in told.node_counts() {
        let at = |policy| told.find(policy, nodes, PAPER_VIEWS);
        let (pipeline, auto) = (at(PolicyChoice::Pipeline), at(PolicyChoice::Auto));
        if pipeline.is_none() && auto.is_none() {
            continue;
        }
        let of = |point: Option<&Point>| point.map(|point| told.efficiency(point));
        let period = |point: Option<&Point>| point.map(|point| point.period_s);
        let direct = naive(told, nodes);
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
            direct.map(|(_, point)| point.ask.views).into(),
            period(direct.map(|(_, point)| point)).into(),
        ])?;
    }
    Ok(table)
}

/// Efficiency of `direct` at V = 1000, measured on the most views that it was measured on: T grows as V does.
#[must_use]
pub fn naive<'a>(told: &Told<'a>, nodes: usize) -> Option<(f64, &'a Point)> {
    let directs =
        told.lit.points.iter().filter(|point| point.ask.policy == PolicyChoice::Direct && point.nodes == nodes);
    let point = directs.max_by_key(|point| point.ask.views)?;
    let period_s = point.period_s * PAPER_VIEWS as f64 / point.ask.views as f64;
    Some((efficiency(&told.lit.mean(nodes), told.images, PAPER_VIEWS, nodes, period_s), point))
}

/// Every point, with what was foretold of it.
pub fn points_table(told: &Told<'_>) -> anyhow::Result<Table> {
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
    let mut table = Table::new(format!("All points, {}", told.lit.lighting), &columns);
    for (point, foretold) in told.lit.points.iter().zip(&told.foretold) {
        table.push([
            point.nodes.into(),
            point.ask.views.into(),
            point.ask.policy.to_string().into(),
            point.policy().to_string().into(),
            point.samplers().into(),
            point.ask.counted_sets.into(),
            point.period_s.into(),
            point.fill_s.into(),
            told.efficiency(point).into(),
            foretold.equation_s.into(),
            foretold.schedule_s.into(),
            foretold.simulated_s.into(),
            (foretold.simulated_s / point.period_s).into(),
            point.window.used_share().into(),
            (point.later_plans as f64).into(),
            point.window.others_cores().into(),
        ])?;
    }
    Ok(table)
}

/// One operation, by lighting and share of the machine.
pub fn costs_table(measured: &Measured, told: &[Told<'_>]) -> anyhow::Result<Table> {
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
    let mut push = |lighting: &str, nodes: usize, cores: f64, all: &[Costs]| {
        let mean = super::costs::mean(all);
        let ms =
            [mean.sample_image_s, mean.direct_view_s, mean.load_set_s, mean.reconstruct_view_s, mean.encode_view_s]
                .map(|seconds| Cell::from(seconds * 1e3));
        let ratio = (mean.reconstruct_view_s + mean.encode_view_s) / mean.sample_image_s;
        let c_ms = all.iter().map(|costs| costs.reconstruct_view_s * 1e3);
        let spread = format!("{:.1}–{:.1}", c_ms.clone().fold(f64::INFINITY, f64::min), c_ms.fold(0.0, f64::max));
        let head = [lighting.into(), nodes.into(), cores.into(), all.len().into()];
        table.push(head.into_iter().chain(ms).chain([ratio.into(), spread.into()]))
    };
    for told in told {
        for timed in &told.lit.timed {
            push(&told.lit.lighting.to_string(), timed.nodes, measured.quota_cores, &timed.costs)?;
        }
    }
    push(&measured.lit[0].lighting.to_string(), 1, measured.cores, &measured.unlimited)?;
    Ok(table)
}

/// What became of the nodes' processor time at the most views.
pub fn shares_table(told: &Told<'_>) -> anyhow::Result<Table> {
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
    for point in told.lit.points.iter().filter(|point| point.ask.views >= PAPER_VIEWS) {
        let (of_time, costs) = (1.0 / (point.nodes as f64 * point.period_s), told.lit.mean(point.nodes));
        let counts = match point.policy() {
            Policy::Direct => point.ask.views as f64 * (costs.direct_view_s + costs.encode_view_s) * of_time,
            _ => told.efficiency(point),
        };
        let loads = if point.policy() == Policy::Direct { 0 } else { point.compositors() };
        let loading = loads as f64 * costs.load_set_s * of_time;
        let used = point.window.used_share();
        table.push([
            point.nodes.into(),
            point.ask.views.into(),
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

/// The main steps of Fig. 6.
pub const STEPS: [&str; 6] = ["sampling", "transfer", "loading d", "reconstruction", "encoding", "client"];

/// Seconds of each for one set, added up over nodes; of the pipeline at so many nodes, by V.
#[must_use]
pub fn steps(told: &Told<'_>, nodes: usize) -> Vec<(usize, [f64; 6])> {
    let mut points: Vec<&Point> = told
        .lit
        .points
        .iter()
        .filter(|point| point.nodes == nodes && point.ask.policy == PolicyChoice::Pipeline)
        .collect();
    points.sort_by_key(|point| point.ask.views);
    let of = |point: &&Point| {
        // Who has no view of a set does not load it.
        let receivers = point.compositors().min(point.ask.views) as f64;
        let image_s = point.fetched.map_or(0.0, |image| image.image_s);
        let transfer_s = told.images as f64 * image_s * receivers;
        let Point { steps, .. } = point;
        let load_s = receivers * told.lit.mean(point.nodes).load_set_s;
        let all = [steps.sample_s, transfer_s, load_s, steps.reconstruct_s, steps.encode_s, steps.client_s];
        (point.ask.views, all)
    };
    points.iter().map(of).collect()
}

/// Fig. 6 as a table.
pub fn steps_table(told: &Told<'_>, nodes: usize) -> anyhow::Result<Table> {
    let columns: Vec<(&str, &str)> = [("V", "")].into_iter().chain(STEPS.map(|step| (step, "s"))).collect();
    let mut table = Table::new(format!("Fig. 6: main steps of one set, P = {nodes}, pipeline"), &columns);
    for (views, seconds) in steps(told, nodes) {
        table.push([views.into()].into_iter().chain(seconds.map(Cell::from)))?;
    }
    Ok(table)
}

/// 290 views by five nodes. What five whole machines would take follows from the costs without a limit.
pub fn headline_table(measured: &Measured, told: &Told<'_>) -> anyhow::Result<Table> {
    let mut table = Table::new("290 views by five nodes", &[("what", ""), ("time between sets", "s")]);
    table.push(["the paper, five GPUs".into(), HEADLINE_S.into()])?;
    let point = told.find(PolicyChoice::Pipeline, FEW_NODES, HEADLINE_VIEWS);
    if let Some(point) = point {
        let what = format!("measured, five nodes of {:.3} cores", measured.quota_cores);
        table.push([what.into(), point.period_s.into()])?;
        let whole = super::costs::mean(&measured.unlimited);
        let seconds =
            super::matrix::predicted_s(&whole, told.images, FEW_NODES, PolicyChoice::Pipeline, HEADLINE_VIEWS);
        let what = format!("predicted, five machines of {:.0} cores", measured.cores);
        table.push([what.into(), seconds.into()])?;
    }
    Ok(table)
}
