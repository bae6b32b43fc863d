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
        let shares_of = |(set, count): (usize, usize)| {
            let shares = shares(first..first + count, weights, rounding(set, count, weights.len()));
            first += count;
            shares
        };
        Self { sets: runs.into_iter().enumerate().map(shares_of).collect() }
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

/// Where the ends of a set's shares are rounded up, in parts of 2³²: at a half in the first set, and in the others evenly
/// spread, so that compositors take turns with what is left over. Fewer views than compositors stay where they are: to make
/// one, a set must be loaded.
fn rounding(set: usize, views: usize, compositors: usize) -> u32 {
    /// The golden section: no two sets, however many, are close to each other.
    const STEP: u32 = 0x9e37_79b9;
    let turn = if views < compositors { 0 } else { set as u32 };
    (1_u32 << 31).wrapping_add(turn.wrapping_mul(STEP))
}

/// Contiguous shares in proportion to weights, their ends rounded.
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

/// Cut off from a share: all of one that is hardly worth two calls to the device.
fn back_half(share: &mut Range<usize>) -> Range<usize> {
    let middle = if share.len() <= FEW_VIEWS { share.start } else { share.start + share.len() / 2 };
    let half = middle..share.end;
    share.end = middle;
    half
}

/// Messages shorter than this show the network's delay, longer ones let a slow node keep others waiting at the end.
const MESSAGE_S: Range<f64> = 0.1..0.4;
/// Fewer would not pay, for a call to the device costs more than a view,
const FEW_VIEWS: usize = 8;
/// unless they take longer than this.
const FEW_VIEWS_S: f64 = 1.0;
/// Most before anything has come.
const MOST_FIRST_VIEWS: usize = 64;

/// What a client has asked one compositor for: at any time two messages' worth of views, one being made while the other
/// waits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// Of the next message.
    views: usize,
    /// Asked for, and not come.
    under_way: usize,
    /// Since when how many views have come after that, and whether one of them waited for its sample set.
    since_s: Option<f64>,
    lately: usize,
    waited: bool,
}

impl Asked {
    /// Nothing yet, of a compositor that needs about so many seconds for a view; 0 where that is not known.
    #[must_use]
    pub fn new(view_s: f64) -> Self {
        let views = (MESSAGE_S.start + MESSAGE_S.end) / 2.0 / view_s;
        // A cast saturates: views that take no time are as many as may be.
        let views = (views as usize).max(fewest(view_s)).min(MOST_FIRST_VIEWS);
        Self { views, under_way: 0, since_s: None, lately: 0, waited: false }
    }

    /// How many views the next message should have, if there should be one.
    #[must_use]
    pub fn room(&self) -> Option<usize> {
        (self.under_way <= self.views).then_some(self.views)
    }

    /// A message is sent.
    pub fn ask(&mut self, views: usize) {
        self.under_way += views;
    }

    /// Whether nothing is under way.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.under_way == 0
    }

    /// A view has come, though it may be one that another compositor was asked for. Where it waited for its sample set, it
    /// does not say how fast the compositor is.
    pub fn came(&mut self, now_s: f64, waited_for_set: bool) {
        self.under_way = self.under_way.saturating_sub(1);
        self.lately += 1;
        self.waited |= waited_for_set;
        // A batch's views come all at once: from the first of one to the first of another.
        let since_s = self.since_s.unwrap_or(f64::NEG_INFINITY);
        if now_s - since_s >= MESSAGE_S.start {
            if since_s.is_finite() && !self.waited {
                self.adapt(self.lately, now_s - since_s);
            }
            (self.since_s, self.lately, self.waited) = (Some(now_s), 0, false);
        }
    }

    /// So many views came in so many seconds.
    fn adapt(&mut self, views: usize, seconds: f64) {
        let view_s = seconds / views.max(1) as f64;
        self.views = match view_s * self.views as f64 {
            message_s if message_s < MESSAGE_S.start => (2 * self.views).min(MAX_VIEWS_PER_REQUEST),
            message_s if message_s > MESSAGE_S.end => (self.views / 2).max(fewest(view_s)),
            _ => self.views,
        };
    }
}

/// Of a message, where a view takes so long.
fn fewest(view_s: f64) -> usize {
    ((FEW_VIEWS_S / view_s) as usize).clamp(1, FEW_VIEWS)
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
    fn compositors_take_turns_with_what_is_left_over() {
        for (views, weights) in [(3, vec![1, 1]), (5, vec![7; 4]), (7, vec![3, 1]), (19, vec![1; 11])] {
            let deal = Deal::new([views; 400], &weights);
            for (compositor, &weight) in weights.iter().enumerate() {
                let own: Vec<usize> = deal.sets.iter().map(|shares| shares[compositor].len()).collect();
                let even = views as f64 * f64::from(weight) / f64::from(weights.iter().sum::<u32>());
                assert!(own.iter().all(|&own| (own as f64 - even).abs() < 1.0), "{views} by {weights:?}");
                let mean = own.iter().sum::<usize>() as f64 / 400.0;
                assert!((mean - even).abs() < 0.01, "{views} by {weights:?}: {mean}, not {even}");
            }
        }
    }

    #[test]
    fn few_views_are_always_made_by_the_same() {
        let deal = Deal::new([2; 9], &[5; 4]);
        let first = |shares: &Vec<Range<usize>>| shares.iter().map(Range::len).collect::<Vec<_>>();
        assert!(deal.sets.iter().all(|shares| first(shares) == first(&deal.sets[0])), "each would load every set");
    }

    #[test]
    fn a_small_rest_goes_whole() {
        let mut deal = Deal::new([40], &[1, 1]);
        assert_eq!((deal.take(0, 20), deal.take(1, 12)), (Some(0..20), Some(20..32)));
        assert_eq!((deal.take(0, 9), deal.take(1, 9)), (Some(32..40), None));
    }

    #[test]
    fn whoever_is_done_takes_half_of_the_largest_rest() {
        let mut deal = Deal::new([90], &[1, 1, 1]);
        assert_eq!((deal.take(0, 30), deal.take(1, 10)), (Some(0..30), Some(30..40)));
        assert_eq!(deal.take(0, 100), Some(75..90), "the third's");
        assert_eq!(deal.take(0, 100), Some(50..60));
        assert_eq!((deal.take(1, 100), deal.take(2, 100)), (Some(40..50), Some(60..75)));
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
        for (view_s, views) in [(1e-5, MAX_VIEWS_PER_REQUEST), (0.001, 128), (0.01, 16), (0.2, 5), (3.0, 1)] {
            for guess_s in [0.0, 1e-6, view_s, 100.0] {
                let (mut asked, mut now_s) = (Asked::new(guess_s), 0.0);
                let mut batches = 0;
                while batches < 40 || now_s < 10.0 {
                    batches += 1;
                    let message = asked.room().unwrap();
                    asked.ask(message);
                    now_s += message as f64 * view_s;
                    // A batch of the device.
                    (0..message).for_each(|_| asked.came(now_s, false));
                }
                let message_s = asked.views as f64 * view_s;
                assert!(
                    asked.views.abs_diff(views) <= 1 || MESSAGE_S.contains(&message_s),
                    "{view_s} {guess_s}: {asked:?}"
                );
            }
        }
    }

    #[test]
    fn two_messages_of_views_are_under_way() {
        let mut asked = Asked::new(0.02);
        assert_eq!((asked.room(), asked.is_empty()), (Some(12), true));
        (0..12).for_each(|_| asked.ask(1));
        assert_eq!(asked.room(), Some(12), "views count, not messages");
        asked.ask(12);
        assert_eq!(asked.room(), None);
        (1..=12).for_each(|view| asked.came(0.02 * f64::from(view), false));
        assert_eq!((asked.room(), asked.views), (Some(12), 12));
        (1..=12).for_each(|view| asked.came(60.0 + 0.02 * f64::from(view), true));
        assert_eq!((asked.views, asked.is_empty()), (12, true), "it was the samples that were late");
        asked.came(60.3, false);
        assert_eq!((asked.room(), asked.is_empty()), (Some(asked.views), true), "nobody asked for it");
    }
}
