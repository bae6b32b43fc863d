//! All measured values: costs, and points beside their predictions.

use cluster::{Costs, PolicyChoice};
use render::Lighting;

use super::costs::{Timed, efficiency};
use super::matrix::PAPER_VIEWS;
use super::point::Point;
use super::prediction::{Prediction, Traffic, predict};
use super::subject::SetSize;

/// A measured point with its predictions.
#[derive(Debug, Clone)]
pub struct PredictedPoint {
    pub point: Point,
    pub prediction: Prediction,
}

/// All measured values.
#[derive(Debug, Clone)]
pub struct Results {
    pub device: String,
    pub lighting: Lighting,
    pub cores: f64,
    /// The set of all points.
    pub set: SetSize,
    /// Costs of single nodes without a limit, on all cores, while the others rest.
    pub unlimited: Vec<Costs>,
    /// Costs of a node without a limit by size of the set, where samples hold light.
    pub sets: Vec<(SetSize, Costs)>,
    /// Costs, by falling P.
    pub timed: Vec<Timed>,
    /// Points, in the order of measurement.
    pub points: Vec<PredictedPoint>,
    pub traffic: Traffic,
    pub seconds: f64,
}

impl Results {
    /// Adds points with their predictions from the costs that as many nodes timed.
    pub fn with_points(self, points: Vec<Point>) -> Self {
        let traffic = Traffic::of(&points);
        let predicted = points.into_iter().map(|point| {
            let timed = self.timed.iter().find(|timed| timed.nodes == point.nodes);
            let prediction = predict(timed.unwrap_or(&Timed::default()), traffic, self.set.images, &point);
            PredictedPoint { point, prediction }
        });
        Self { points: predicted.collect(), traffic, ..self }
    }

    /// The mean of the costs at a number of nodes; zeros where there are none.
    pub fn mean(&self, nodes: usize) -> Costs {
        self.timed.iter().find(|timed| timed.nodes == nodes).map_or_else(Costs::default, Timed::mean)
    }

    /// The efficiency (S·g_s + V·(c+e)) / (P·T) of a measured point.
    pub fn efficiency(&self, point: &Point) -> f64 {
        efficiency(&self.mean(point.nodes), self.set.images, point.settings.views, point.nodes, point.period_s)
    }

    fn measured(&self) -> impl Iterator<Item = &Point> {
        self.points.iter().map(|predicted| &predicted.point)
    }

    /// The point of some settings.
    pub fn find(&self, policy: PolicyChoice, nodes: usize, views: usize) -> Option<&Point> {
        self.measured()
            .find(|point| point.settings.policy == policy && point.nodes == nodes && point.settings.views == views)
    }

    /// The numbers of nodes P of all points, rising.
    pub fn node_counts(&self) -> Vec<usize> {
        let mut counts: Vec<usize> = self.measured().map(|point| point.nodes).collect();
        counts.sort_unstable();
        counts.dedup();
        counts
    }

    /// Efficiency of `direct` at V = 1000, from the point with most views: T grows as V does.
    pub fn naive(&self, nodes: usize) -> Option<(f64, &Point)> {
        let direct =
            self.measured().filter(|point| point.settings.policy == PolicyChoice::Direct && point.nodes == nodes);
        let point = direct.max_by_key(|point| point.settings.views)?;
        let period_s = point.period_s * PAPER_VIEWS as f64 / point.settings.views as f64;
        Some((efficiency(&self.mean(nodes), self.set.images, PAPER_VIEWS, nodes, period_s), point))
    }
}
