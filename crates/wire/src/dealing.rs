//! Who makes which views of a batch, decided while it is made.
//!
//! Every compositor begins with a contiguous share of each set by its weight, and is asked for little of it at a time.
//! Whoever has asked for all of its own takes the back half of the largest rest: how fast a node is shows soonest in
//! what it delivers (Lages §6, dynamic load balancing).

use std::collections::VecDeque;
use std::ops::Range;

use crate::limits::MAX_VIEWS_PER_REQUEST;

/// The views of one call that nobody has been asked for yet, as places in the caller's list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Deal {
    /// Of each set a share for every compositor; sets of which nothing is left are gone.
    sets: VecDeque<Vec<Range<usize>>>,
}

impl Deal {
    /// Of runs of so many views of one set each, one behind the other. Weights that are all zero say nothing.
    #[must_use]
    pub fn new(runs: impl IntoIterator<Item = usize>, weights: &[u32]) -> Self {
        let weights = if weights.iter().all(|&weight| weight == 0) { &vec![1; weights.len()] } else { weights };
        let mut first = 0;
        let shares_of = |count: usize| {
            let shares = shares(first, count, weights);
            first += count;
            shares
        };
        Self { sets: runs.into_iter().map(shares_of).collect() }
    }

    /// The next views of a compositor's own share, at most so many and of one set: who has none is not worth the loading
    /// of a set.
    pub fn take_own(&mut self, compositor: usize, most: usize) -> Option<Range<usize>> {
        let own = self
            .sets
            .iter_mut()
            .filter_map(|shares| shares.get_mut(compositor))
            .find(|share| !Range::is_empty(share))?;
        Some(cut_front(own, most))
    }

    /// The next views for a compositor, of the first set of which any are left: its own, or else others'.
    pub fn take(&mut self, compositor: usize, most: usize) -> Option<Range<usize>> {
        while self.sets.front().is_some_and(|shares| shares.iter().all(Range::is_empty)) {
            self.sets.pop_front();
        }
        let shares = self.sets.front_mut()?;
        if shares.get(compositor)?.is_empty() {
            shares[compositor] = back_half(shares.iter_mut().max_by_key(|share| share.len())?);
        }
        Some(cut_front(&mut shares[compositor], most))
    }
}

fn cut_front(share: &mut Range<usize>, most: usize) -> Range<usize> {
    let front = share.start..share.end.min(share.start + most);
    share.start = front.end;
    front
}

/// Contiguous shares in proportion to weights; of few views the greater ones get more.
fn shares(first: usize, count: usize, weights: &[u32]) -> Vec<Range<usize>> {
    let all: u64 = weights.iter().copied().map(u64::from).sum();
    let end = |before: u64| first + ((count as u64 * before + all / 2) / all.max(1)) as usize;
    let mut before = 0;
    let share = |&weight: &u32| {
        let start = end(before);
        before += u64::from(weight);
        start..end(before)
    };
    weights.iter().map(share).collect()
}

/// Cut off from a share: one view at least where there is any.
fn back_half(share: &mut Range<usize>) -> Range<usize> {
    let middle = share.start + share.len() / 2;
    let half = middle..share.end;
    share.end = middle;
    half
}

/// Views that a compositor is asked for in one message. It has two on its way: while one is made the other waits.
const FIRST_VIEWS: usize = 16;
/// A call to the device costs more than a view: fewer would not pay.
const FEWEST_VIEWS: usize = 8;
/// Shorter, and the network's delay shows; longer, and a slow node keeps others waiting at the end.
const MESSAGE_S: Range<f64> = 0.1..0.4;

/// How much a compositor is asked for at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pace {
    views: usize,
}

impl Default for Pace {
    fn default() -> Self {
        Self { views: FIRST_VIEWS }
    }
}

impl Pace {
    /// Messages that are under way at a time.
    pub const MESSAGES: usize = 2;

    /// Of the next message.
    #[must_use]
    pub fn views(self) -> usize {
        self.views
    }

    /// A message's views have come, all in so many seconds.
    pub fn came(&mut self, views: usize, seconds: f64) {
        self.views = match seconds * self.views as f64 / views.max(1) as f64 {
            full_s if full_s < MESSAGE_S.start => (2 * self.views).min(MAX_VIEWS_PER_REQUEST),
            full_s if full_s > MESSAGE_S.end => (self.views / 2).max(FEWEST_VIEWS),
            _ => self.views,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compositors that take 8 views at a time, whoever is done first by the seconds that a view takes each.
    fn run(deal: &mut Deal, view_s: &[f64]) -> (Vec<Vec<Range<usize>>>, Vec<f64>) {
        let (mut taken, mut free_s) = (vec![Vec::new(); view_s.len()], vec![0.0; view_s.len()]);
        loop {
            let next = (0..view_s.len()).min_by(|&a, &b| f64::total_cmp(&free_s[a], &free_s[b])).unwrap();
            let Some(views) = deal.take(next, 8) else { return (taken, free_s) };
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
    fn equal_nodes_keep_their_shares() {
        let mut deal = Deal::new([40, 40], &[1, 1]);
        assert_eq!(deal.take(0, 16), Some(0..16));
        assert_eq!(deal.take(1, 100), Some(20..40));
        assert_eq!(deal.take(0, 16), Some(16..20));
        assert_eq!(deal.take(1, 16), Some(60..76), "the first set is all under way");
        assert_eq!(deal.take(0, 64), Some(40..60));
        assert_eq!((deal.take(1, 64), deal.take(1, 64), deal.take(0, 1)), (Some(76..80), None, None));
    }

    #[test]
    fn whoever_is_done_takes_half_of_the_largest_rest() {
        let mut deal = Deal::new([90], &[1, 1, 1]);
        assert_eq!((deal.take(0, 30), deal.take(1, 10)), (Some(0..30), Some(30..40)));
        assert_eq!(deal.take(0, 100), Some(75..90), "the third's");
        assert_eq!(deal.take(0, 100), Some(50..60));
        assert_eq!(deal.take(2, 100), Some(60..75));
    }

    #[test]
    fn a_slow_node_keeps_nobody_waiting() {
        let view_s = [0.01, 0.01, 0.04, 0.01];
        let (taken, free_s) = run(&mut Deal::new([400, 400, 400], &[1; 4]), &view_s);
        assert_eq!(in_order(&taken), (0..1200).collect::<Vec<_>>());
        let even_s: f64 = 1200.0 / view_s.iter().map(|view_s| 1.0 / view_s).sum::<f64>();
        let last_s = free_s.iter().copied().fold(0.0, f64::max);
        // By equal shares it would be 12 s; 8 views of the slow node are 0.32 s.
        assert!(last_s < even_s + 0.32 && even_s < 3.7, "{last_s} {even_s}");
    }

    #[test]
    fn no_view_is_lost_or_made_twice() {
        for weights in [vec![0, 0, 0], vec![5, 0, 1], vec![1], vec![65_535, 1, 1, 7]] {
            for runs in [vec![0], vec![1], vec![7, 1, 300], vec![2, 2, 2]] {
                let mut deal = Deal::new(runs.iter().copied(), &weights);
                let mut taken: Vec<_> = (0..weights.len()).filter_map(|at| deal.take_own(at, 2)).collect();
                taken.extend(std::iter::from_fn(|| deal.take(0, 8)));
                assert!(taken.iter().all(|views| (1..=8).contains(&views.len())));
                assert_eq!(in_order(&[taken]), (0..runs.iter().sum()).collect::<Vec<_>>(), "{weights:?} {runs:?}");
            }
        }
        assert_eq!(Deal::new([2], &[1, 0]).take_own(1, 9), None);
        assert_eq!(Deal::new([3], &[1]).take(7, 1), None, "no such compositor");
    }

    #[test]
    fn a_message_lasts_a_few_tenths_of_a_second() {
        for (view_s, views) in [(1e-5, MAX_VIEWS_PER_REQUEST), (0.001, 128), (0.01, 16), (0.2, FEWEST_VIEWS)] {
            let mut pace = Pace::default();
            (0..12).for_each(|_| pace.came(4, view_s * 4.0));
            assert_eq!(pace.views(), views, "{view_s}");
        }
    }
}
