//! Predictions of a measured point: by the paper's equations, by the schedule, and by the simulation.

use cluster::{Costs, Policy};
use simulation::{Cluster, Demand, Habits, Machine, plan, run};

use super::costs::Timed;
use super::point::Point;
use crate::balance::pipeline_time;

/// Simulated sets beyond those that count: the first, and those sampled ahead at the end.
const MORE_SETS: u32 = 5;

/// Predictions of T.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Eq. 2 for the pipeline, eq. 1 for `direct`, and all work over all nodes for time-share. Loads, transfer and
    /// whole images are not included.
    pub equation_s: f64,
    /// The coordinator's prediction, from the costs that it had measured.
    pub schedule_s: f64,
    /// The simulation's result, taken as T is measured.
    pub simulated_s: f64,
    /// True where the simulated schedule divides the nodes as the real one does.
    pub same_plan: bool,
}

/// Bytes on the network and their rate, as means over all points.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Traffic {
    pub image_bytes: f64,
    pub frame_bytes: f64,
    /// The rate between two processes of this machine; infinite where no point shows it.
    pub bytes_per_s: f64,
}

impl Traffic {
    /// The means over the points that show them.
    pub fn of(points: &[Point]) -> Self {
        let fetched: Vec<_> = points.iter().filter_map(|point| point.fetched).collect();
        let count = fetched.len().max(1) as f64;
        let image_bytes = fetched.iter().map(|image| image.image_bytes).sum::<f64>() / count;
        let image_s = fetched.iter().map(|image| image.image_s).sum::<f64>() / count;
        let views: f64 = points.iter().map(|point| point.settings.views as f64).sum();
        let frames: f64 = points.iter().map(|point| point.frame_bytes * point.settings.views as f64).sum();
        let bytes_per_s = if image_s > 0.0 { image_bytes / image_s } else { f64::INFINITY };
        Self { image_bytes, frame_bytes: frames / views.max(1.0), bytes_per_s }
    }

    /// A cluster of `nodes` equal nodes.
    pub fn cluster(&self, nodes: usize, machine: Machine, images: usize) -> Cluster {
        let Self { image_bytes, frame_bytes, .. } = *self;
        Cluster { machines: vec![machine; nodes], images, image_bytes, frame_bytes }
    }
}

/// Predicts a point from the costs that as many nodes timed.
pub fn predict(timed: &Timed, traffic: Traffic, images: usize, point: &Point) -> Prediction {
    let (costs, calls) = timed.by_view_and_call();
    let simulated = simulate(Machine { costs, calls, bytes_per_s: traffic.bytes_per_s }, &traffic, images, point);
    Prediction {
        equation_s: equation_s(&timed.mean(), images, point),
        schedule_s: point.plan.predicted_s(),
        simulated_s: simulated.map_or(f64::NAN, |(period_s, _)| period_s),
        same_plan: simulated.is_some_and(|(_, same)| same),
    }
}

fn equation_s(costs: &Costs, images: usize, point: &Point) -> f64 {
    let nodes = point.nodes;
    let views = point.settings.views;
    let view_s = costs.reconstruct_view_s + costs.encode_view_s;
    match point.policy() {
        Policy::Pipeline => pipeline_time(images, costs.sample_image_s, views, view_s, nodes, point.samplers()),
        Policy::Direct => views as f64 * costs.direct_view_s / nodes as f64,
        Policy::TimeShare => (images as f64 * costs.sample_image_s + views as f64 * view_s) / nodes as f64,
    }
}

/// T, and true for an equal plan: planned with the coordinator's costs and executed at the mean ones.
fn simulate(machine: Machine, traffic: &Traffic, images: usize, point: &Point) -> Option<(f64, bool)> {
    let settings = point.settings;
    let sets = settings.counted_sets + MORE_SETS;
    let demand = Demand { views: settings.views, sets, policy: settings.policy, tiles: None, nodes_report: false };
    let planned = plan(&traffic.cluster(point.nodes, Machine::of(point.plan.costs), images), &demand)?;
    let [simulated, real] = [&planned.assignment, &point.plan.assignment].map(|plan| {
        let images = plan.samplers.iter().map(|share| share.image_indices.len()).collect::<Vec<_>>();
        (plan.policy, images, plan.compositors.len())
    });
    let cluster = traffic.cluster(point.nodes, machine, images);
    let run = run(&cluster, &planned, settings.views, sets, Habits::default());
    Some((run.period_s(settings.counted_sets as usize), simulated == real))
}
