//! The simulation beyond measured points: to 1,000 nodes and 100,000 views, on networks of several speeds.

use cluster::{Costs, Policy, PolicyChoice};
use rayon::prelude::*;
use simulation::{Cluster, Demand, Habits, Limit, Machine, Transfer, plan, run, spread_speeds};

use super::prediction::Traffic;

/// Numbers of nodes, P.
const NODES: [usize; 9] = [2, 5, 11, 20, 50, 100, 200, 500, 1000];
/// Numbers of views, V.
pub const VIEWS: [usize; 3] = [1_000, 10_000, 100_000];
/// Speeds of links, each way.
pub const GBITS: [f64; 3] = [1.0, 10.0, 100.0];
/// Bytes a second of a link of 1 Gbit/s.
const BYTES_PER_S_A_GBIT: f64 = 1.25e8;
/// Sets of one run: enough for a steady state between filling and draining.
const SETS: u32 = 14;
/// The speed of the fastest node over the slowest, where nodes differ.
const UNEQUAL_RATIO: f64 = 4.0;
const SEED: u64 = 11;
/// The speed of a device that stands for a graphics processor, over this machine's.
const FAST: f64 = 30.0;
/// Parts of a sample image, where images are tiled.
const PARTS: usize = 16;

/// A cluster to simulate, beside P and V.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    pub name: String,
    /// The device that the costs belong to, and its speed.
    pub device: String,
    pub costs: Costs,
    /// The speed of every link.
    pub gbit_per_s: f64,
    pub habits: Habits,
    pub parts: usize,
    /// True where the speeds of nodes differ.
    pub unequal: bool,
}

/// One simulated point.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    pub scenario: usize,
    pub nodes: usize,
    pub views: usize,
    /// The policy that `auto` chose.
    pub policy: Policy,
    pub samplers: usize,
    /// The time between two sets, T.
    pub period_s: f64,
    /// Efficiency as at measured points; for unequal nodes over the sum of their speeds.
    pub efficiency: f64,
    pub limit: Limit,
}

/// Costs of this machine without a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Basis {
    /// Costs under the paper's lighting.
    pub plain: Costs,
    /// Costs under expensive lighting, where it was measured.
    pub expensive: Option<Costs>,
    pub images: usize,
    /// Bytes on the network.
    pub traffic: Traffic,
}

fn times_as_fast(costs: Costs, speed: f64) -> Costs {
    Machine::of(costs).faster(speed).costs
}

/// All scenarios: the cluster as it is, then one improvement after the other.
#[must_use]
pub fn scenarios(basis: &Basis) -> Vec<Scenario> {
    let devices = [("this machine".to_owned(), 1.0), (format!("{FAST:.0} times as fast"), FAST)];
    let mut all = Vec::new();
    for (device, speed) in &devices {
        for gbit_per_s in GBITS {
            let as_is = Scenario {
                name: format!("{gbit_per_s:.0} Gbit/s"),
                device: device.clone(),
                costs: times_as_fast(basis.plain, *speed),
                gbit_per_s,
                habits: Habits::default(),
                parts: 1,
                unequal: false,
            };
            all.push(as_is.clone());
            let habits = Habits { transfer: Transfer::Relay(2), sets_ahead: 3, ..Habits::default() };
            all.push(Scenario { name: format!("{gbit_per_s:.0} Gbit/s, relay"), habits, ..as_is });
        }
    }
    all.extend(of_ten_gbit(basis));
    all
}

/// Unequal nodes, and expensive lighting with and without tiles.
fn of_ten_gbit(basis: &Basis) -> Vec<Scenario> {
    let relay = Habits { transfer: Transfer::Relay(2), sets_ahead: 3, ..Habits::default() };
    let plain = Scenario {
        name: "unequal nodes".to_owned(),
        device: "this machine".to_owned(),
        costs: basis.plain,
        gbit_per_s: 10.0,
        habits: Habits::default(),
        parts: 1,
        unequal: true,
    };
    let expensive = basis.expensive.into_iter().flat_map(|costs| {
        let whole =
            Scenario { name: "expensive lighting, whole images".to_owned(), costs, unequal: false, ..plain.clone() };
        let relayed = Scenario { name: "expensive lighting, relay".to_owned(), habits: relay, ..whole.clone() };
        let cut =
            Scenario { name: format!("expensive lighting, relay, images in {PARTS}"), parts: PARTS, ..relayed.clone() };
        [whole, relayed, cut]
    });
    let expensive: Vec<_> = expensive.collect();
    [plain].into_iter().chain(expensive).collect()
}

/// Simulates all scenarios at all P and V, many at the same time.
#[must_use]
pub fn sweep(basis: &Basis, scenarios: &[Scenario], most_nodes: usize) -> Vec<Simulated> {
    let points = scenarios.iter().enumerate().flat_map(|(number, scenario)| {
        let nodes = NODES.into_iter().filter(move |&nodes| nodes <= most_nodes);
        nodes.flat_map(move |nodes| VIEWS.map(|views| (number, scenario, nodes, views)))
    });
    let points: Vec<_> = points.collect();
    points
        .into_par_iter()
        .filter_map(|(number, scenario, nodes, views)| simulated(basis, scenario, number, nodes, views))
        .collect()
}

fn cluster(basis: &Basis, scenario: &Scenario, nodes: usize) -> (Cluster, f64) {
    let bytes_per_s = scenario.gbit_per_s * BYTES_PER_S_A_GBIT;
    let equal = basis.traffic.cluster(nodes, Machine { bytes_per_s, ..Machine::of(scenario.costs) }, basis.images);
    let speeds = if scenario.unequal { spread_speeds(nodes, UNEQUAL_RATIO, SEED) } else { vec![1.0; nodes] };
    let machines = equal.machines.iter().zip(&speeds).map(|(machine, &speed)| machine.faster(speed)).collect();
    (Cluster { machines, ..equal }.cut(scenario.parts), speeds.iter().sum())
}

fn simulated(basis: &Basis, scenario: &Scenario, number: usize, nodes: usize, views: usize) -> Option<Simulated> {
    let (cluster, speed) = cluster(basis, scenario, nodes);
    let demand = Demand { views, sets: SETS, policy: PolicyChoice::Auto, tiles: None, nodes_report: true };
    let planned = plan(&cluster, &demand).ok()?;
    let run = run(&cluster, &planned, views, SETS, scenario.habits);
    let period_s = run.steady_period_s();
    Some(Simulated {
        scenario: number,
        nodes,
        views,
        policy: planned.assignment.policy,
        samplers: planned.sampler_count(),
        period_s,
        efficiency: super::costs::efficiency(&scenario.costs, basis.images, views, 1, speed * period_s),
        limit: run.limit(),
    })
}

/// The most nodes up to which efficiency stays above a bar, and the first point beyond.
#[must_use]
pub fn reach(points: &[Simulated], scenario: usize, views: usize, bar: f64) -> (Option<usize>, Option<Simulated>) {
    let mut of: Vec<&Simulated> = points.iter().filter(|p| p.scenario == scenario && p.views == views).collect();
    of.sort_by_key(|point| point.nodes);
    let short = of.iter().position(|point| point.efficiency < bar);
    let last = short.map_or(of.len(), |short| short).checked_sub(1).map(|at| of[at].nodes);
    (last, short.map(|short| of[short].clone()))
}
