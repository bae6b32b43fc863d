//! Measured costs and points.

use render::Lighting;
use simulation::Calls;
use wire::Costs;

use super::costs;
use super::point::Point;
use super::subject::MEASURED_BATCH;

/// What P nodes timed at the same time, each with its quota, before the points and after them.
#[derive(Debug, Clone, Default)]
pub struct Timed {
    /// P.
    pub nodes: usize,
    /// Of every node, as often as it was asked.
    pub costs: Vec<Costs>,
    /// The same with one view a call.
    pub alone: Vec<Costs>,
}

/// One lighting's costs and points.
#[derive(Debug, Clone)]
pub struct MeasuredLighting {
    /// Which.
    pub lighting: Lighting,
    /// By P, falling.
    pub timed: Vec<Timed>,
    /// In the order they were measured.
    pub points: Vec<Point>,
}

/// All that was measured.
#[derive(Debug, Clone)]
pub struct Measured {
    /// As nodes name it.
    pub device: String,
    /// Of this machine.
    pub cores: f64,
    /// Cores a node.
    pub quota_cores: f64,
    /// S.
    pub images: usize,
    /// One node's costs without a limit: on all cores, the others at rest; one after the other.
    pub unlimited: Vec<Costs>,
    /// The paper's lighting, then the expensive one.
    pub lit: Vec<MeasuredLighting>,
    /// Of all of it.
    pub seconds: f64,
}

impl MeasuredLighting {
    /// The mean of what so many nodes timed; zeros where they did not.
    #[must_use]
    pub fn mean(&self, nodes: usize) -> Costs {
        self.timed.iter().find(|timed| timed.nodes == nodes).map_or_else(Costs::default, Timed::mean)
    }
}

impl Timed {
    /// Of all nodes and times.
    #[must_use]
    pub fn mean(&self) -> Costs {
        costs::mean(&self.costs)
    }

    /// What a call to the device takes, and each view of it: both follow from calls of one view and of many.
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
    fn calls_and_views_are_told_apart() {
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
