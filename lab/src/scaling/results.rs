//! Measured points of a lighting beside their predictions.

use cluster::PolicyChoice;

use super::costs::efficiency;
use super::matrix::PAPER_VIEWS;
use super::measured::MeasuredLighting;
use super::point::Point;
use super::prediction::Prediction;

/// A measured lighting with a prediction for each of its points.
pub struct Results<'a> {
    /// Measured costs and points.
    pub lit: &'a MeasuredLighting,
    pub predictions: Vec<Prediction>,
    pub images: usize,
}

impl<'a> Results<'a> {
    /// The efficiency (S·g_s + V·(c+e)) / (P·T) of a measured point.
    #[must_use]
    pub fn efficiency(&self, point: &Point) -> f64 {
        efficiency(&self.lit.mean(point.nodes), self.images, point.settings.views, point.nodes, point.period_s)
    }

    /// The point of some settings, tiled as the schedule decides.
    #[must_use]
    pub fn find(&self, policy: PolicyChoice, nodes: usize, views: usize) -> Option<&Point> {
        let asked =
            |point: &&Point| (point.settings.policy, point.nodes, point.settings.views) == (policy, nodes, views);
        self.lit.points.iter().filter(|point| !point.settings.whole_images).find(asked)
    }

    /// The numbers of nodes P of all points, rising.
    #[must_use]
    pub fn node_counts(&self) -> Vec<usize> {
        let mut counts: Vec<usize> = self.lit.points.iter().map(|point| point.nodes).collect();
        counts.sort_unstable();
        counts.dedup();
        counts
    }

    /// Efficiency of `direct` at V = 1000, from the point with most views: T grows as V does.
    #[must_use]
    pub fn naive(&self, nodes: usize) -> Option<(f64, &'a Point)> {
        let is_direct = |point: &&Point| point.settings.policy == PolicyChoice::Direct && point.nodes == nodes;
        let point = self.lit.points.iter().filter(is_direct).max_by_key(|point| point.settings.views)?;
        let period_s = point.period_s * PAPER_VIEWS as f64 / point.settings.views as f64;
        Some((efficiency(&self.lit.mean(nodes), self.images, PAPER_VIEWS, nodes, period_s), point))
    }

    /// Seconds of each of [`STEPS`] for one set, added up over nodes: of the pipeline at a number of nodes, by V.
    #[must_use]
    pub fn steps(&self, nodes: usize) -> Vec<(usize, [f64; 6])> {
        let is_pipeline = |point: &&Point| point.nodes == nodes && point.settings.policy == PolicyChoice::Pipeline;
        let mut points: Vec<&Point> = self.lit.points.iter().filter(is_pipeline).collect();
        points.sort_by_key(|point| point.settings.views);
        points.into_iter().map(|point| (point.settings.views, self.steps_of(point))).collect()
    }

    fn steps_of(&self, point: &Point) -> [f64; 6] {
        let steps = point.steps;
        // A compositor without a view of a set does not load it.
        let receivers = point.compositors().min(point.settings.views) as f64;
        let image_s = point.fetched.map_or(0.0, |image| image.image_s);
        let transfer_s = self.images as f64 * image_s * receivers;
        let load_s = receivers * self.lit.mean(point.nodes).load_set_s;
        [steps.sample_s, transfer_s, load_s, steps.reconstruct_s, steps.encode_s, steps.client_s]
    }
}

/// The main steps of Fig. 6.
pub const STEPS: [&str; 6] = ["sampling", "transfer", "loading d", "reconstruction", "encoding", "client"];
