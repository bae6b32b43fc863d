//! How sample images reach all compositors: each from the samplers, or relayed from compositor to compositor. A link
//! carries one image at a time in each direction.

use std::num::NonZeroU32;

/// Compositors that one compositor relays images to. A smaller fan-out makes longer ways, and shorter times a link.
const FANOUTS: [u32; 3] = [4, 2, 1];
/// A longer way must be faster by more than this factor.
const WORTH: f64 = 1.1;

/// The load of links by one set.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Links {
    /// For each sampler, seconds of one copy of its images.
    pub(super) sends_s: Vec<f64>,
    /// For each compositor, in the order of the plan, seconds of one copy of the set.
    pub(super) receives_s: Vec<f64>,
    /// Seconds of all other work.
    pub(super) rest_s: f64,
}

/// A relay tree, and the seconds of a set by it. Fan-out `None`: every compositor asks the samplers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Relaying {
    pub(super) fanout: Option<NonZeroU32>,
    pub(super) time_s: f64,
}

impl Links {
    /// The shortest way that is not clearly slower than the best.
    pub(super) fn best(&self) -> Relaying {
        let fanouts = std::iter::once(None).chain(FANOUTS.into_iter().map(NonZeroU32::new));
        let all: Vec<_> = fanouts.map(|fanout| Relaying { fanout, time_s: self.time_s(fanout) }).collect();
        let best_s = all.iter().map(|relaying| relaying.time_s).fold(f64::INFINITY, f64::min);
        let good = all.into_iter().find(|relaying| relaying.time_s <= best_s * WORTH);
        good.unwrap_or(Relaying { fanout: None, time_s: best_s })
    }

    /// Seconds of the slowest link, or of all other work where that takes longer.
    pub(super) fn time_s(&self, fanout: Option<NonZeroU32>) -> f64 {
        let count = self.receives_s.len();
        let asking = fanout.map_or(count, |fanout| (fanout.get() as usize).min(count));
        let sent_s = self.sends_s.iter().map(|send_s| send_s * asking as f64);
        let copies = self.receives_s.iter().enumerate();
        let relayed_s = copies.map(|(place, copy_s)| copy_s * relayed_copies(fanout, place, count) as f64);
        sent_s.chain(relayed_s).chain(self.receives_s.iter().copied()).fold(self.rest_s, f64::max)
    }
}

/// Compositors that ask the one at this place.
fn relayed_copies(fanout: Option<NonZeroU32>, place: usize, count: usize) -> usize {
    let Some(fanout) = fanout.map(|fanout| fanout.get() as usize) else { return 0 };
    let first = (place + 1) * fanout;
    count.min(first + fanout).saturating_sub(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn best(sends_s: &[f64], receives_s: &[f64], rest_s: f64) -> (Option<NonZeroU32>, f64) {
        let links = Links { sends_s: sends_s.to_vec(), receives_s: receives_s.to_vec(), rest_s };
        let Relaying { fanout, time_s } = links.best();
        (fanout, time_s)
    }

    #[test]
    fn fast_links_need_no_relays() {
        assert_eq!(best(&[0.0], &[0.0; 10], 0.0), (None, 0.0));
        assert_eq!(best(&[1.0], &[1.0], 0.0), (None, 1.0), "one compositor");
        assert_eq!(best(&[1.0], &[1.0; 10], 12.0), (None, 12.0), "other work takes longer");
        // Ten samplers with a tenth each: sending to ten takes as long as receiving all.
        assert_eq!(best(&[0.1; 10], &[1.0; 10], 0.0).0, None);
    }

    #[test]
    fn one_sampler_of_many_compositors_sends_few_copies() {
        let chain = NonZeroU32::new(1);
        assert_eq!(best(&[1.0], &[1.0; 10], 0.0), (chain, 1.0), "each receives one copy and sends one");
        assert_eq!(best(&[0.25; 4], &[1.0; 9], 0.0), (chain, 1.0));
        assert_eq!(best(&[1.0], &[1.0; 10], 4.0), (NonZeroU32::new(4), 4.0), "a shorter way does as well");
    }

    #[test]
    fn every_compositor_asks_one_relay_or_the_samplers() {
        for count in 1..40 {
            for fanout in [1, 2, 4] {
                let fanout = NonZeroU32::new(fanout);
                let relayed: usize = (0..count).map(|place| relayed_copies(fanout, place, count)).sum();
                assert_eq!(relayed + count.min(fanout.map_or(0, |fanout| fanout.get() as usize)), count);
            }
        }
    }

    #[test]
    fn a_slow_link_at_the_end_of_the_tree_relays_nothing() {
        let mut receives_s = vec![0.1; 7];
        receives_s[6] = 1.0;
        assert_eq!(best(&[0.25], &receives_s, 0.0), (NonZeroU32::new(4), 1.0));
    }
}
