//! Statistics of a load.

use app_core::live::{Record, Shown, quantile};

use super::clients::Outcome;
use super::phases::Load;

/// The share of a load's time in which caches fill and later refused clients arrive.
pub(super) const WARM_UP: f64 = 0.25;

impl Load {
    pub(super) fn served(&self) -> impl Iterator<Item = &Record> {
        self.outcomes.iter().filter_map(|outcome| match outcome {
            Outcome::Served(record) => Some(record),
            Outcome::Refused => None,
        })
    }

    pub(super) fn shown(&self) -> impl Iterator<Item = &Shown> {
        self.served().flat_map(|record| &record.shown)
    }

    pub(super) fn refused(&self) -> usize {
        self.outcomes.len() - self.served().count()
    }

    pub(super) fn posed(&self) -> u64 {
        self.served().map(|record| record.posed).sum()
    }

    pub(super) fn degraded(&self) -> usize {
        self.shown().filter(|shown| shown.fallback > 0).count()
    }

    /// The share of the poses of admitted clients whose frame came undegraded.
    pub(super) fn undegraded_share(&self) -> f64 {
        (self.shown().count() - self.degraded()) as f64 / self.posed() as f64
    }

    /// A quantile of the age of frames, in milliseconds.
    pub(super) fn age_ms(&self, share: f64) -> f64 {
        let mut ages: Vec<f64> = self.shown().map(Shown::age_s).collect();
        ages.sort_by(f64::total_cmp);
        quantile(&ages, share) * 1e3
    }

    /// The shares of its rate that each client got after the warm-up, the least first.
    pub(super) fn rate_shares(&self) -> Vec<f64> {
        let lasting_s = self.clients.lasting.as_secs_f64();
        let from_s = lasting_s * WARM_UP;
        let shares = self.served().map(|record| {
            let count = record.shown.iter().filter(|shown| (from_s..lasting_s).contains(&shown.posed_s)).count();
            count as f64 / ((lasting_s - from_s) * self.clients.rate_hz)
        });
        let mut shares: Vec<f64> = shares.collect();
        shares.sort_by(f64::total_cmp);
        shares
    }
}
