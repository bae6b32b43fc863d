//! Measured costs and points.

use cluster::Costs;
use render::Lighting;
use simulation::Calls;

use super::costs;
use super::point::Point;
use super::subject::MEASURED_BATCH;

/// Costs that P nodes timed at the same time, each with its quota, before and after the points.
#[derive(Debug, Clone, Default)]
pub struct Timed {
    pub nodes: usize,
    /// Costs of every node, once for each request.
    pub costs: Vec<Costs>,
    /// Costs with one view a call.
    pub alone: Vec<Costs>,
}

/// Costs and points of one lighting.
#[derive(Debug, Clone)]
pub struct MeasuredLighting {
    pub lighting: Lighting,
    /// Costs, by falling P.
    pub timed: Vec<Timed>,
    /// Points, in the order of measurement.
    pub points: Vec<Point>,
}

/// All measured values.
#[derive(Debug, Clone)]
pub struct Measured {
    pub device: String,
    pub cores: f64,
    pub quota_cores: f64,
    pub images: usize,
    /// Costs of single nodes without a limit, on all cores, while the others rest.
    pub unlimited: Vec<Costs>,
    /// The paper's lighting, then the expensive one.
    pub lit: Vec<MeasuredLighting>,
    pub seconds: f64,
}

impl MeasuredLighting {
    /// The mean of the costs at a number of nodes; zeros where there are none.
    #[must_use]
    pub fn mean(&self, nodes: usize) -> Costs {
        self.timed.iter().find(|timed| timed.nodes == nodes).map_or_else(Costs::default, Timed::mean)
    }
}

impl Timed {
    /// The mean over all nodes and times.
    #[must_use]
    pub fn mean(&self) -> Costs {
        costs::mean(&self.costs)
    }

    /// Costs of a view, and of a call to the device: both follow from calls of one view and of many.
    #[must_use]
    pub fn by_view_and_call(&self) -> (Costs, Calls) {
        let (costs, alone) = (self.mean(), costs::mean(&self.alone));
        let split = |alone_s: f64, of_many_s: f64| {
            let many = f64::from(MEASURED_BATCH);
            let view_s = ((many * of_many_s - alone_s) / (many - 1.0)).clamp(0.0, of_many_s);
            (view_s, ((of_many_s - view_s) * many).max(0.0))
        };
        let (reconstruct_view_s, reconstruct_s) = split(alone.reconstruct_view_s, costs.reconstruct_view_s);
        let (direct_view_s, direct_s) = split(alone.direct_view_s, costs.direct_view_s);
        (Costs { reconstruct_view_s, direct_view_s, ..costs }, Calls { reconstruct_s, direct_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_of_calls_and_views_are_separated() {
        // 10 ms a call and 2 ms a view, drawn directly at 5 ms a view and nothing a call.
        let many = f64::from(MEASURED_BATCH);
        let of_many = Costs { reconstruct_view_s: 0.01 / many + 0.002, direct_view_s: 0.005, ..Costs::default() };
        let alone = Costs { reconstruct_view_s: 0.012, direct_view_s: 0.005, ..Costs::default() };
        let timed = Timed { nodes: 1, costs: vec![of_many], alone: vec![alone] };
        let (costs, calls) = timed.by_view_and_call();
        assert!((costs.reconstruct_view_s - 0.002).abs() < 1e-12 && (calls.reconstruct_s - 0.01).abs() < 1e-12);
        assert!((costs.direct_view_s - 0.005).abs() < 1e-12 && calls.direct_s.abs() < 1e-12);
    }
}
