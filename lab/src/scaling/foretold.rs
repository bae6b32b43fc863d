//! What was to be expected of a measured point: by the paper's equations, by the schedule, and by the simulation.

use cluster::{Costs, Policy};
use coordinator::schedule::pipeline_time;
use simulation::{Cluster, Demand, Habits, Machine, plan, run};

use super::measured::{Lit, Timed};
use super::point::{Ask, Point};

/// Sets of the simulation beyond those that count: the first, and what is sampled ahead at the end.
const MORE_SETS: u32 = 5;

/// Predictions of T.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foretold {
    /// Eq. 2 for the pipeline, eq. 1 for `direct`, and all work over all nodes for time-share: d, transfer and whole
    /// images are not in it.
    pub equation_s: f64,
    /// What the coordinator said when it planned, from the costs that it had measured.
    pub schedule_s: f64,
    /// From the simulation, in the way T was measured.
    pub simulated_s: f64,
    /// Whether the simulated schedule divided the nodes as the real one did.
    pub same_plan: bool,
}

/// B, the bytes of a frame, and the rate at which images come, of all points of a lighting.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Traffic {
    /// One sample image.
    pub image_bytes: f64,
    /// One frame.
    pub frame_bytes: f64,
    /// Between two processes of this machine.
    pub bytes_per_s: f64,
}

impl Traffic {
    /// Means over the points that show them.
    #[must_use]
    pub fn of(points: &[Point]) -> Self {
        let fetched: Vec<_> = points.iter().filter_map(|point| point.fetched).collect();
        let of_fetched = |sum: f64| sum / fetched.len().max(1) as f64;
        let image_bytes = of_fetched(fetched.iter().map(|image| image.image_bytes).sum());
        let image_s = of_fetched(fetched.iter().map(|image| image.image_s).sum());
        let views: f64 = points.iter().map(|point| point.ask.views as f64).sum();
        let frames: f64 = points.iter().map(|point| point.steps.frame_bytes).sum();
        Self { image_bytes, frame_bytes: frames / views.max(1.0), bytes_per_s: image_bytes / image_s }
    }

    /// So many equal nodes.
    #[must_use]
    pub fn cluster(&self, nodes: usize, machine: Machine, images: usize) -> Cluster {
        Cluster::equal(nodes, machine, images, self.image_bytes, self.frame_bytes)
    }
}

/// Of one point, from what as many nodes timed before and after.
#[must_use]
pub fn foretell(lit: &Lit, images: usize, point: &Point) -> Foretold {
    let traffic = Traffic::of(&lit.points);
    let bytes_per_s = if traffic.bytes_per_s > 0.0 { traffic.bytes_per_s } else { f64::INFINITY };
    let timed = lit.timed.iter().find(|timed| timed.nodes == point.nodes);
    let (costs, calls) = timed.map_or_else(Default::default, Timed::by_view_and_call);
    let simulated = simulate(Machine { costs, calls, bytes_per_s }, &traffic, images, point);
    Foretold {
        equation_s: equation_s(&lit.mean(point.nodes), images, point),
        schedule_s: point.plan.predicted_s(),
        simulated_s: simulated.map_or(f64::NAN, |(period_s, _)| period_s),
        same_plan: simulated.is_some_and(|(_, same)| same),
    }
}

fn equation_s(costs: &Costs, images: usize, point: &Point) -> f64 {
    let (nodes, views) = (point.nodes, point.ask.views);
    let (g_s, view_s) = (costs.sample_image_s, costs.reconstruct_view_s + costs.encode_view_s);
    match point.policy() {
        Policy::Pipeline => pipeline_time(images, g_s, views, view_s, nodes, point.samplers()),
        Policy::Direct => views as f64 * costs.direct_view_s / nodes as f64,
        Policy::TimeShare => (images as f64 * g_s + views as f64 * view_s) / nodes as f64,
    }
}

/// T and whether the plan is the same: planned with the costs that the coordinator had, carried out at the mean ones.
fn simulate(machine: Machine, traffic: &Traffic, images: usize, point: &Point) -> Option<(f64, bool)> {
    let sets = point.ask.counted_sets + MORE_SETS;
    let Ask { views, policy, .. } = point.ask;
    let tiles = point.ask.forced_tiles().map(|tiles| tiles as usize);
    let demand = Demand { views, sets, policy, tiles, nodes_report: false };
    let planned = plan(&traffic.cluster(point.nodes, Machine::of(point.plan.costs), images), &demand).ok()?;
    let roles = |plan: &cluster::Assignment| {
        let images = plan.samplers.iter().map(|share| share.image_indices.len()).collect::<Vec<_>>();
        (plan.policy, images, plan.compositors.len())
    };
    let same = roles(&planned.assignment) == roles(&point.plan.assignment);
    let cluster = traffic.cluster(point.nodes, machine, images);
    let run = run(&cluster, &planned, point.ask.views, sets, Habits::default());
    Some((run.period_s(point.ask.counted_sets as usize), same))
}
