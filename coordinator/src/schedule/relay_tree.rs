//! How sample images reach all compositors: each from the samplers, or passed on from compositor to compositor. A link
//! carries one image at a time in each direction.

use std::num::NonZeroU32;

/// Others that one compositor passes images on to. Fewer make longer ways, and shorter times a link.
const FANOUTS: [u32; 3] = [4, 2, 1];
/// A longer way must save more than this.
const WORTH: f64 = 1.1;

/// What links carry of one set.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Links {
    /// Of each sampler, seconds for one copy of what it makes.
    pub(super) sends_s: Vec<f64>,
    /// Of each compositor, in the order they are asked, seconds for one copy of the set.
    pub(super) receives_s: Vec<f64>,
}

/// The shortest way that is not clearly slower than the best, and the seconds of a set. All else takes `rest_s`.
pub(super) fn best_way(links: &Links, rest_s: f64) -> (Option<NonZeroU32>, f64) {
    let ways = std::iter::once(None).chain(FANOUTS.into_iter().map(NonZeroU32::new));
    let timed: Vec<_> = ways.map(|way| (way, links.slowest_s(way).max(rest_s))).collect();
    let best_s = timed.iter().map(|(_, time_s)| *time_s).fold(f64::INFINITY, f64::min);
    let good = |(_, time_s): &(Option<NonZeroU32>, f64)| *time_s <= best_s * WORTH;
    timed.into_iter().find(good).unwrap_or((None, best_s))
}

impl Links {
    /// The link that takes longest.
    pub(super) fn slowest_s(&self, way: Option<NonZeroU32>) -> f64 {
        let count = self.receives_s.len();
        let asked = way.map_or(count, |fanout| (fanout.get() as usize).min(count));
        let sent_s = self.sends_s.iter().map(|send_s| send_s * asked as f64);
        let copies = self.receives_s.iter().enumerate();
        let passed_s = copies.map(|(place, copy_s)| copy_s * passed_on(way, place, count) as f64);
        sent_s.chain(passed_s).chain(self.receives_s.iter().copied()).fold(0.0, f64::max)
    }
}

/// How many others ask the compositor at this place.
fn passed_on(way: Option<NonZeroU32>, place: usize, count: usize) -> usize {
    let Some(fanout) = way.map(|fanout| fanout.get() as usize) else { return 0 };
    let first = (place + 1) * fanout;
    count.min(first + fanout).saturating_sub(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn way(sends_s: &[f64], receives_s: &[f64], rest_s: f64) -> (Option<NonZeroU32>, f64) {
        best_way(&Links { sends_s: sends_s.to_vec(), receives_s: receives_s.to_vec() }, rest_s)
    }

    #[test]
    fn fast_links_need_no_relays() {
        assert_eq!(way(&[0.0], &[0.0; 10], 0.0), (None, 0.0));
        assert_eq!(way(&[1.0], &[1.0], 0.0), (None, 1.0), "one compositor");
        assert_eq!(way(&[1.0], &[1.0; 10], 12.0), (None, 12.0), "all else takes longer");
        // Ten samplers with a tenth each: sending to ten takes as long as receiving all.
        assert_eq!(way(&[0.1; 10], &[1.0; 10], 0.0).0, None);
    }

    #[test]
    fn one_sampler_of_many_compositors_sends_as_little_as_it_must() {
        let chain = NonZeroU32::new(1);
        assert_eq!(way(&[1.0], &[1.0; 10], 0.0), (chain, 1.0), "each receives once and sends once");
        assert_eq!(way(&[0.25; 4], &[1.0; 9], 0.0), (chain, 1.0));
        assert_eq!(way(&[1.0], &[1.0; 10], 4.0), (NonZeroU32::new(4), 4.0), "a shorter way does as well");
    }

    #[test]
    fn everyone_is_asked_by_as_many_as_the_plan_says() {
        for count in 1..40 {
            for fanout in [1, 2, 4] {
                let way = NonZeroU32::new(fanout);
                let passed: usize = (0..count).map(|place| passed_on(way, place, count)).sum();
                assert_eq!(passed + count.min(fanout as usize), count);
            }
        }
    }

    #[test]
    fn a_slow_link_at_the_end_of_the_line_sends_to_nobody() {
        let mut receives_s = vec![0.1; 7];
        receives_s[6] = 1.0;
        assert_eq!(way(&[0.25], &receives_s, 0.0), (NonZeroU32::new(4), 1.0));
    }
}
