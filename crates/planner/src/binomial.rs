//! Exact bounds for shares of views. Shares and error rates are from 0 to 1. NaN decides "not over" and gives no bound.

use statrs::distribution::{Binomial, DiscreteCDF as _};

/// The most views of one percentile that are asked for.
const MAX_VIEWS: usize = 4096;

/// The probability that of `count` views at most `over` are over, where a share of `share` is. Shares outside 0 to 1 count
/// as the nearest of them; NaN gives NaN where `over` is below `count`.
#[must_use]
pub fn at_most_over(count: usize, over: usize, share: f64) -> f64 {
    if over >= count {
        return 1.0;
    }
    Binomial::new(share.clamp(0.0, 1.0), count as u64).map_or(f64::NAN, |views| views.cdf(over as u64))
}

/// The most of `count` views that may be over where at most a share of `share` may be. The bound is wrong with a
/// probability of at most `error_rate`, from 0 to 1. `None`: there are too few views, or a value is NaN.
#[must_use]
pub fn most_over(count: usize, share: f64, error_rate: f64) -> Option<usize> {
    (0..count).take_while(|&over| at_most_over(count, over, share) <= error_rate).last()
}

/// The views that are needed where `over` of them are over. `None`: more than 4096, or a value is NaN.
#[must_use]
pub fn views_needed(over: usize, share: f64, error_rate: f64) -> Option<usize> {
    (over + 1..=MAX_VIEWS).find(|&count| at_most_over(count, over, share) <= error_rate)
}

/// Whether more than a share of `share` is over, where `over` of `count` views are. The answer is wrong with a probability
/// of at most `error_rate`, from 0 to 1. NaN decides "not over".
#[must_use]
pub fn is_over(count: usize, over: usize, share: f64, error_rate: f64) -> bool {
    over > 0 && 1.0 - at_most_over(count, over - 1, share) <= error_rate
}
