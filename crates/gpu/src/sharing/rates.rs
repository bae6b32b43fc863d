//! Seconds that kinds of work take a unit, learned from slices that were measured.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Kinds that are remembered; the one that was used longest ago goes first.
const MOST_KINDS: usize = 1024;
/// The weight of a new measurement.
const NEW_SHARE: f64 = 0.3;
/// The most that one measurement counts over what was known: another process may have had the processor.
const MOST_RISE: f64 = 4.0;
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
    /// With the clock's value when they were last used.
    kinds: HashMap<WorkKind, (Known, u64)>,
    clock: u64,
}

/// Of a kind that was never measured without the compiling of a shader, only its existence is known.
type Known = Option<Rate>;

#[derive(Debug, Clone, Copy)]
struct Rate {
    /// Of measurements together with others, a share.
    unit_s: f64,
    /// As if the kind had taken all of the time that was not sure to be another's. The same where the kind was measured alone.
    most_unit_s: f64,
    is_sure: bool,
}

impl WorkKind {
    /// The first use of a shader, in which the device may compile it. A slice with such work teaches nothing.
    pub(crate) const FIRST_USE: Self = Self { family: 0, pass: 0 };

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
        work.iter().map(|&(kind, units)| Some(self.rate(kind)?.most_unit_s * units as f64)).sum()
    }

    /// The most seconds of a unit of the family's slowest kind; `None` where one of its kinds is unknown.
    pub fn slowest_unit_s(&self, family: u64) -> Option<f64> {
        let of_family = self.kinds.iter().filter(|(kind, _)| kind.family == family);
        let rates: Option<Vec<f64>> = of_family.map(|(_, (known, _))| Some((*known)?.most_unit_s)).collect();
        rates?.into_iter().reduce(f64::max)
    }

    /// Learns from work that was measured together.
    pub fn learn(&mut self, work: &[Work], seconds: f64) {
        let mut sums: HashMap<WorkKind, u64> = HashMap::new();
        work.iter().for_each(|(kind, units)| *sums.entry(*kind).or_default() += units);
        let learned: Vec<(WorkKind, Known)> = match sums.remove(&WorkKind::FIRST_USE) {
            Some(_) => sums.into_keys().map(|kind| (kind, self.rate(kind))).collect(),
            None => self.learned(&sums, seconds),
        };
        self.clock += 1;
        self.kinds.extend(learned.into_iter().map(|(kind, known)| (kind, (known, self.clock))));
        self.forget();
    }

    /// The rates of kinds after they took so long together.
    fn learned(&self, sums: &HashMap<WorkKind, u64>, seconds: f64) -> Vec<(WorkKind, Known)> {
        let is_alone = sums.len() == 1;
        let known = sums.iter().filter_map(|(&kind, &units)| Some((self.rate(kind)?, units as f64)));
        let known: Vec<(Rate, f64)> = known.collect();
        let predicted_s: f64 = known.iter().map(|(rate, units)| rate.unit_s * units).sum();
        let sure = known.iter().filter(|(rate, _)| rate.is_sure);
        let sure_s: f64 = sure.map(|(rate, units)| rate.unit_s * units).sum();
        let new_kinds = sums.len() - known.len();
        let least_s = if new_kinds == sums.len() { seconds } else { LEAST_SHARE * seconds };
        let of_new_s = if new_kinds == 0 { 0.0 } else { (seconds - predicted_s).max(least_s) };
        let of_known = ((seconds - of_new_s) / predicted_s.max(f64::MIN_POSITIVE)).min(MOST_RISE);
        let not_sure_s = (seconds - sure_s).max(LEAST_SHARE * seconds);
        let learned = sums.iter().map(|(&kind, &units)| {
            let units = units.max(1) as f64;
            let old = self.rate(kind);
            let was_sure = old.is_some_and(|rate| rate.is_sure);
            let share = if is_alone && !was_sure { 1.0 } else { NEW_SHARE };
            let unit_s = match old {
                Some(_) if share == 1.0 => seconds / units,
                Some(old) => old.unit_s * (1.0 + share * (of_known - 1.0)),
                None => of_new_s / new_kinds as f64 / units,
            };
            let is_sure = is_alone || was_sure;
            (kind, Some(Rate { unit_s, most_unit_s: if is_sure { unit_s } else { not_sure_s / units }, is_sure }))
        });
        learned.collect()
    }

    fn rate(&self, kind: WorkKind) -> Known {
        self.kinds.get(&kind)?.0
    }

    fn forget(&mut self) {
        while self.kinds.len() > MOST_KINDS {
            let oldest = self.kinds.iter().min_by_key(|(_, (_, last_used))| *last_used).map(|(kind, _)| *kind);
            oldest.and_then(|kind| self.kinds.remove(&kind));
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
    fn a_slice_in_which_a_shader_was_compiled_teaches_nothing_but_that_its_kinds_exist() {
        let mut rates = Rates::default();
        rates.learn(&[(kind(1), 100)], 1.0);
        assert!(near(rates.predicted_s(&[(kind(1), 50)]), 0.5), "one measurement is enough");
        rates.learn(&[(WorkKind::FIRST_USE, 1), (kind(1), 100), (kind(2), 100)], 50.0);
        assert!(near(rates.predicted_s(&[(kind(1), 50)]), 0.5));
        assert_eq!((rates.predicted_s(&[(kind(2), 1)]), rates.slowest_unit_s(7)), (None, None));
        assert_eq!(rates.predicted_s(&[(WorkKind::FIRST_USE, 1)]), None);
        rates.learn(&[(kind(2), 100)], 2.0);
        assert!(near(rates.slowest_unit_s(7), 0.02) && rates.slowest_unit_s(8).is_none());
    }

    #[test]
    fn a_new_kind_beside_a_known_one_has_the_rest_of_the_time() {
        let mut rates = Rates::default();
        rates.learn(&[(kind(1), 100)], 1.0);
        let both = [(kind(1), 100), (kind(2), 50)];
        rates.learn(&both, 3.0);
        assert!(near(rates.predicted_s(&[(kind(2), 50)]), 2.0));
        assert!(near(rates.predicted_s(&both), 3.0));
        assert!(near(rates.slowest_unit_s(7), 0.04));
    }

    #[test]
    fn kinds_that_were_measured_together_may_each_have_taken_all_the_time_until_one_is_measured_alone() {
        let mut rates = Rates::default();
        // Units of other families are others.
        let other = WorkKind::new(8, &1);
        let both = [(kind(1), 100), (other, 1)];
        rates.learn(&both, 2.0);
        assert!(near(rates.predicted_s(&both[..1]), 2.0) && near(rates.slowest_unit_s(7), 0.02));
        assert!(near(rates.predicted_s(&both[1..]), 2.0));
        rates.learn(&both[1..], 1.8);
        assert!(near(rates.predicted_s(&both[1..]), 1.8), "measured alone");
        rates.learn(&both, 2.0);
        assert!(rates.predicted_s(&both[..1]).is_some_and(|s| s < 0.3), "the rest of the time");
    }

    #[test]
    fn one_slow_measurement_of_many_changes_a_rate_by_less_than_two() {
        let mut rates = Rates::default();
        (0..2).for_each(|_| rates.learn(&[(kind(1), 100)], 1.0));
        rates.learn(&[(kind(1), 100)], 1000.0);
        assert!(rates.predicted_s(&[(kind(1), 100)]).is_some_and(|s| s > 1.0 && s < 2.0));
    }

    #[test]
    fn a_rate_that_changes_is_followed() {
        let mut rates = Rates::default();
        rates.learn(&[(kind(1), 100)], 1.0);
        (0..40).for_each(|_| rates.learn(&[(kind(1), 50), (kind(1), 50)], 4.0));
        let learned_s = rates.predicted_s(&[(kind(1), 100)]).expect("known");
        assert!((learned_s - 4.0).abs() < 1e-3, "{learned_s}");
    }

    #[test]
    fn kinds_by_the_thousand_leave_no_more_than_the_bound_and_the_newest_stay() {
        let mut rates = Rates::default();
        for pass in 0..2000 {
            rates.learn(&[(kind(pass), 1)], 1.0);
        }
        assert_eq!(rates.kinds.len(), MOST_KINDS);
        assert!(rates.predicted_s(&[(kind(1999), 1)]).is_some() && rates.predicted_s(&[(kind(0), 1)]).is_none());
    }
}
