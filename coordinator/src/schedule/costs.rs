//! What operations cost each node: its own timings, smoothed.

use std::collections::VecDeque;

use cluster::{Costs, MeasuredCosts, TileCosts};

/// Reports without a timing after which it no longer counts: what the node does meanwhile says how slow it is.
const RECENT: u32 = 30;
/// Timings of which the median counts.
const MEDIAN_OF: usize = 5;
/// What the moving average takes of a new median.
const ALPHA: f64 = 0.2;
/// Nodes are equal when none needs so many times what another does.
const EQUAL_WITHIN: f64 = 1.1;
/// What is known beforehand of what tiles take is off by up to so many times.
const TILES_WITHIN: f64 = 1.5;

fn is_about_one(ratio: f64) -> bool {
    (TILES_WITHIN.recip()..=TILES_WITHIN).contains(&ratio)
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
                tiles: TileCosts::of_image(
                    mean(|n| n.costs.sample_image_s),
                    mean(|n| n.costs.tile_overhead_s()),
                    nodes.first().and_then(|n| n.costs.tiles?.row_shares),
                ),
            },
            transfer_image_s: mean(|n| n.transfer_image_s),
        }
    }

    /// Where nodes sample tiles: who needs about as long for them as most is as fast as those, and has had other tiles.
    pub(super) fn level_sampling(nodes: &mut [Self]) {
        let Some(middle_s) = median(nodes.iter().map(|node| node.costs.sample_image_s)) else { return };
        let is_like_most = |node: &Self| is_about_one(node.costs.sample_image_s / middle_s);
        let mean = Self::mean(&nodes.iter().copied().filter(is_like_most).collect::<Vec<_>>()).costs;
        for node in nodes.iter_mut().filter(|node| is_like_most(node)) {
            node.costs.sample_image_s = mean.sample_image_s;
            node.costs.tiles = node
                .costs
                .tiles
                .zip(mean.tiles)
                .map(|(tiles, mean)| TileCosts { overhead_s: mean.overhead_s, ..tiles });
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
        let median = median(self.last.iter().copied()).unwrap_or(timing);
        self.value = Some(self.value.map_or(median, |value| value + ALPHA * (median - value)));
    }

    /// The next timing counts at once.
    fn begin_anew(&mut self) {
        (self.last, self.value) = (VecDeque::new(), None);
    }

    fn or_zero(&self) -> f64 {
        self.value.unwrap_or(0.0)
    }
}

/// Of an even number the lower one: the first timing may have built shaders.
fn median(timings: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = timings.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len().saturating_sub(1) / 2).copied()
}

/// A first timing that is so many times what was expected is of a node that has built shaders meanwhile.
const COLD: f64 = 2.0;

/// One operation: as measured alone, and as timed since.
#[derive(Debug, Clone, Default)]
struct Operation {
    alone_s: f64,
    /// Whether it has been done, and so will not be cold again.
    is_warm: bool,
    timed: Smoothed,
    reports_without: u32,
}

impl Operation {
    fn starting_at(alone_s: f64) -> Self {
        Self { alone_s, is_warm: false, timed: Smoothed::starting_at(alone_s), reports_without: 0 }
    }

    /// How many times longer than alone, if anything can be said.
    fn add(&mut self, timing_s: Option<f64>, slowness: f64) -> Option<f64> {
        let was_cold = !self.is_warm && timing_s.is_some_and(|timing_s| timing_s > COLD * self.alone_s * slowness);
        self.is_warm |= timing_s.is_some();
        let timing_s = timing_s.filter(|_| !was_cold);
        if self.timed.last.is_empty() {
            // Until now it was taken to be as slow as the rest.
            self.timed.value = self.timed.value.map(|_| self.alone_s * slowness);
        }
        let timing_s = timing_s.filter(|timing_s| timing_s.is_finite() && *timing_s >= 0.0);
        self.reports_without = if timing_s.is_some() { 0 } else { self.reports_without.saturating_add(1) };
        self.timed.add(timing_s);
        timing_s.map(|timing_s| timing_s / self.alone_s).filter(|ratio| ratio.is_finite() && *ratio > 0.0)
    }

    fn is_timed(&self) -> bool {
        !self.timed.last.is_empty() && self.reports_without <= RECENT
    }

    /// What has not been timed for long is `slowness` times slower than alone.
    fn now_s(&self, slowness: f64) -> f64 {
        if self.is_timed() { self.timed.or_zero() } else { self.alone_s * slowness }
    }

    /// How many times longer than alone, where that is known.
    fn ratio(&self) -> Option<f64> {
        let ratio = self.timed.or_zero() / self.alone_s;
        Some(ratio).filter(|ratio| self.is_timed() && ratio.is_finite() && *ratio > 0.0)
    }
}

/// How many times longer than alone each operation takes now, in the order of [`Estimate::operations`]; `None` where nobody
/// has timed it.
pub(super) type Ratios = [Option<f64>; OPERATIONS];

const OPERATIONS: usize = 5;
/// The first of them are the device's alone, and say how fast a node is: loading a set runs beside views, and encoding one
/// is over before it can be timed well.
const OF_DEVICE: usize = 3;

/// Of all nodes together: what takes longer at work than alone, as loading a set beside views does, takes so on every node.
/// What a single node has timed says as much of that node as of the work.
pub(super) fn common_ratios<'a>(estimates: impl Iterator<Item = &'a Estimate>) -> Ratios {
    let all: Vec<Ratios> = estimates.map(Estimate::ratios).collect();
    std::array::from_fn(|operation| {
        let timed = all.iter().filter_map(|ratios| ratios[operation]);
        geometric_mean(timed.clone()).filter(|_| timed.count() > 1)
    })
}

/// One node's costs as its timings come in.
#[derive(Debug, Clone, Default)]
pub(super) struct Estimate {
    sample_image: Operation,
    direct_view: Operation,
    reconstruct_view: Operation,
    load_set: Operation,
    encode_view: Operation,
    /// How many times longer than alone what it does takes now.
    slowness: Smoothed,
    transfer_bytes_per_s: Smoothed,
    image_bytes: Smoothed,
    tiles: Option<TileCosts>,
    in_order: bool,
    /// Whether the last images were tiles.
    is_cut: bool,
}

/// What of each set a node has sampled: tiles by number, of images cut into so many.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sampled<'a> {
    pub(super) parts: &'a [u32],
    pub(super) tiles: u32,
}

impl Estimate {
    /// As measured when the session was opened.
    pub(super) fn starting_at(costs: &Costs) -> Self {
        Self {
            sample_image: Operation::starting_at(costs.sample_image_s),
            direct_view: Operation::starting_at(costs.direct_view_s),
            reconstruct_view: Operation::starting_at(costs.reconstruct_view_s),
            load_set: Operation::starting_at(costs.load_set_s),
            encode_view: Operation::starting_at(costs.encode_view_s),
            tiles: costs.tiles,
            in_order: costs.in_order,
            ..Self::default()
        }
    }

    /// Timings of one report, and what of each set was sampled, if it is known.
    pub(super) fn add(&mut self, measured: &MeasuredCosts, sampled: Option<Sampled<'_>>) {
        let slowness = self.slowness.value.unwrap_or(1.0);
        // Of tiles that nobody knows any more, of a plan that is gone, nothing can be said.
        let is_known = sampled.is_some() || !self.is_cut;
        let image_s = measured.sample_image_s.filter(|_| is_known).map(|s| self.whole_image_s(s, sampled));
        // A tile that takes somewhat longer than expected does not say that the node is slow.
        self.is_cut = sampled.map_or(self.is_cut, |sampled| sampled.tiles > 1);
        let is_cut = self.is_cut;
        let of_node = |ratio: f64| if is_cut && is_about_one(ratio) { 1.0 } else { ratio };
        let ratios = [
            self.sample_image.add(image_s, slowness).map(of_node),
            self.direct_view.add(measured.direct_view_s, slowness),
            self.reconstruct_view.add(measured.reconstruct_view_s, slowness),
            self.load_set.add(measured.load_set_s, slowness),
            self.encode_view.add(measured.encode_view_s, slowness),
        ];
        self.slowness.add(geometric_mean(ratios.into_iter().take(OF_DEVICE).flatten()));
        // Nothing moves at 0 bytes/s: that is no rate.
        self.transfer_bytes_per_s.add(measured.transfer_bytes_per_s.filter(|rate| *rate > 0.0));
        self.image_bytes.add(measured.image_bytes);
    }

    /// What a mean image takes a node whose tiles take so long, each times their number in an image: tiles cost something
    /// each, and one that shows the sky less than another, so that nodes that are equal would seem not to be.
    fn whole_image_s(&self, tiles_s: f64, sampled: Option<Sampled<'_>>) -> f64 {
        let Some(Sampled { parts, tiles }) = sampled.filter(|sampled| sampled.tiles > 1) else { return tiles_s };
        let alone = self.alone();
        let tile_s = |&part: &u32| alone.sample_this_tile_s((part % tiles) as usize, tiles as usize);
        let expected_s = parts.iter().map(tile_s).sum::<f64>() / parts.len() as f64 * f64::from(tiles);
        let ratio = tiles_s / expected_s;
        if ratio.is_finite() { alone.sample_image_s * ratio } else { tiles_s }
    }

    /// What is known of sampling from when the session was opened.
    fn alone(&self) -> Costs {
        Costs { sample_image_s: self.sample_image.alone_s, tiles: self.tiles, ..Costs::default() }
    }

    /// Other work is done from here on: the next timings count at once.
    pub(super) fn begin_anew(&mut self) {
        for operation in [
            &mut self.sample_image,
            &mut self.direct_view,
            &mut self.reconstruct_view,
            &mut self.load_set,
            &mut self.encode_view,
        ] {
            operation.timed.begin_anew();
        }
    }

    fn operations(&self) -> [&Operation; OPERATIONS] {
        [&self.sample_image, &self.direct_view, &self.reconstruct_view, &self.load_set, &self.encode_view]
    }

    fn ratios(&self) -> Ratios {
        self.operations().map(Operation::ratio)
    }

    pub(super) fn now(&self) -> NodeCosts {
        self.now_among(&Ratios::default())
    }

    /// Where others have timed what this node has not, that takes it as much longer than alone as it takes them, and as much
    /// longer again as it is slower than they are.
    pub(super) fn now_among(&self, common: &Ratios) -> NodeCosts {
        let slowness = self.slowness.value.unwrap_or(1.0);
        let than_others = self.than_others(common);
        let now_s = |operation: usize| {
            let ratio = common[operation].map_or(slowness, |common| common * than_others);
            self.operations()[operation].now_s(ratio)
        };
        let costs = Costs {
            sample_image_s: now_s(0),
            direct_view_s: now_s(1),
            reconstruct_view_s: now_s(2),
            load_set_s: now_s(3),
            encode_view_s: now_s(4),
            in_order: self.in_order,
            tiles: self.tiles_at(now_s(0)),
        };
        let image_bytes = self.image_bytes.or_zero();
        let transfer_image_s = self.transfer_bytes_per_s.value.map_or(0.0, |rate| image_bytes / rate);
        NodeCosts { costs, transfer_image_s }
    }

    /// How many times slower than other nodes, by what both have timed.
    fn than_others(&self, common: &Ratios) -> f64 {
        let both = self.ratios().into_iter().zip(common).take(OF_DEVICE).enumerate();
        let ratios = both.filter_map(|(operation, (own, common))| {
            let ratio = own? / (*common)?;
            let is_tiles = self.is_cut && operation == 0 && is_about_one(ratio);
            Some(if is_tiles { 1.0 } else { ratio })
        });
        geometric_mean(ratios).unwrap_or(1.0)
    }

    /// A tile's overhead grows with the cost of an image.
    fn tiles_at(&self, sample_image_s: f64) -> Option<TileCosts> {
        let ratio = sample_image_s / self.sample_image.alone_s;
        let ratio = if ratio.is_finite() { ratio } else { 1.0 };
        self.tiles.map(|tiles| TileCosts { overhead_s: tiles.overhead_s * ratio, ..tiles })
    }
}

fn geometric_mean(ratios: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = ratios.fold((0.0, 0.0), |(sum, count), ratio| (sum + ratio.ln(), count + 1.0));
    (count > 0.0).then(|| (sum / count).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schedule::test_support::DEAR;

    fn sampled(estimate: &mut Estimate, sample_image_s: f64) -> f64 {
        estimate.add(&MeasuredCosts { sample_image_s: Some(sample_image_s), ..MeasuredCosts::default() }, None);
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
        let stalled =
            MeasuredCosts { transfer_bytes_per_s: Some(0.0), image_bytes: Some(1e6), ..MeasuredCosts::default() };
        estimate.add(&stalled, None);
        assert_eq!(estimate.now().transfer_image_s, 0.0);
        estimate.add(&MeasuredCosts { transfer_bytes_per_s: Some(1e8), ..MeasuredCosts::default() }, None);
        assert!((estimate.now().transfer_image_s - 0.01).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_timed_is_as_slow_as_what_is() {
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
        let (now_s, slowness) = (estimate.now().costs.sample_image_s, estimate.slowness.value.unwrap());
        assert!((now_s - slowness).abs() < 1e-9 && slowness < 4.0, "no longer, after a while: {now_s}");
    }

    #[test]
    fn what_is_dearer_at_work_is_so_on_every_node() {
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
        assert!(slow_s > 0.2, "who samples slowly would be slow at views: {slow_s}");
    }

    #[test]
    fn a_node_that_is_cold_is_not_slow() {
        let mut estimate = Estimate::starting_at(&Costs { sample_image_s: 1.0, ..Costs::default() });
        assert_eq!(sampled(&mut estimate, 4.0), 1.0, "shaders were built");
        assert!((sampled(&mut estimate, 4.0) - 1.6).abs() < 1e-9, "they are there now");
    }

    #[test]
    fn other_work_counts_at_once() {
        let mut estimate = Estimate::starting_at(&Costs { sample_image_s: 1.0, ..Costs::default() });
        for _ in 0..9 {
            sampled(&mut estimate, 1.0);
        }
        estimate.begin_anew();
        assert_eq!(estimate.now().costs.sample_image_s, 1.0);
        assert_eq!(sampled(&mut estimate, 0.2), 0.2);
    }

    #[test]
    fn tiles_that_differ_do_not_make_nodes_differ() {
        for (tiles, parts) in [(4, vec![0]), (4, vec![2, 7]), (2, vec![1]), (8, vec![1, 2, 3]), (1, vec![0, 3])] {
            for slow in [1.0, 3.0] {
                let each_s = |&part: &u32| DEAR.sample_this_tile_s((part % tiles) as usize, tiles as usize);
                let tiles_s = slow * parts.iter().map(each_s).sum::<f64>() / parts.len() as f64 * f64::from(tiles);
                let measured = MeasuredCosts { sample_image_s: Some(tiles_s), ..MeasuredCosts::default() };
                let mut estimate = Estimate::starting_at(&DEAR);
                (0..30).for_each(|_| estimate.add(&measured, Some(Sampled { parts: &parts, tiles })));
                let image_s = estimate.now().costs.sample_image_s;
                assert!((image_s / (5.0 * slow) - 1.0).abs() < 0.01, "{tiles} {parts:?}: {image_s} of {}", 5.0 * slow);
            }
        }
    }

    #[test]
    fn a_slow_sampler_of_tiles_is_told_from_dear_tiles() {
        let of =
            |sample_image_s| NodeCosts { costs: Costs { sample_image_s, ..Costs::default() }, ..NodeCosts::default() };
        let mut nodes = [4.0, 5.0, 6.0, 5.0, 20.0].map(of);
        NodeCosts::level_sampling(&mut nodes);
        assert_eq!(nodes.map(|node| node.costs.sample_image_s), [5.0, 5.0, 5.0, 5.0, 20.0]);
        NodeCosts::level_sampling(&mut []);
        let mut idle = [0.0; 2].map(of);
        NodeCosts::level_sampling(&mut idle);
        assert_eq!(idle[0].costs.sample_image_s, 0.0, "nothing is known of anybody");
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
