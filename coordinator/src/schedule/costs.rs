//! What operations cost each node: its own timings, smoothed.

use std::collections::VecDeque;

use wire::Costs;

/// Timings of which the median counts.
const MEDIAN_OF: usize = 5;
/// What the moving average takes of a new median.
const ALPHA: f64 = 0.2;
/// Nodes are equal when none needs so many times what another does.
const EQUAL_WITHIN: f64 = 1.1;

/// A node's own timings of one report; what it did not do is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeasuredCosts {
    /// g_s: one finished sample image.
    pub sample_image_s: Option<f64>,
    /// g_v: one view drawn directly.
    pub direct_view_s: Option<f64>,
    /// c: one view reconstructed.
    pub reconstruct_view_s: Option<f64>,
    /// d: one sample set decoded and uploaded.
    pub load_set_s: Option<f64>,
    /// e: one view encoded.
    pub encode_view_s: Option<f64>,
    /// Depth images to and from this node.
    pub transfer_bytes_per_s: Option<f64>,
    /// B: one encoded sample image.
    pub image_bytes: Option<f64>,
}

/// What is known of one node.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NodeCosts {
    /// Seconds of one operation.
    pub costs: Costs,
    /// One sample image to or from this node; 0 while nobody measured it.
    pub transfer_image_s: f64,
}

impl NodeCosts {
    /// c + e.
    #[must_use]
    pub fn view_s(&self) -> f64 {
        self.costs.reconstruct_view_s + self.costs.encode_view_s
    }

    /// The mean of each.
    #[must_use]
    pub fn mean(nodes: &[Self]) -> Self {
        let mean = |of: fn(&Self) -> f64| nodes.iter().map(of).sum::<f64>() / nodes.len().max(1) as f64;
        Self {
            costs: Costs {
                sample_image_s: mean(|n| n.costs.sample_image_s),
                direct_view_s: mean(|n| n.costs.direct_view_s),
                reconstruct_view_s: mean(|n| n.costs.reconstruct_view_s),
                load_set_s: mean(|n| n.costs.load_set_s),
                encode_view_s: mean(|n| n.costs.encode_view_s),
                in_order: nodes.iter().any(|n| n.costs.in_order),
            },
            transfer_image_s: mean(|n| n.transfer_image_s),
        }
    }

    /// Whether it makes no difference who does what.
    #[must_use]
    pub fn are_equal(nodes: &[Self]) -> bool {
        let equal = |of: fn(&Self) -> f64| {
            let least = nodes.iter().map(of).fold(f64::INFINITY, f64::min);
            nodes.iter().all(|node| of(node) <= least * EQUAL_WITHIN)
        };
        equal(|node| node.costs.sample_image_s) && equal(Self::view_s)
    }
}

/// Median of the last timings, then a moving average of the medians.
#[derive(Debug, Clone, Default)]
struct Smoothed {
    last: VecDeque<f64>,
    value: Option<f64>,
}

impl Smoothed {
    fn starting_at(value: f64) -> Self {
        Self { value: Some(value), ..Self::default() }
    }

    /// A timing that cannot be says nothing.
    fn add(&mut self, timing: Option<f64>) {
        let Some(timing) = timing.filter(|timing| timing.is_finite() && *timing >= 0.0) else { return };
        self.last.truncate(MEDIAN_OF - 1);
        self.last.push_front(timing);
        let median = median(&self.last);
        self.value = Some(self.value.map_or(median, |value| value + ALPHA * (median - value)));
    }

    fn or_zero(&self) -> f64 {
        self.value.unwrap_or(0.0)
    }
}

/// Of an even number the upper one.
fn median(timings: &VecDeque<f64>) -> f64 {
    let mut sorted: Vec<f64> = timings.iter().copied().collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// One node's costs as its timings come in.
#[derive(Debug, Clone, Default)]
pub(super) struct Estimate {
    sample_image_s: Smoothed,
    direct_view_s: Smoothed,
    reconstruct_view_s: Smoothed,
    load_set_s: Smoothed,
    encode_view_s: Smoothed,
    transfer_bytes_per_s: Smoothed,
    image_bytes: Smoothed,
    in_order: bool,
}

impl Estimate {
    /// As measured when the session was opened.
    pub(super) fn starting_at(costs: &Costs) -> Self {
        Self {
            sample_image_s: Smoothed::starting_at(costs.sample_image_s),
            direct_view_s: Smoothed::starting_at(costs.direct_view_s),
            reconstruct_view_s: Smoothed::starting_at(costs.reconstruct_view_s),
            load_set_s: Smoothed::starting_at(costs.load_set_s),
            encode_view_s: Smoothed::starting_at(costs.encode_view_s),
            in_order: costs.in_order,
            ..Self::default()
        }
    }

    pub(super) fn add(&mut self, measured: &MeasuredCosts) {
        self.sample_image_s.add(measured.sample_image_s);
        self.direct_view_s.add(measured.direct_view_s);
        self.reconstruct_view_s.add(measured.reconstruct_view_s);
        self.load_set_s.add(measured.load_set_s);
        self.encode_view_s.add(measured.encode_view_s);
        // Nothing moves at 0 bytes/s: that is no rate.
        self.transfer_bytes_per_s.add(measured.transfer_bytes_per_s.filter(|rate| *rate > 0.0));
        self.image_bytes.add(measured.image_bytes);
    }

    pub(super) fn now(&self) -> NodeCosts {
        NodeCosts {
            costs: Costs {
                sample_image_s: self.sample_image_s.or_zero(),
                direct_view_s: self.direct_view_s.or_zero(),
                reconstruct_view_s: self.reconstruct_view_s.or_zero(),
                load_set_s: self.load_set_s.or_zero(),
                encode_view_s: self.encode_view_s.or_zero(),
                in_order: self.in_order,
            },
            transfer_image_s: self.transfer_bytes_per_s.value.map_or(0.0, |rate| self.image_bytes.or_zero() / rate),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(estimate: &mut Estimate, sample_image_s: f64) -> f64 {
        estimate.add(&MeasuredCosts { sample_image_s: Some(sample_image_s), ..MeasuredCosts::default() });
        estimate.now().costs.sample_image_s
    }

    #[test]
    fn one_outlier_is_not_seen_and_a_change_is_followed() {
        let mut estimate = Estimate::starting_at(&Costs { sample_image_s: 1.0, ..Costs::default() });
        for _ in 0..3 {
            assert_eq!(sampled(&mut estimate, 1.0), 1.0);
        }
        assert_eq!(sampled(&mut estimate, 100.0), 1.0, "one of four");
        for _ in 0..4 {
            sampled(&mut estimate, 1.0);
        }
        assert!((0..30).map(|_| sampled(&mut estimate, 2.0)).last().unwrap() > 1.98);
    }

    #[test]
    fn what_cannot_be_says_nothing() {
        let mut estimate = Estimate::starting_at(&Costs { sample_image_s: 1.0, ..Costs::default() });
        for timing in [f64::NAN, f64::INFINITY, -1.0] {
            assert_eq!(sampled(&mut estimate, timing), 1.0);
        }
        estimate.add(&MeasuredCosts {
            transfer_bytes_per_s: Some(0.0),
            image_bytes: Some(1e6),
            ..MeasuredCosts::default()
        });
        assert_eq!(estimate.now().transfer_image_s, 0.0);
        estimate.add(&MeasuredCosts { transfer_bytes_per_s: Some(1e8), ..MeasuredCosts::default() });
        assert!((estimate.now().transfer_image_s - 0.01).abs() < 1e-12);
    }

    #[test]
    fn nodes_within_a_tenth_are_equal() {
        let node = |g: f64, c: f64| NodeCosts {
            costs: Costs { sample_image_s: g, reconstruct_view_s: c, ..Costs::default() },
            transfer_image_s: 0.0,
        };
        assert!(NodeCosts::are_equal(&[node(1.0, 0.1), node(1.09, 0.1)]));
        assert!(!NodeCosts::are_equal(&[node(1.0, 0.1), node(1.2, 0.1)]));
        assert!(!NodeCosts::are_equal(&[node(1.0, 0.1), node(1.0, 0.12)]));
        assert!((NodeCosts::mean(&[node(1.0, 0.1), node(2.0, 0.3)]).view_s() - 0.2).abs() < 1e-12);
    }
}
