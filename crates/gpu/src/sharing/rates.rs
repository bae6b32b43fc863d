//! Seconds that kinds of work take a unit, learned from slices that were measured.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Kinds that are remembered; the one that was used longest ago goes first.
const MOST_KINDS: usize = 1024;
/// The weight of a new measurement.
const NEW_SHARE: f64 = 0.3;
/// The least share of a measurement that new kinds are given beside known ones.
const LEAST_SHARE: f64 = 0.1;

/// Work that takes a like time a unit. Units are the family's own, such as pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct WorkKind {
    family: u64,
    pass: u64,
}

/// The work of one dispatch or pass: its kind and its units.
pub(crate) type Work = (WorkKind, u64);

#[derive(Debug, Default)]
pub(crate) struct Rates {
    known: HashMap<WorkKind, Rate>,
    clock: u64,
}

#[derive(Debug, Clone, Copy)]
struct Rate {
    /// `None` after the first measurement, in which a device may have compiled a shader.
    unit_s: Option<f64>,
    /// The kind was measured alone. Until then only its family's sum is sure.
    is_sure: bool,
    last_used: u64,
}

impl WorkKind {
    /// A pass of a family of passes, which are cut alike.
    #[must_use]
    pub fn new(family: u64, pass: &impl Hash) -> Self {
        Self { family, pass: Self::family(pass) }
    }

    /// The family of work that is described by a value.
    #[must_use]
    pub fn family(of: &impl Hash) -> u64 {
        let mut hasher = DefaultHasher::new();
        of.hash(&mut hasher);
        hasher.finish()
    }
}

impl Rates {
    /// The most seconds of work; `None` where some of its kinds is unknown.
    pub fn predicted_s(&self, work: &[Work]) -> Option<f64> {
        work.iter().map(|&(kind, units)| Some(self.most_unit_s(kind)? * units as f64)).sum()
    }

    /// The most seconds of a unit of the family's slowest kind; `None` where none is known.
    pub fn slowest_unit_s(&self, family: u64) -> Option<f64> {
        let of_family = self.known.keys().filter(|kind| kind.family == family);
        of_family.filter_map(|&kind| self.most_unit_s(kind)).reduce(f64::max)
    }

    /// Of kinds that were only measured together, each may have taken all of the time.
    fn most_unit_s(&self, kind: WorkKind) -> Option<f64> {
        let own = self.known.get(&kind)?;
        let together = self.known.iter().filter(|(other, rate)| other.family == kind.family && !rate.is_sure);
        own.unit_s.map(|unit_s| if own.is_sure { unit_s } else { together.filter_map(|(_, rate)| rate.unit_s).sum() })
    }

    /// Learns from work that was measured together.
    pub fn learn(&mut self, work: &[Work], seconds: f64) {
        let mut sums: HashMap<WorkKind, u64> = HashMap::new();
        work.iter().for_each(|(kind, units)| *sums.entry(*kind).or_default() += units);
        let (known, new): (Vec<Work>, Vec<Work>) = sums.into_iter().partition(|(kind, _)| self.unit_s(*kind).is_some());
        let seconds_of = |&(kind, units): &Work| Some(self.unit_s(kind)? * units as f64);
        let predicted_s: f64 = known.iter().filter_map(seconds_of).sum();
        let is_sure = known.len() + new.len() == 1;
        let new_units: u64 = new.iter().map(|(_, units)| units).sum();
        let least_s = if known.is_empty() { seconds } else { LEAST_SHARE * seconds };
        let of_new_s = if new_units == 0 { 0.0 } else { (seconds - predicted_s).max(least_s) };
        let of_known = (seconds - of_new_s) / predicted_s.max(f64::MIN_POSITIVE);
        self.clock += 1;
        for (kind, _) in known {
            let was_sure = self.known.get(&kind).is_some_and(|rate| rate.is_sure);
            let share = if is_sure && !was_sure { 1.0 } else { NEW_SHARE };
            let unit_s = self.unit_s(kind).map(|unit_s| unit_s * (1.0 + share * (of_known - 1.0)));
            self.known.insert(kind, Rate { unit_s, is_sure: is_sure || was_sure, last_used: self.clock });
        }
        for (kind, _) in new {
            let unit_s = self.known.contains_key(&kind).then(|| of_new_s / new_units.max(1) as f64);
            self.known.insert(kind, Rate { unit_s, is_sure: is_sure && unit_s.is_some(), last_used: self.clock });
        }
        self.forget();
    }

    fn unit_s(&self, kind: WorkKind) -> Option<f64> {
        self.known.get(&kind)?.unit_s
    }

    fn forget(&mut self) {
        while self.known.len() > MOST_KINDS {
            let oldest = self.known.iter().min_by_key(|(_, rate)| rate.last_used).map(|(kind, _)| *kind);
            oldest.and_then(|kind| self.known.remove(&kind));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(pass: u32) -> WorkKind {
        WorkKind::new(7, &pass)
    }

    fn near(a: Option<f64>, b: f64) -> bool {
        a.is_some_and(|a| (a - b).abs() < 1e-9)
    }

    #[test]
    fn a_kinds_first_measurement_counts_for_nothing() {
        let mut rates = Rates::default();
        rates.learn(&[(kind(1), 100)], 50.0);
        assert_eq!((rates.predicted_s(&[(kind(1), 1)]), rates.slowest_unit_s(7)), (None, None));
        rates.learn(&[(kind(1), 100)], 1.0);
        assert!(near(rates.predicted_s(&[(kind(1), 50)]), 0.5));
        assert!(near(rates.slowest_unit_s(7), 0.01) && rates.slowest_unit_s(8).is_none());
    }

    #[test]
    fn a_new_kind_beside_a_known_one_has_the_rest_of_the_time() {
        let mut rates = Rates::default();
        (0..2).for_each(|_| rates.learn(&[(kind(1), 100)], 1.0));
        let both = [(kind(1), 100), (kind(2), 50)];
        (0..2).for_each(|_| rates.learn(&both, 3.0));
        assert!(near(rates.predicted_s(&[(kind(2), 50)]), 2.0));
        assert!(near(rates.predicted_s(&both), 3.0));
        assert!(near(rates.slowest_unit_s(7), 0.04));
    }

    #[test]
    fn kinds_that_were_measured_together_may_each_have_taken_all_the_time_until_one_is_measured_alone() {
        let mut rates = Rates::default();
        let both = [(kind(1), 100), (kind(2), 100)];
        (0..2).for_each(|_| rates.learn(&both, 2.0));
        assert!(near(rates.predicted_s(&both[..1]), 2.0) && near(rates.slowest_unit_s(7), 0.02));
        rates.learn(&both[1..], 1.8);
        assert!(near(rates.predicted_s(&both[1..]), 1.8), "measured alone");
        assert!(near(rates.predicted_s(&both[..1]), 1.0), "the other's own share");
    }

    #[test]
    fn a_rate_that_changes_is_followed() {
        let mut rates = Rates::default();
        (0..2).for_each(|_| rates.learn(&[(kind(1), 100)], 1.0));
        (0..40).for_each(|_| rates.learn(&[(kind(1), 50), (kind(1), 50)], 4.0));
        let learned_s = rates.predicted_s(&[(kind(1), 100)]).expect("known");
        assert!((learned_s - 4.0).abs() < 1e-3, "{learned_s}");
    }

    #[test]
    fn kinds_by_the_thousand_leave_no_more_than_the_bound_and_the_newest_stay() {
        let mut rates = Rates::default();
        for pass in 0..2000 {
            (0..2).for_each(|_| rates.learn(&[(kind(pass), 1)], 1.0));
        }
        assert_eq!(rates.known.len(), MOST_KINDS);
        assert!(rates.predicted_s(&[(kind(1999), 1)]).is_some() && rates.predicted_s(&[(kind(0), 1)]).is_none());
    }
}
