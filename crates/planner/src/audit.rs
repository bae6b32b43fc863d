//! The audit of a promise: whether it is broken, and the interval of the error.
//!
//! Both may be read after every view, for ever, without being wrong more often. The alarm is a mixture of e-detectors
//! (Shin, Ramdas, Rinaldo 2024). While the promise is kept, alarms are at least 1,000 views apart in the mean. The interval
//! is the asymptotic confidence sequence of Waudby-Smith, Arbour, Sinha, Kennedy and Ramdas (2024), at 95 %.

use crate::bounds::ERROR_RATE;
use crate::budget::{ErrorTerm, MOST_OVER, Statistic};
use crate::metric::Metric;
use crate::view_errors::ViewErrors;

/// Bets on a broken promise, as shares of the greatest that cannot lose everything.
const BETS: [f64; 3] = [0.1, 0.25, 0.5];
/// Bets on models that fill less are no higher.
const LEAST_FOREGROUND: f64 = 0.01;
/// Evidence of an alarm.
const ALARM: f64 = 1_000.0;
/// Views that have to be there for an interval.
const LEAST_VIEWS: u64 = 16;
/// Views at which the interval is narrowest for what is known.
const TUNED_AT_VIEWS: f64 = 100.0;
/// The factor by which bets on views over a percentile's limit are lower: such views are rare, and one would raise the
/// evidence too far.
const RARE_OVER: f64 = 3.0;

/// The audited views of one promise.
#[derive(Debug, Clone, PartialEq)]
pub struct Audit {
    term: ErrorTerm,
    /// The bets' evidence.
    evidence: [f64; BETS.len()],
    /// Bets are shares of 1 / (limit · this): the greatest share of foreground so far, at first that of the certificate.
    bet_weight: f64,
    views: u64,
    /// Views that show what is compared.
    weighted: u64,
    skipped: u64,
    mean: f64,
    squares: f64,
    weight_sum: f64,
}

/// A mean and what it may be, with a confidence of 95 % at all times together.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "self-naming fields")]
pub struct Interval {
    pub low: f64,
    pub mean: f64,
    pub high: f64,
}

impl Audit {
    /// An audit without views. `foreground_ratio`, from 0 to 1, is the mean share of foreground in the views of the
    /// certificate. A value that is not finite counts as 1. Small models move y less, and bets on them are higher: a bet
    /// depends on views before it alone, so that the rate of false alarms holds. Budgets of whole views do not depend on the
    /// ratio.
    #[must_use]
    pub fn new(term: ErrorTerm, foreground_ratio: f64) -> Self {
        let is_whole = term.metric() == Metric::FlipWhole || !foreground_ratio.is_finite();
        let foreground_ratio = if is_whole { 1.0 } else { foreground_ratio };
        let bet_weight = match term.statistic() {
            Statistic::Mean => foreground_ratio.clamp(LEAST_FOREGROUND, 1.0),
            Statistic::P95 => RARE_OVER,
        };
        Self {
            term,
            evidence: [1.0; BETS.len()],
            bet_weight,
            views: 0,
            weighted: 0,
            skipped: 0,
            mean: 0.0,
            squares: 0.0,
            weight_sum: 0.0,
        }
    }

    /// Views may have this share of foreground from now on: bets on a mean are no higher than it allows.
    pub fn expect_foreground(&mut self, foreground_ratio: f64) {
        if self.term.statistic() == Statistic::Mean && foreground_ratio.is_finite() {
            self.bet_weight = self.bet_weight.max(foreground_ratio.min(1.0));
        }
    }

    /// Counts a view. Invalid errors and views without a surface, where each view is judged by itself, are skipped.
    pub fn observe(&mut self, errors: &ViewErrors) {
        if errors.validate().is_err() || !errors.counts_for(&self.term) {
            self.skipped += 1;
            return;
        }
        let y = self.excess(errors);
        let weight = self.weight(errors);
        let scale = 1.0 / (self.limit() * self.bet_weight);
        for (evidence, bet) in self.evidence.iter_mut().zip(BETS) {
            // Below 0 only for a view with twice the foreground of all before it and of the certificate.
            *evidence = (evidence.max(1.0) * (1.0 + bet * scale * y).max(0.0)).min(f64::MAX);
        }
        self.bet_weight = self.bet_weight.max(weight);
        self.views += 1;
        self.weighted += u64::from(weight > 0.0);
        self.weight_sum += weight;
        let step = y - self.mean;
        self.mean += step / self.views as f64;
        self.squares += step * (y - self.mean);
    }

    /// Whether the promise is broken.
    #[must_use]
    pub fn is_alarmed(&self) -> bool {
        self.evidence.iter().map(|evidence| evidence / BETS.len() as f64).sum::<f64>() >= ALARM
    }

    /// Views that counted, and views that were skipped.
    #[must_use]
    pub fn views(&self) -> [u64; 2] {
        [self.views, self.skipped]
    }

    /// The interval of y. `None` below 16 views that show a surface. Known failure: where the first errors of a mean are all 0, its deviation is
    /// 0 and the interval is a point. A percentile has the deviation of its limit at least, and its interval is too narrow
    /// where far more views are over.
    #[must_use]
    pub fn excess_interval(&self) -> Option<Interval> {
        if self.weighted < LEAST_VIEWS {
            return None;
        }
        let n = self.views as f64;
        let deviation = (self.squares / (n - 1.0)).sqrt().max(self.least_deviation());
        let spread = n * tuned_variance();
        let half_width =
            deviation * (2.0 * (spread + 1.0) / (n * spread) * ((spread + 1.0).sqrt() / ERROR_RATE).ln()).sqrt();
        Some(Interval { low: self.mean - half_width, mean: self.mean, high: self.mean + half_width })
    }

    /// The interval of the error, as a ratio: the mean over the foreground of all views, or the share of views over the
    /// limit. `None` below 16 views that show a surface.
    #[must_use]
    pub fn error_interval(&self) -> Option<Interval> {
        let Interval { low, mean, high } = self.excess_interval()?;
        Some(Interval { low: self.error(low)?, mean: self.error(mean)?, high: self.error(high)? })
    }

    /// The mean of that error, from the first view that shows a surface.
    #[must_use]
    pub fn mean_error(&self) -> Option<f64> {
        self.error(self.mean)
    }

    /// The error of a mean y; `None` where no view shows a surface.
    fn error(&self, y: f64) -> Option<f64> {
        let weight = self.weight_sum / self.views.max(1) as f64;
        (weight > 0.0).then(|| (self.limit() + y / weight).clamp(0.0, 1.0))
    }

    /// The limit on the mean, or on the share of views over.
    fn limit(&self) -> f64 {
        if self.term.statistic() == Statistic::P95 { MOST_OVER } else { self.term.most_ratio() }
    }

    /// y of a view: at most 0 in the mean while the promise is kept.
    fn excess(&self, errors: &ViewErrors) -> f64 {
        let metric = self.term.metric();
        let limit = self.term.most_ratio();
        match self.term.statistic() {
            Statistic::Mean => errors.excess(metric, limit),
            Statistic::P95 => f64::from(u8::from(errors.error_ratio(metric) > limit)) - MOST_OVER,
        }
    }

    /// The deviation of a share that is just kept: few views may show none over. Means have no such value.
    fn least_deviation(&self) -> f64 {
        if self.term.statistic() == Statistic::P95 { (MOST_OVER * (1.0 - MOST_OVER)).sqrt() } else { 0.0 }
    }

    fn weight(&self, errors: &ViewErrors) -> f64 {
        if self.term.statistic() == Statistic::P95 { 1.0 } else { errors.weight(self.term.metric()) }
    }
}

/// ρ² of the confidence sequence: Waudby-Smith et al., appendix B.2.
fn tuned_variance() -> f64 {
    let twice_log = -2.0 * ERROR_RATE.ln();
    (twice_log + (twice_log + 1.0).ln()) / TUNED_AT_VIEWS
}
