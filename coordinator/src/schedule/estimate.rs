//! The costs of one node, estimated from its own timings.

use std::array;

use cluster::{Costs, MeasuredCosts};

use super::node_costs::{NodeCosts, is_within_tiles_error};
use super::operations::{DEVICE_OPERATIONS, PerOperation, SAMPLE_IMAGE, operations, timings, with_operations};
use super::smoothing::{Smoothed, geometric_mean, is_valid};

/// Reports without a timing after which the operation counts as not timed.
const RECENT: u32 = 30;
/// A first timing of this many times the expected one includes the building of shaders, and is ignored.
const COLD: f64 = 2.0;
/// The largest ratio, either way, of a timing to its expected value. A timing beyond it belongs to work of another kind and
/// does not describe the node.
const ALIKE: f64 = 16.0;

fn is_alike(ratio: f64) -> bool {
    (1.0 / ALIKE..=ALIKE).contains(&ratio)
}

/// One operation: as measured alone, and as timed since.
#[derive(Debug, Clone, Default)]
struct Operation {
    alone_s: f64,
    /// It has been done, and so is not cold again.
    is_warm: bool,
    timed: Smoothed,
    reports_without: u32,
}

impl Operation {
    fn starting_at(alone_s: f64) -> Self {
        Self { alone_s, is_warm: false, timed: Smoothed::starting_at(alone_s), reports_without: 0 }
    }

    /// Another cost alone, of which it takes as many times as long as of the one before.
    fn rebase(&mut self, alone_s: f64) {
        let times = alone_s / self.alone_s;
        if is_alike(times) {
            self.timed.scale(times);
            self.alone_s = alone_s;
        } else {
            *self = Self::starting_at(alone_s);
        }
    }

    /// Gives how many times longer than alone the timing is, where it is valid and of the expected work.
    fn add(&mut self, timing_s: Option<f64>, slowness: f64) -> Option<f64> {
        let was_cold = !self.is_warm && timing_s.is_some_and(|timing_s| timing_s > COLD * self.alone_s * slowness);
        self.is_warm |= timing_s.is_some();
        self.timed.expect(self.alone_s * slowness);
        let timing_s = timing_s.filter(|timing_s| !was_cold && is_valid(*timing_s));
        self.reports_without = if timing_s.is_some() { 0 } else { self.reports_without.saturating_add(1) };
        self.timed.add(timing_s);
        timing_s.map(|timing_s| timing_s / self.alone_s).filter(|ratio| is_alike(*ratio))
    }

    fn is_timed(&self) -> bool {
        self.timed.has_timings() && self.reports_without <= RECENT
    }

    fn timed_s(&self) -> f64 {
        self.timed.value().unwrap_or(0.0)
    }

    /// An operation without recent timings is `slowness` times slower than alone.
    fn now_s(&self, slowness: f64) -> f64 {
        if self.is_timed() { self.timed_s() } else { self.alone_s * slowness }
    }

    /// How many times longer than alone it takes, where that is known.
    fn ratio(&self) -> Option<f64> {
        let ratio = self.timed_s() / self.alone_s;
        Some(ratio).filter(|ratio| self.is_timed() && is_alike(*ratio))
    }
}

/// How many times longer than alone each operation takes now; `None` where no node has timed it.
pub(super) type Ratios = PerOperation<Option<f64>>;

/// Ratios of all nodes together: an operation that is slower at work than alone, as loading a set beside views is, is so on
/// every node. The timings of a single node say as much of that node as of the operation, and do not count.
pub(super) fn common_ratios<'a>(estimates: impl Iterator<Item = &'a Estimate>) -> Ratios {
    let all: Vec<Ratios> = estimates.map(Estimate::ratios).collect();
    array::from_fn(|operation| {
        let timed = all.iter().filter_map(|ratios| ratios[operation]);
        geometric_mean(timed.clone()).filter(|_| timed.count() > 1)
    })
}

/// One node's costs as its timings come in.
#[derive(Debug, Clone, Default)]
pub(super) struct Estimate {
    /// As measured when the session was opened.
    alone: Costs,
    operations: PerOperation<Operation>,
    /// How many times longer than alone the node's operations take now.
    slowness: Smoothed,
    transfer_bytes_per_s: Smoothed,
    image_bytes: Smoothed,
    /// The last images that were sampled were tiles.
    samples_tiles: bool,
}

/// The parts of each set that a node has sampled, as numbers of tiles of images in `tiles` tiles.
#[derive(Debug, Clone, Copy)]
pub(super) struct SampledParts<'a> {
    pub(super) parts: &'a [u32],
    pub(super) tiles: u32,
}

impl Estimate {
    /// As measured when the session was opened.
    pub(super) fn starting_at(costs: &Costs) -> Self {
        Self { alone: *costs, operations: operations(costs).map(Operation::starting_at), ..Self::default() }
    }

    /// Adds the timings of one report. `sampled` is the node's share in the plan that the report is of.
    pub(super) fn add(&mut self, measured: &MeasuredCosts, sampled: Option<SampledParts<'_>>) {
        let slowness = self.slowness.value().unwrap_or(1.0);
        let mut timings = timings(measured);
        // Tiles of a plan that is gone are not known any more.
        let is_known = sampled.is_some() || !self.samples_tiles;
        let sampled_s = &mut timings[SAMPLE_IMAGE];
        *sampled_s = sampled_s.filter(|_| is_known).map(|s| self.whole_image_s(s, sampled));
        self.samples_tiles = sampled.map_or(self.samples_tiles, |sampled| sampled.tiles > 1);
        let ratios = array::from_fn(|i| self.operations[i].add(timings[i], slowness));
        self.slowness.add(self.mean_ratio(ratios));
        // A rate of 0 bytes/s is no rate: nothing was transferred.
        self.transfer_bytes_per_s.add(measured.transfer_bytes_per_s.filter(|rate| *rate > 0.0));
        self.image_bytes.add(measured.image_bytes);
    }

    /// The mean ratio of the device's operations. A tile that takes somewhat longer than expected does not say that the
    /// node is slow.
    fn mean_ratio(&self, mut ratios: Ratios) -> Option<f64> {
        if self.samples_tiles && ratios[SAMPLE_IMAGE].is_some_and(is_within_tiles_error) {
            ratios[SAMPLE_IMAGE] = Some(1.0);
        }
        geometric_mean(ratios[..DEVICE_OPERATIONS].iter().copied().flatten())
    }

    /// The cost of a mean image on a node whose tiles take `tiles_s`, each times their number in an image. Tiles have an
    /// overhead each, and show the sky or not: unscaled, equal nodes would seem unequal.
    fn whole_image_s(&self, tiles_s: f64, sampled: Option<SampledParts<'_>>) -> f64 {
        let Some(SampledParts { parts, tiles }) = sampled.filter(|sampled| sampled.tiles > 1) else { return tiles_s };
        let tiles_alone_s =
            parts.iter().map(|part| self.alone.sample_this_tile_s((part % tiles) as usize, tiles as usize));
        let expected_s = tiles_alone_s.sum::<f64>() / parts.len() as f64 * f64::from(tiles);
        let ratio = tiles_s / expected_s;
        if ratio.is_finite() { self.alone.sample_image_s * ratio } else { tiles_s }
    }

    /// Other views, or images of another first session, with these costs alone: the node is as slow as before.
    pub(super) fn rebase(&mut self, costs: &Costs) {
        if self.alone != *costs {
            self.alone = *costs;
            self.operations.iter_mut().zip(operations(costs)).for_each(|(own, alone_s)| own.rebase(alone_s));
        }
    }

    /// Forgets all timings: other work is done from here on.
    pub(super) fn restart(&mut self) {
        self.operations.iter_mut().for_each(|operation| operation.timed.restart());
    }

    fn ratios(&self) -> Ratios {
        self.operations.each_ref().map(Operation::ratio)
    }

    /// As if nothing had been timed since the session was opened.
    pub(super) fn alone(&self) -> NodeCosts {
        NodeCosts { costs: self.alone, transfer_image_s: self.now().transfer_image_s }
    }

    pub(super) fn now(&self) -> NodeCosts {
        self.now_among(&Ratios::default())
    }

    /// An operation without timings of this node is as much slower than alone as on nodes with timings, times this
    /// node's relative slowness.
    pub(super) fn now_among(&self, common: &Ratios) -> NodeCosts {
        let slowness = self.slowness.value().unwrap_or(1.0);
        // How many times slower than other nodes this one is, by operations that both have timed.
        let own = self.ratios();
        let to_others = array::from_fn(|i| Some(own[i]? / common[i]?));
        let than_others = self.mean_ratio(to_others).unwrap_or(1.0);
        let now_s =
            array::from_fn(|i| self.operations[i].now_s(common[i].map_or(slowness, |common| common * than_others)));
        let mut costs = with_operations(&self.alone, now_s);
        // The overhead of a tile grows with the cost of an image.
        let times = costs.sample_image_s / self.alone.sample_image_s;
        if let Some(tiles) = costs.tiles.as_mut().filter(|_| times.is_finite()) {
            tiles.overhead_s *= times;
        }
        let image_bytes = self.image_bytes.value().unwrap_or(0.0);
        NodeCosts { costs, transfer_image_s: self.transfer_bytes_per_s.value().map(|rate| image_bytes / rate) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schedule::test_support::TILEABLE;

    fn sampled(estimate: &mut Estimate, sample_image_s: f64) -> f64 {
        estimate.add(&MeasuredCosts { sample_image_s: Some(sample_image_s), ..MeasuredCosts::default() }, None);
        estimate.now().costs.sample_image_s
    }

    #[test]
    fn one_outlier_is_ignored_and_a_change_is_followed() {
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
    fn non_finite_and_negative_timings_are_ignored() {
        let mut estimate = Estimate::starting_at(&Costs { sample_image_s: 1.0, ..Costs::default() });
        for timing in [f64::NAN, f64::INFINITY, -1.0] {
            assert_eq!(sampled(&mut estimate, timing), 1.0);
        }
        let stalled =
            MeasuredCosts { transfer_bytes_per_s: Some(0.0), image_bytes: Some(1e6), ..MeasuredCosts::default() };
        estimate.add(&stalled, None);
        assert_eq!(estimate.now().transfer_image_s, None);
        estimate.add(&MeasuredCosts { transfer_bytes_per_s: Some(1e8), ..MeasuredCosts::default() }, None);
        assert!((estimate.now().transfer_image_s.unwrap() - 0.01).abs() < 1e-12);
    }

    #[test]
    fn an_operation_without_timings_is_as_slow_as_the_others() {
        let alone = Costs { sample_image_s: 1.0, direct_view_s: 2.0, reconstruct_view_s: 0.1, ..Costs::default() };
        let mut estimate = Estimate::starting_at(&alone);
        let views = MeasuredCosts { reconstruct_view_s: Some(0.3), ..MeasuredCosts::default() };
        for _ in 0..40 {
            estimate.add(&views, None);
        }
        let costs = estimate.now().costs;
        let times = [costs.sample_image_s / 1.0, costs.direct_view_s / 2.0, costs.reconstruct_view_s / 0.1];
        assert!(times.iter().all(|times| (times - 3.0).abs() < 0.01), "{times:?}");
        let first_s = sampled(&mut estimate, 5.0);
        assert!((first_s - 3.4).abs() < 0.01, "a fifth of the way: {first_s}");
        assert!((0..30).map(|_| sampled(&mut estimate, 5.0)).last().unwrap() > 4.9, "it is timed by now");
        for _ in 0..=RECENT {
            estimate.add(&views, None);
        }
        let now_s = estimate.now().costs.sample_image_s;
        let slowness = estimate.slowness.value().unwrap();
        assert!((now_s - slowness).abs() < 1e-9 && slowness < 4.0, "no longer, after a while: {now_s}");
    }

    #[test]
    fn an_operation_that_is_slower_at_work_is_so_on_every_node() {
        let alone = Costs { sample_image_s: 1.0, reconstruct_view_s: 0.1, load_set_s: 0.2, ..Costs::default() };
        let reports = |costs: MeasuredCosts| {
            let mut estimate = Estimate::starting_at(&alone);
            (0..30).for_each(|_| estimate.add(&costs, None));
            estimate
        };
        let sampler = |sample_image_s| {
            reports(MeasuredCosts { sample_image_s: Some(sample_image_s), ..MeasuredCosts::default() })
        };
        let views = MeasuredCosts { reconstruct_view_s: Some(0.1), load_set_s: Some(0.7), ..MeasuredCosts::default() };
        let all = [sampler(1.0), sampler(1.0), reports(views), reports(views)];
        let common = common_ratios(all.iter());
        let [sampling, .., making] = all.map(|estimate| estimate.now_among(&common).costs);
        assert!((sampling.load_set_s - 0.7).abs() < 0.01, "it would take a sampler as long: {sampling:?}");
        assert!((making.load_set_s - 0.7).abs() < 0.01 && (making.sample_image_s - 1.0).abs() < 0.01, "{making:?}");
        let slow = [sampler(1.0), sampler(1.0), sampler(4.0)];
        let slow_s = slow[2].now_among(&common_ratios(slow.iter())).costs.reconstruct_view_s;
        assert!(slow_s > 0.2, "a slow sampler would be slow at views: {slow_s}");
    }

    #[test]
    fn a_first_timing_of_a_cold_node_is_ignored() {
        let mut estimate = Estimate::starting_at(&Costs { sample_image_s: 1.0, ..Costs::default() });
        assert_eq!(sampled(&mut estimate, 4.0), 1.0, "shaders were built");
        assert!((sampled(&mut estimate, 4.0) - 1.6).abs() < 1e-9, "they are there now");
    }

    #[test]
    fn timings_after_a_restart_count_at_once() {
        let mut estimate = Estimate::starting_at(&Costs { sample_image_s: 1.0, ..Costs::default() });
        for _ in 0..9 {
            sampled(&mut estimate, 1.0);
        }
        estimate.restart();
        assert_eq!(estimate.now().costs.sample_image_s, 1.0);
        assert_eq!(sampled(&mut estimate, 0.2), 0.2);
    }

    #[test]
    fn another_view_keeps_what_is_known_of_the_node() {
        let alone = Costs { sample_image_s: 1.0, reconstruct_view_s: 0.1, ..Costs::default() };
        let mut estimate = Estimate::starting_at(&alone);
        (0..40).for_each(|_| assert!(sampled(&mut estimate, 2.0) >= 1.0));
        estimate.rebase(&Costs { sample_image_s: 3.0, reconstruct_view_s: 0.4, ..alone });
        let now = estimate.now().costs;
        assert!((now.sample_image_s / 6.0 - 1.0).abs() < 0.01 && (now.reconstruct_view_s / 0.8 - 1.0).abs() < 0.01);
        let before = estimate.now();
        estimate.rebase(&Costs { sample_image_s: 3.0, reconstruct_view_s: 0.4, ..alone });
        assert_eq!(estimate.now(), before);
    }

    #[test]
    fn timings_beside_views_of_another_kind_are_forgotten() {
        let alone = Costs { reconstruct_view_s: 0.01, ..Costs::default() };
        let mut estimate = Estimate::starting_at(&alone);
        let usual = MeasuredCosts { reconstruct_view_s: Some(0.01), ..MeasuredCosts::default() };
        estimate.rebase(&Costs { reconstruct_view_s: 1e-5, ..alone });
        (0..40).for_each(|_| estimate.add(&usual, None));
        estimate.rebase(&alone);
        assert_eq!(estimate.now().costs.reconstruct_view_s, 0.01, "no node is a thousand times slower");
    }

    #[test]
    fn nodes_with_different_tiles_have_equal_costs() {
        for (tiles, parts) in [(4, vec![0]), (4, vec![2, 7]), (2, vec![1]), (8, vec![1, 2, 3]), (1, vec![0, 3])] {
            for slow in [1.0, 3.0] {
                let each_s = |&part: &u32| TILEABLE.sample_this_tile_s((part % tiles) as usize, tiles as usize);
                let tiles_s = slow * parts.iter().map(each_s).sum::<f64>() / parts.len() as f64 * f64::from(tiles);
                let measured = MeasuredCosts { sample_image_s: Some(tiles_s), ..MeasuredCosts::default() };
                let mut estimate = Estimate::starting_at(&TILEABLE);
                (0..30).for_each(|_| estimate.add(&measured, Some(SampledParts { parts: &parts, tiles })));
                let image_s = estimate.now().costs.sample_image_s;
                assert!((image_s / (5.0 * slow) - 1.0).abs() < 0.01, "{tiles} {parts:?}: {image_s} of {}", 5.0 * slow);
            }
        }
    }
}
