//! One-sided bounds on means, and the error rates of several rounds.

use crate::student::upper_quantile;

/// The probability with which a promise may be wrong.
pub const ERROR_RATE: f64 = 0.05;
/// The most rounds of certification.
pub const MAX_ROUNDS: u32 = 2;

/// The number, the mean and the standard deviation of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// The number of values.
    pub count: usize,
    /// Their mean; 0 without any.
    pub mean: f64,
    /// Their standard deviation, with n − 1 in the denominator; 0 below two values.
    pub deviation: f64,
}

impl Moments {
    /// The moments of finite values in any order. A value that is not finite makes the bounds NaN, which decides "not over"
    /// and gives no certificate.
    #[must_use]
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count();
        let mean = values.clone().sum::<f64>() / count.max(1) as f64;
        let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
        Self { count, mean, deviation: (squares / count.saturating_sub(1).max(1) as f64).sqrt() }
    }

    /// The bound that the expected value exceeds with a probability of at most `error_rate`, by Student's t. The rate is above
    /// 0 and at most 0.5. `None` below two values. Skewed values exceed it more often.
    #[must_use]
    pub fn upper_bound(&self, error_rate: f64) -> Option<f64> {
        Some(self.mean + self.half_width(error_rate)?)
    }

    /// The bound that the expected value is below with a probability of at most `error_rate`. Its ranges are those
    /// of [`Self::upper_bound`].
    #[must_use]
    pub fn lower_bound(&self, error_rate: f64) -> Option<f64> {
        Some(self.mean - self.half_width(error_rate)?)
    }

    fn half_width(&self, error_rate: f64) -> Option<f64> {
        let degrees = self.count.checked_sub(1).filter(|&degrees| degrees > 0)?;
        Some(upper_quantile(degrees, error_rate) * self.deviation / (self.count as f64).sqrt())
    }
}

/// The error rate of a round of certification, a number from 0 to [`MAX_ROUNDS`] − 1. Each round has half the rate of the one
/// before. Together the rounds of one plan have [`ERROR_RATE`].
#[must_use]
pub fn round_error_rate(round: u32) -> f64 {
    let shares: f64 = (0..MAX_ROUNDS).map(|round| 0.5_f64.powi(round as i32)).sum();
    ERROR_RATE * 0.5_f64.powi(round as i32) / shares
}
