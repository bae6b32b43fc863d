//! Tables and charts of simulated clusters.

use std::time::Instant;

use cluster::Costs;
use coordinator::schedule::{Demand, Load, NodeCosts, PolicyOverride, choose};
use report::{Axis, Chart, Series, Table, XyChart};
use simulation::spread_speeds;

use super::sweep::{Basis, Scenario, Simulated, VIEWS, reach};

/// The least efficiency that counts as scaling.
const BAR: f64 = 0.8;
/// The number of views V of the charts.
const CHARTED_VIEWS: usize = 100_000;

/// A table of all simulated points.
pub fn sweep_table(scenarios: &[Scenario], points: &[Simulated]) -> anyhow::Result<Table> {
    let columns = [
        ("device", ""),
        ("scenario", ""),
        ("V", ""),
        ("P", ""),
        ("policy", ""),
        ("K", ""),
        ("T", "s"),
        ("efficiency", ""),
        ("limit", ""),
    ];
    let mut table = Table::new(SWEEP_TABLE, &columns);
    for point in points {
        let scenario = &scenarios[point.scenario];
        table.push([
            scenario.device.as_str().into(),
            scenario.name.as_str().into(),
            point.views.into(),
            point.nodes.into(),
            point.policy.to_string().into(),
            point.samplers.into(),
            point.period_s.into(),
            point.efficiency.into(),
            point.limit.to_string().into(),
        ])?;
    }
    Ok(table)
}

/// The name of that table, which is too long for a terminal.
pub const SWEEP_TABLE: &str = "Simulated points";

/// The number of nodes up to which each scenario scales, and its limit beyond.
pub fn reach_table(scenarios: &[Scenario], points: &[Simulated]) -> anyhow::Result<Table> {
    let columns = [
        ("device", ""),
        ("scenario", ""),
        ("V", ""),
        ("P up to which efficiency is 0.8", ""),
        ("P beyond", ""),
        ("efficiency there", ""),
        ("policy there", ""),
        ("limit there", ""),
    ];
    let mut table = Table::new("How far it scales, simulated", &columns);
    for (number, scenario) in scenarios.iter().enumerate() {
        for views in VIEWS {
            let (last, beyond) = reach(points, number, views, BAR);
            table.push([
                scenario.device.as_str().into(),
                scenario.name.as_str().into(),
                views.into(),
                last.into(),
                beyond.as_ref().map(|point| point.nodes).into(),
                beyond.as_ref().map(|point| point.efficiency).into(),
                beyond.as_ref().map(|point| point.policy.to_string()).into(),
                beyond.as_ref().map(|point| point.limit.to_string()).into(),
            ])?;
        }
    }
    Ok(table)
}

/// Efficiency by P: a chart for each device, and one for all other scenarios.
#[must_use]
pub fn charts(scenarios: &[Scenario], points: &[Simulated]) -> Vec<Chart> {
    let mut devices: Vec<&str> = scenarios.iter().map(|scenario| scenario.device.as_str()).collect();
    devices.dedup();
    devices.sort_unstable();
    devices.dedup();
    let plain = |scenario: &Scenario| scenario.name.contains("Gbit");
    let of_device = devices.iter().map(|device| {
        let name = format!("Simulated efficiency, V = {CHARTED_VIEWS}, {device}");
        chart(name, scenarios, points, |scenario| scenario.device == *device && plain(scenario))
    });
    let others = chart(
        format!("Simulated efficiency, V = {CHARTED_VIEWS}, unequal nodes and expensive lighting"),
        scenarios,
        points,
        |scenario| !plain(scenario),
    );
    of_device.chain([others]).map(Into::into).collect()
}

fn chart(name: String, scenarios: &[Scenario], points: &[Simulated], is_in: impl Fn(&Scenario) -> bool) -> XyChart {
    let mut chart = XyChart::new(name, Axis::log("nodes P", ""), Axis::linear("efficiency", "")).with_limit("0.8", BAR);
    for (number, scenario) in scenarios.iter().enumerate().filter(|(_, scenario)| is_in(scenario)) {
        let of = points.iter().filter(|point| point.scenario == number && point.views == CHARTED_VIEWS);
        let mut of: Vec<_> = of.map(|point| (point.nodes as f64, point.efficiency)).collect();
        of.sort_by(|a, b| a.0.total_cmp(&b.0));
        chart = chart.with(Series::line(scenario.name.as_str(), of));
    }
    chart.note =
        "Simulated, not measured: the real schedule's plans, carried out by the simulation that is held against \
                  the measured points."
            .to_owned();
    chart
}

/// Milliseconds of one decision of the schedule.
pub fn decisions_table(basis: &Basis, views: usize) -> anyhow::Result<Table> {
    let columns = [("P", ""), ("equal nodes", "ms"), ("unequal nodes", "ms")];
    let mut table = Table::new("Time of one decision of the schedule", &columns);
    for nodes in [11, 100, 1000] {
        let ms = |speeds: &[f64]| decision_s(&basis.plain, basis.images, speeds, views) * 1e3;
        table.push([nodes.into(), ms(&vec![1.0; nodes]).into(), ms(&spread_speeds(nodes, 4.0, 11)).into()])?;
    }
    Ok(table)
}

fn decision_s(costs: &Costs, images: usize, speeds: &[f64], views: usize) -> f64 {
    let node =
        |&speed: &f64| NodeCosts { costs: simulation::Machine::of(*costs).faster(speed).costs, transfer_image_s: None };
    let nodes: Vec<_> = speeds.iter().map(node).collect();
    let load = Load { images, sets: 2, views, ..Load::default() };
    let policy_override = PolicyOverride::default();
    let start = Instant::now();
    let chosen = choose(&Demand { load, nodes: &nodes, policy_override, current: None });
    let seconds = start.elapsed().as_secs_f64();
    chosen.map_or(f64::NAN, |_| seconds)
}

/// A sentence for each scenario.
#[must_use]
pub fn summary(scenarios: &[Scenario], points: &[Simulated]) -> String {
    let sentence = |number: usize| {
        let scenario = &scenarios[number];
        let (last, beyond) = reach(points, number, CHARTED_VIEWS, BAR);
        let last = last.map_or_else(|| "no".to_owned(), |last| last.to_string());
        let why = beyond.map_or_else(
            || "and no limit is met".to_owned(),
            |point| format!("at {} the limit is {} ({:.2})", point.nodes, point.limit, point.efficiency),
        );
        format!("{}, {}: {last} nodes reach {BAR}, {why}.", scenario.device, scenario.name)
    };
    (0..scenarios.len()).map(sentence).collect::<Vec<_>>().join(" ")
}
