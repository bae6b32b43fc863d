//! The simulation beyond measured points: to 1,000 nodes and 100,000 views, on networks of several speeds.

use cluster::{Costs, Policy, PolicyChoice};
use rayon::prelude::*;
use report::{Axis, Series, Table, XyChart};
use simulation::{Cluster, Demand, Habits, Limit, Machine, plan, run, spread_speeds};

use super::costs::{efficiency, mean};
use super::prediction::Traffic;
use super::results::Results;
use super::subject::SetSize;
use crate::study::Column;

/// Numbers of nodes, P.
const NODES: [usize; 9] = [2, 5, 11, 20, 50, 100, 200, 500, 1000];
/// Numbers of views, V.
pub const VIEWS: [usize; 3] = [1_000, 10_000, 100_000];
/// Numbers of views at which sizes of sets are compared.
pub const SET_VIEWS: [usize; 2] = [24, 1_000];
/// The number of views V of the chart.
const CHARTED_VIEWS: usize = 100_000;
/// The least efficiency that counts as scaling.
const LEAST_EFFICIENCY: f64 = 0.8;
/// Speeds of links, each way.
const GBITS: [f64; 3] = [1.0, 10.0, 100.0];
/// Bytes a second of a link of 1 Gbit/s.
const BYTES_PER_S_A_GBIT: f64 = 1.25e8;
/// Sets of one run: enough for a steady state between filling and draining.
const SETS: u32 = 14;
/// The speed of the fastest node over the slowest, where nodes differ.
const UNEQUAL_RATIO: f64 = 4.0;
const SEED: u64 = 11;
/// The speed of a device that stands for a graphics processor, over this machine's.
const FAST: f64 = 30.0;

/// A cluster to simulate, beside P and V.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    name: String,
    costs: Costs,
    /// The number of sample images, S, and the bytes of one.
    images: usize,
    image_bytes: f64,
    /// The speed of every link.
    gbit_per_s: f64,
    /// True where the speeds of nodes differ.
    is_unequal: bool,
}

/// One simulated point.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    scenario: String,
    nodes: usize,
    views: usize,
    /// The policy that `auto` chose.
    policy: Policy,
    samplers: usize,
    /// The time between two sets, T.
    period_s: f64,
    /// Efficiency as at measured points; for unequal nodes over the sum of their speeds.
    efficiency: f64,
    limit: Limit,
}

/// All scenarios, by this machine's costs without a limit.
pub fn scenarios(results: &Results) -> Vec<Scenario> {
    let costs = mean(&results.unlimited);
    let mut all = Vec::new();
    for (device, speed) in [("this machine".to_owned(), 1.0), (format!("{FAST:.0} times as fast"), FAST)] {
        let costs = Machine::of(costs).faster(speed).costs;
        all.extend(GBITS.map(|gbit_per_s| Scenario {
            name: format!("{device}, {gbit_per_s:.0} Gbit/s"),
            gbit_per_s,
            ..Scenario::new(results, costs)
        }));
    }
    let name = "this machine, unequal nodes, 10 Gbit/s".to_owned();
    all.push(Scenario { name, is_unequal: true, ..Scenario::new(results, costs) });
    all
}

/// Sets of every size on equal nodes.
pub fn set_scenarios(results: &Results) -> Vec<Scenario> {
    let scenarios = results.sets.iter().map(|(set, costs)| Scenario {
        name: scenario_name(*set),
        images: set.images,
        image_bytes: results.traffic.image_bytes * f64::from(set.density / results.set.density).powi(2),
        ..Scenario::new(results, *costs)
    });
    scenarios.collect()
}

impl Scenario {
    /// Equal nodes on a network of 10 Gbit/s.
    fn new(results: &Results, costs: Costs) -> Self {
        Self {
            name: String::new(),
            costs,
            images: results.set.images,
            image_bytes: results.traffic.image_bytes,
            gbit_per_s: 10.0,
            is_unequal: false,
        }
    }
}

/// Simulates all scenarios at all P and V, many at the same time.
pub fn sweep(results: &Results, scenarios: &[Scenario], views: &[usize], most_nodes: usize) -> Vec<Simulated> {
    let points = scenarios.iter().flat_map(|scenario| {
        let nodes = NODES.into_iter().filter(move |&nodes| nodes <= most_nodes);
        nodes.flat_map(move |nodes| views.iter().map(move |&views| (scenario, nodes, views)))
    });
    let points: Vec<_> = points.collect();
    points.into_par_iter().filter_map(|(scenario, nodes, views)| simulated(results, scenario, nodes, views)).collect()
}

fn simulated(results: &Results, scenario: &Scenario, nodes: usize, views: usize) -> Option<Simulated> {
    let bytes_per_s = scenario.gbit_per_s * BYTES_PER_S_A_GBIT;
    let machine = Machine { bytes_per_s, ..Machine::of(scenario.costs) };
    let traffic = Traffic { image_bytes: scenario.image_bytes, ..results.traffic };
    let equal = traffic.cluster(nodes, machine, scenario.images);
    let speeds = if scenario.is_unequal { spread_speeds(nodes, UNEQUAL_RATIO, SEED) } else { vec![1.0; nodes] };
    let machines = equal.machines.iter().zip(&speeds).map(|(machine, &speed)| machine.faster(speed)).collect();
    let cluster = Cluster { machines, ..equal };
    let demand = Demand { views, sets: SETS, policy: PolicyChoice::Auto, tiles: None, nodes_report: true };
    let planned = plan(&cluster, &demand)?;
    // Groups of nodes sample sets in turn: all of them several times.
    let groups = planned.sampler_count() / scenario.images.max(1);
    let run = run(&cluster, &planned, views, SETS + 3 * groups as u32, Habits::default());
    let period_s = run.steady_period_s();
    let speed: f64 = speeds.iter().sum();
    Some(Simulated {
        scenario: scenario.name.clone(),
        nodes,
        views,
        policy: planned.assignment.policy,
        samplers: planned.sampler_count(),
        period_s,
        efficiency: efficiency(&scenario.costs, scenario.images, views, 1, speed * period_s),
        limit: run.limit(),
    })
}

/// The name of the table of all points, which is too long for a terminal.
pub const SWEEP_TABLE: &str = "Simulated points";

/// The columns of the table of all points.
pub const COLUMNS: [Column<Simulated>; 8] = [
    Column::new("scenario", |point| point.scenario.as_str().into()),
    Column::new("V", |point| point.views.into()),
    Column::new("P", |point| point.nodes.into()),
    Column::new("policy", |point| point.policy.to_string().into()),
    Column::new("K", |point| point.samplers.into()),
    Column::with_unit("T", "s", |point| point.period_s.into()),
    Column::new("efficiency", |point| point.efficiency.into()),
    Column::new("limit", |point| point.limit.to_string().into()),
];

/// The number of nodes up to which each scenario scales, and the first point beyond with its limit.
pub fn reach_table(scenarios: &[Scenario], points: &[Simulated]) -> anyhow::Result<Table> {
    let columns = [
        ("scenario", ""),
        ("V", ""),
        ("P up to which efficiency is 0.8", ""),
        ("P beyond", ""),
        ("efficiency there", ""),
        ("policy there", ""),
        ("limit there", ""),
    ];
    let mut table = Table::new("How far it scales, simulated", &columns);
    for (scenario, views) in scenarios.iter().flat_map(|scenario| VIEWS.map(|views| (scenario, views))) {
        // Points are in the order of P.
        let all = points.iter().filter(|point| point.scenario == scenario.name && point.views == views);
        let last = all.clone().take_while(|point| point.efficiency >= LEAST_EFFICIENCY).last();
        let beyond = all.clone().find(|point| point.efficiency < LEAST_EFFICIENCY);
        table.push([
            scenario.name.as_str().into(),
            views.into(),
            last.map(|point| point.nodes).into(),
            beyond.map(|point| point.nodes).into(),
            beyond.map(|point| point.efficiency).into(),
            beyond.map(|point| point.policy.to_string()).into(),
            beyond.map(|point| point.limit.to_string()).into(),
        ])?;
    }
    Ok(table)
}

/// The set of least T at each P and V, beside the one of the measured points.
pub fn cheapest_sets(results: &Results, points: &[Simulated]) -> anyhow::Result<Table> {
    let columns = [
        ("V", ""),
        ("P", ""),
        ("cheapest set", ""),
        ("policy", ""),
        ("K", ""),
        ("T", "s"),
        ("T of the measured set", "s"),
    ];
    let mut table = Table::new("Cheapest sets, simulated", &columns);
    let measured = scenario_name(results.set);
    for (views, nodes) in SET_VIEWS.into_iter().flat_map(|views| NODES.map(|nodes| (views, nodes))) {
        let all: Vec<&Simulated> = points.iter().filter(|point| point.views == views && point.nodes == nodes).collect();
        let Some(cheapest) = all.iter().min_by(|a, b| a.period_s.total_cmp(&b.period_s)) else { continue };
        table.push([
            views.into(),
            nodes.into(),
            cheapest.scenario.as_str().into(),
            cheapest.policy.to_string().into(),
            cheapest.samplers.into(),
            cheapest.period_s.into(),
            all.iter().find(|point| point.scenario == measured).map(|point| point.period_s).into(),
        ])?;
    }
    Ok(table)
}

fn scenario_name(set: SetSize) -> String {
    format!("S = {}, density {}", set.images, set.density)
}

/// Efficiency by P of all scenarios.
pub fn chart(scenarios: &[Scenario], points: &[Simulated]) -> XyChart {
    let name = format!("Simulated efficiency, V = {CHARTED_VIEWS}");
    let chart = XyChart::new(name, Axis::log("nodes P", ""), Axis::linear("efficiency", ""));
    let series = scenarios.iter().map(|scenario| {
        let own = points.iter().filter(|point| point.scenario == scenario.name && point.views == CHARTED_VIEWS);
        Series::line(scenario.name.as_str(), own.map(|point| (point.nodes as f64, point.efficiency)))
    });
    let mut chart = series.fold(chart, XyChart::with);
    chart.limits.push(report::Limit { name: "0.8".to_owned(), y: LEAST_EFFICIENCY });
    chart.note =
        "Simulated, not measured: plans of the real schedule, carried out by the simulation that stands beside the \
                  measured points."
            .to_owned();
    chart
}
