//! The distribution of a batch's views among compositors, by work stealing.
//!
//! Every compositor begins with a contiguous share of each set by its weight, and is asked for little of it at a time. A
//! compositor whose share is used up takes the back half of the largest share that is left. Deliveries show a node's speed
//! sooner than anything else (Lages §6, dynamic load balancing).

use std::collections::VecDeque;
use std::ops::Range;

/// Fewer views in a message do not pay: a call to the device costs more than a view.
pub(crate) const FEW_VIEWS: usize = 8;

/// The views of a batch that have not been requested yet, as places in the order of the caller's requests. Further sets may
/// be added at any time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkStealing {
    /// A share for every compositor, for each set; sets without views are removed.
    sets: VecDeque<Vec<Range<usize>>>,
    weights: Vec<u32>,
    /// Sets so far, and their views.
    set_count: usize,
    view_count: usize,
    /// Views of all shares.
    left: usize,
}

impl WorkStealing {
    /// Each of `runs` is a number of consecutive views of one set. Weights that are all zero count as equal.
    #[must_use]
    pub fn new(runs: impl IntoIterator<Item = usize>, weights: &[u32]) -> Self {
        let is_weighted = weights.iter().any(|&weight| weight > 0);
        let weights = if is_weighted { weights.to_vec() } else { vec![1; weights.len()] };
        let mut views = Self { sets: VecDeque::new(), weights, set_count: 0, view_count: 0, left: 0 };
        runs.into_iter().for_each(|count| views.push(count));
        views
    }

    /// Adds the next views, which are of one set.
    pub fn push(&mut self, count: usize) {
        let views = self.view_count..self.view_count + count;
        let rounding = rounding(self.set_count, count, self.weights.len());
        self.sets.push_back(shares(views.clone(), &self.weights, rounding));
        (self.set_count, self.view_count, self.left) = (self.set_count + 1, views.end, self.left + count);
    }

    /// Views that have not been requested.
    #[must_use]
    pub fn left(&self) -> usize {
        self.left
    }

    /// The first place that may not have been requested.
    pub(crate) fn first_left(&self) -> usize {
        let of_first = self.sets.front().into_iter().flatten().filter(|share| !Range::is_empty(share));
        of_first.map(|share| share.start).min().unwrap_or(0)
    }

    /// The next views of a compositor's own share, at most `most` and of one set. A compositor without a share gets none: it
    /// would have to load a set.
    pub fn take_local(&mut self, compositor: usize, most: usize) -> Option<Range<usize>> {
        let own = self
            .sets
            .iter_mut()
            .filter_map(|shares| shares.get_mut(compositor))
            .find(|share| !Range::is_empty(share))?;
        let views = cut_front(own, most);
        self.left -= views.len();
        Some(views)
    }

    /// The next views for a compositor, at most `most`, of the first set that has any: its own, or else stolen ones.
    pub fn take(&mut self, compositor: usize, most: usize) -> Option<Range<usize>> {
        while self.sets.front().is_some_and(|shares| shares.iter().all(Range::is_empty)) {
            self.sets.pop_front();
        }
        let shares = self.sets.front_mut()?;
        if shares.get(compositor)?.is_empty() {
            shares[compositor] = back_half(shares.iter_mut().max_by_key(|share| share.len())?);
        }
        let views = cut_front(&mut shares[compositor], most);
        self.left -= views.len();
        Some(views)
    }
}

fn cut_front(share: &mut Range<usize>, most: usize) -> Range<usize> {
    let front = share.start..share.end.min(share.start + most);
    share.start = front.end;
    front
}

/// The fraction from which the ends of a set's shares are rounded up, in parts of 2³². It is a half in the first set, and
/// evenly spread in the others, so that compositors take turns with the remainder. Sets of fewer views than compositors are all
/// rounded alike: to make one view, a set must be loaded.
fn rounding(set: usize, views: usize, compositors: usize) -> u32 {
    /// The golden section spreads any number of sets evenly.
    const STEP: u32 = 0x9e37_79b9;
    let turn = if views < compositors { 0 } else { set as u32 };
    (1_u32 << 31).wrapping_add(turn.wrapping_mul(STEP))
}

/// Contiguous shares in proportion to the weights, their ends rounded.
fn shares(views: Range<usize>, weights: &[u32], rounding: u32) -> Vec<Range<usize>> {
    let all: u64 = weights.iter().copied().map(u64::from).sum();
    let up = (all * u64::from(rounding)) >> 32;
    let end = |before: u64| views.start + ((views.len() as u64 * before + up) / all.max(1)) as usize;
    let mut before = 0;
    let share = |&weight: &u32| {
        let start = end(before);
        before += u64::from(weight);
        start..end(before)
    };
    weights.iter().map(share).collect()
}

/// Takes the back half of a share, or all of it where two calls to the device do not pay.
fn back_half(share: &mut Range<usize>) -> Range<usize> {
    let middle = if share.len() <= FEW_VIEWS { share.start } else { share.start + share.len() / 2 };
    let half = middle..share.end;
    share.end = middle;
    half
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compositors that take 8 views at a time, the one that is done first next; `view_s` holds their seconds a view.
    fn run(views: &mut WorkStealing, view_s: &[f64]) -> (Vec<Vec<Range<usize>>>, Vec<f64>) {
        let (mut taken, mut free_s) = (vec![Vec::new(); view_s.len()], vec![0.0; view_s.len()]);
        loop {
            let next = (0..view_s.len()).min_by(|&a, &b| f64::total_cmp(&free_s[a], &free_s[b])).unwrap();
            let Some(views) = views.take(next, 8) else { return (taken, free_s) };
            free_s[next] += views.len() as f64 * view_s[next];
            taken[next].push(views);
        }
    }

    fn in_order(taken: &[Vec<Range<usize>>]) -> Vec<usize> {
        let mut all: Vec<usize> = taken.iter().flatten().cloned().flatten().collect();
        all.sort_unstable();
        all
    }

    #[test]
    fn equal_compositors_make_their_own_shares() {
        let mut views = WorkStealing::new([40, 40], &[1, 1]);
        assert_eq!(views.take(0, 16), Some(0..16));
        assert_eq!(views.take(1, 100), Some(20..40));
        assert_eq!(views.take(0, 16), Some(16..20));
        assert_eq!(views.take(1, 16), Some(60..76), "the first set is all under way");
        assert_eq!(views.take(0, 64), Some(40..60));
        assert_eq!((views.take(1, 64), views.take(1, 64), views.take(0, 1)), (Some(76..80), None, None));
    }

    #[test]
    fn sets_that_are_added_later_are_shared_as_those_given_at_once() {
        let (mut early, mut late) = (WorkStealing::new([30, 7, 20], &[1, 2]), WorkStealing::new([30], &[1, 2]));
        late.push(7);
        late.push(20);
        assert_eq!(early, late);
        assert_eq!((early.take(0, 10), early.take(1, 3), early.left()), (Some(0..10), Some(10..13), 44));
        assert_eq!(early.first_left(), 13, "the first compositor's share is used up");
    }

    #[test]
    fn compositors_take_turns_with_the_remainder() {
        for (views, weights) in [(3, vec![1, 1]), (5, vec![7; 4]), (7, vec![3, 1]), (19, vec![1; 11])] {
            let shared = WorkStealing::new([views; 400], &weights);
            for (compositor, &weight) in weights.iter().enumerate() {
                let own: Vec<usize> = shared.sets.iter().map(|shares| shares[compositor].len()).collect();
                let even = views as f64 * f64::from(weight) / f64::from(weights.iter().sum::<u32>());
                assert!(own.iter().all(|&own| (own as f64 - even).abs() < 1.0), "{views} by {weights:?}");
                let mean = own.iter().sum::<usize>() as f64 / 400.0;
                assert!((mean - even).abs() < 0.01, "{views} by {weights:?}: {mean}, not {even}");
            }
        }
    }

    #[test]
    fn sets_of_few_views_are_all_shared_alike() {
        let views = WorkStealing::new([2; 9], &[5; 4]);
        let first = |shares: &Vec<Range<usize>>| shares.iter().map(Range::len).collect::<Vec<_>>();
        assert!(views.sets.iter().all(|shares| first(shares) == first(&views.sets[0])), "each would load every set");
    }

    #[test]
    fn a_small_share_is_stolen_whole() {
        let mut views = WorkStealing::new([40], &[1, 1]);
        assert_eq!((views.take(0, 20), views.take(1, 12)), (Some(0..20), Some(20..32)));
        assert_eq!((views.take(0, 9), views.take(1, 9)), (Some(32..40), None));
    }

    #[test]
    fn a_compositor_without_views_takes_half_of_the_largest_share() {
        let mut views = WorkStealing::new([90], &[1, 1, 1]);
        assert_eq!((views.take(0, 30), views.take(1, 10)), (Some(0..30), Some(30..40)));
        assert_eq!(views.take(0, 100), Some(75..90), "the third's");
        assert_eq!(views.take(0, 100), Some(50..60));
        assert_eq!((views.take(1, 100), views.take(2, 100)), (Some(40..50), Some(60..75)));
    }

    #[test]
    fn a_slow_compositor_does_not_delay_the_batch() {
        let view_s = [0.01, 0.01, 0.04, 0.01];
        let (taken, free_s) = run(&mut WorkStealing::new([400, 400, 400], &[1; 4]), &view_s);
        assert_eq!(in_order(&taken), (0..1200).collect::<Vec<_>>());
        let even_s: f64 = 1200.0 / view_s.iter().map(|view_s| 1.0 / view_s).sum::<f64>();
        let last_s = free_s.iter().copied().fold(0.0, f64::max);
        // By equal shares it would be 12 s; 8 views of the slow node are 0.32 s.
        assert!(last_s < even_s + 0.32 && even_s < 3.7, "{last_s} {even_s}");
    }

    #[test]
    fn every_view_is_made_once_for_any_weights_and_runs() {
        for weights in [vec![0, 0, 0], vec![5, 0, 1], vec![1], vec![65_535, 1, 1, 7]] {
            for runs in [vec![0], vec![1], vec![7, 1, 300], vec![2, 2, 2]] {
                let mut views = WorkStealing::new(runs.iter().copied(), &weights);
                let mut taken: Vec<_> = (0..weights.len()).filter_map(|at| views.take_local(at, 2)).collect();
                taken.extend(std::iter::from_fn(|| views.take(0, 8)));
                assert!(taken.iter().all(|views| (1..=8).contains(&views.len())));
                assert_eq!(in_order(&[taken]), (0..runs.iter().sum()).collect::<Vec<_>>(), "{weights:?} {runs:?}");
            }
        }
        assert_eq!(WorkStealing::new([2], &[1, 0]).take_local(1, 9), None);
        assert_eq!(WorkStealing::new([3], &[1]).take(7, 1), None, "no such compositor");
    }
}
