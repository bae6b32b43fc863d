//! The audit of a promise: whether it is broken, and the interval of the error.
//!
//! Both may be read after every view, for ever, without being wrong more often. The alarm is an e-detector (Shin, Ramdas,
//! Rinaldo 2024): while the promise is kept, alarms are at least 1,000 views apart in the mean. The interval is the asymptotic
//! confidence sequence of Waudby-Smith, Arbour, Sinha, Kennedy and Ramdas (2024), at 95 %.

use crate::budget::Budget;
use crate::moments::ERROR_RATE;
use crate::view_errors::ViewErrors;

/// Bets on a broken promise, as shares of the greatest that cannot lose everything: the low one finds errors that are little
/// over the limit, the high one finds large errors soon.
const BETS: [f64; 2] = [0.15, 0.75];
/// Bets on models that fill less of a view are no higher.
const LEAST_FOREGROUND: f64 = 0.01;
/// The evidence of an alarm.
const ALARM: f64 = 1_000.0;
/// Views that have to be there for an interval.
const LEAST_VIEWS: u64 = 16;
/// Views at which the interval is narrowest for what is known.
const TUNED_AT_VIEWS: f64 = 100.0;

/// The audited views of one promise.
#[derive(Debug, Clone, PartialEq)]
pub struct Audit {
    budget: Budget,
    evidence: [f64; BETS.len()],
    /// The greatest share of foreground so far: small models move y less, and bets on them are higher.
    foreground_ratio: f64,
    views: u64,
    /// The mean of y, the sum of its squared deviations, and the sum of all shares of foreground.
    mean: f64,
    squares: f64,
    foreground_sum: f64,
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
    /// An audit without views. `foreground_ratio` is the share of foreground in the views that the choice was tested on.
    #[must_use]
    pub fn new(budget: Budget, foreground_ratio: f64) -> Self {
        Self {
            budget,
            evidence: [1.0; BETS.len()],
            foreground_ratio: foreground_ratio.clamp(LEAST_FOREGROUND, 1.0),
            views: 0,
            mean: 0.0,
            squares: 0.0,
            foreground_sum: 0.0,
        }
    }

    /// Counts a view, or a part of one, in which a model may be larger than in any view. Invalid errors are skipped.
    pub fn observe(&mut self, errors: &ViewErrors, is_part: bool) {
        if errors.validate().is_err() {
            return;
        }
        // The bet depends on what is known before the view alone.
        self.foreground_ratio = if is_part { 1.0 } else { self.foreground_ratio };
        let y = errors.excess(&self.budget);
        let share = y / (self.budget.most_ratio() * self.foreground_ratio);
        for (evidence, bet) in self.evidence.iter_mut().zip(BETS) {
            // It is below 0 only for a view with more foreground than all before it.
            *evidence = (evidence.max(1.0) * (1.0 + bet * share).max(0.0)).min(f64::MAX);
        }
        self.foreground_ratio = self.foreground_ratio.max(errors.foreground_ratio);
        self.views += 1;
        self.foreground_sum += errors.foreground_ratio;
        let step = y - self.mean;
        self.mean += step / self.views as f64;
        self.squares += step * (y - self.mean);
    }

    /// Whether the promise is broken.
    #[must_use]
    pub fn is_alarmed(&self) -> bool {
        self.evidence.iter().map(|evidence| evidence / BETS.len() as f64).sum::<f64>() >= ALARM
    }

    /// The number of views.
    #[must_use]
    pub fn views(&self) -> u64 {
        self.views
    }

    /// The mean error over the foreground of all views, as a ratio; `None` where no view shows a surface.
    #[must_use]
    pub fn mean_error(&self) -> Option<f64> {
        self.error(self.mean)
    }

    /// The interval of that mean; `None` below 16 views. Known failure: where the first errors are all equal it is a point.
    #[must_use]
    pub fn interval(&self) -> Option<Interval> {
        if self.views < LEAST_VIEWS {
            return None;
        }
        let n = self.views as f64;
        let deviation = (self.squares / (n - 1.0)).sqrt();
        let spread = n * tuned_variance();
        let half = deviation * (2.0 * (spread + 1.0) / (n * spread) * ((spread + 1.0).sqrt() / ERROR_RATE).ln()).sqrt();
        Some(Interval {
            low: self.error(self.mean - half)?,
            mean: self.error(self.mean)?,
            high: self.error(self.mean + half)?,
        })
    }

    /// The error of a mean y.
    fn error(&self, y: f64) -> Option<f64> {
        let foreground = self.foreground_sum / self.views.max(1) as f64;
        (foreground > 0.0).then(|| (self.budget.most_ratio() + y / foreground).clamp(0.0, 1.0))
    }
}

/// ρ² of the confidence sequence: Waudby-Smith et al., appendix B.2.
fn tuned_variance() -> f64 {
    let twice_log = -2.0 * ERROR_RATE.ln();
    (twice_log + (twice_log + 1.0).ln()) / TUNED_AT_VIEWS
}
