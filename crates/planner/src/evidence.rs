//! Evidence from the errors of some views about one term of a budget.

use crate::binomial::{at_most_over, is_over, most_over, views_needed};
use crate::bounds::Moments;
use crate::budget::{ErrorTerm, MOST_OVER, Statistic};
use crate::view_errors::ViewErrors;

/// Numbers of views on which a mean is certified.
const MEAN_VIEWS: [usize; 3] = [32, 48, 64];
/// The most views that may be over in the certificate of a percentile.
const MOST_OVER_VIEWS: usize = 4;
/// A chance of passing above which no more views are asked for.
const ENOUGH_CHANCE: f64 = 0.98;
/// Logarithms of errors start here.
const LEAST_ERROR_RATIO: f64 = 1e-6;
/// The quantile of 95 % of the normal distribution.
const NORMAL_P95: f64 = 1.645;

/// A term, and the errors of views drawn alike.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Evidence<'a> {
    pub(crate) term: ErrorTerm,
    pub(crate) errors: &'a [ViewErrors],
}

impl Evidence<'_> {
    /// The views that count.
    pub(crate) fn count(&self) -> usize {
        self.counting().count()
    }

    /// Whether the error is above `scale` times the limit, wrong with a probability of at most `error_rate`.
    pub(crate) fn is_over(&self, scale: f64, error_rate: f64) -> bool {
        let most_ratio = self.term.most_ratio() * scale;
        match self.term.statistic() {
            Statistic::Mean => self.excess(most_ratio).lower_bound(error_rate).is_some_and(|bound| bound > 0.0),
            Statistic::P95 => {
                let over = self.ratios().filter(|&ratio| ratio > most_ratio).count();
                is_over(self.count(), over, MOST_OVER, error_rate)
            }
        }
    }

    /// A bound that the error exceeds with a probability of at most `error_rate`, as a ratio. `None`: there are too few
    /// views. It is at most the limit exactly where the term is certified.
    pub(crate) fn upper_bound(&self, error_rate: f64) -> Option<f64> {
        match self.term.statistic() {
            Statistic::Mean => {
                let limit = self.term.most_ratio();
                let weight = self.weight();
                let excess = self.excess(limit).upper_bound(error_rate)?;
                (weight > 0.0).then(|| limit + excess / weight)
            }
            Statistic::P95 => Some(self.descending()[most_over(self.count(), MOST_OVER, error_rate)?]),
        }
    }

    /// The error, as a ratio; 0 without views that show a surface.
    pub(crate) fn estimate(&self) -> f64 {
        match self.term.statistic() {
            Statistic::Mean => {
                let sum: f64 = self.counting().map(|e| e.excess(self.term.metric(), 0.0)).sum();
                sum / (self.weight() * self.count() as f64).max(f64::MIN_POSITIVE)
            }
            Statistic::P95 => {
                let ratios = self.descending();
                ratios.get((ratios.len() as f64 * MOST_OVER) as usize).copied().unwrap_or(0.0)
            }
        }
    }

    /// How far the error is below the limit, in standard deviations of a view.
    pub(crate) fn margin(&self) -> f64 {
        match self.term.statistic() {
            Statistic::Mean => {
                let excess = self.excess(self.term.most_ratio());
                -excess.mean / excess.deviation.max(1e-3 * self.term.most_ratio())
            }
            Statistic::P95 => {
                let logs = Moments::of(self.ratios().map(log_error));
                (log_error(self.term.most_ratio()) - logs.mean) / logs.deviation.max(0.05) - NORMAL_P95
            }
        }
    }

    /// The views on which a certificate is decided: as few as probably suffice.
    pub(crate) fn views_to_certify(&self, error_rate: f64) -> usize {
        let mut options = self.certificate_sizes(error_rate).into_iter();
        let enough = options.find(|&views| self.chance(views, error_rate) >= ENOUGH_CHANCE);
        enough.unwrap_or_else(|| self.most_views(error_rate))
    }

    /// The most views on which a certificate is decided.
    pub(crate) fn most_views(&self, error_rate: f64) -> usize {
        self.certificate_sizes(error_rate).last().copied().unwrap_or(0)
    }

    /// The probable chance of a certificate, with as many views as there may be.
    pub(crate) fn chance_to_certify(&self, error_rate: f64) -> f64 {
        self.chance(self.most_views(error_rate), error_rate)
    }

    fn certificate_sizes(&self, error_rate: f64) -> Vec<usize> {
        match self.term.statistic() {
            Statistic::Mean => MEAN_VIEWS.to_vec(),
            Statistic::P95 => {
                (0..=MOST_OVER_VIEWS).filter_map(|over| views_needed(over, MOST_OVER, error_rate)).collect()
            }
        }
    }

    /// The chance that `views` new views give a certificate. The errors of the mean of these views count, too.
    fn chance(&self, views: usize, error_rate: f64) -> f64 {
        let margin = self.margin();
        let counted = self.count().max(1) as f64;
        match self.term.statistic() {
            Statistic::Mean => {
                let needed = self.excess(self.term.most_ratio()).deviations_above(views, error_rate);
                normal((margin - needed) / ((views as f64).recip() + counted.recip()).sqrt())
            }
            Statistic::P95 => {
                let share_over = 1.0 - normal(margin + NORMAL_P95);
                most_over(views, MOST_OVER, error_rate).map_or(0.0, |over| at_most_over(views, over, share_over))
            }
        }
    }

    fn counting(&self) -> impl Iterator<Item = &ViewErrors> + Clone {
        self.errors.iter().filter(|errors| errors.counts_for(&self.term))
    }

    fn ratios(&self) -> impl Iterator<Item = f64> + Clone {
        self.counting().map(|errors| errors.error_ratio(self.term.metric()))
    }

    fn descending(&self) -> Vec<f64> {
        let mut ratios: Vec<f64> = self.ratios().collect();
        ratios.sort_by(|a, b| b.total_cmp(a));
        ratios
    }

    fn excess(&self, most_ratio: f64) -> Moments {
        Moments::of(self.counting().map(|errors| errors.excess(self.term.metric(), most_ratio)))
    }

    /// The mean share of pixels that count.
    fn weight(&self) -> f64 {
        self.counting().map(|errors| errors.weight(self.term.metric())).sum::<f64>() / self.count().max(1) as f64
    }
}

fn log_error(ratio: f64) -> f64 {
    ratio.max(LEAST_ERROR_RATIO).ln()
}

/// The normal distribution to 0.01, by the logistic function: it orders candidates and decides nothing.
fn normal(deviations: f64) -> f64 {
    1.0 / (1.0 + (-1.702 * deviations).exp())
}
