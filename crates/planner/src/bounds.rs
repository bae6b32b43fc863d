//! One-sided bounds on means, and the error rates of several rounds.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

/// The probability with which a promise may be wrong.
pub const ERROR_RATE: f64 = 0.05;
/// The most rounds of certification.
pub const MAX_ROUNDS: u32 = 2;

/// The number, the mean, the standard deviation and the skewness of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moments {
    /// The number of values.
    pub count: usize,
    /// Their mean; 0 without any.
    pub mean: f64,
    /// Their standard deviation, with n − 1 in the denominator; 0 below two values.
    pub deviation: f64,
    /// Their skewness; 0 where they are equal.
    pub skewness: f64,
}

impl Moments {
    /// The moments of finite values in any order. A value that is not finite makes the bounds NaN, which decides "not over"
    /// and gives no certificate.
    #[must_use]
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        let count = values.clone().count();
        let mean = values.clone().sum::<f64>() / count.max(1) as f64;
        let [squares, cubes] =
            [2, 3].map(|exponent| values.clone().map(|value| (value - mean).powi(exponent)).sum::<f64>());
        let deviation = (squares / count.saturating_sub(1).max(1) as f64).sqrt();
        let skewness = cubes / count.max(1) as f64 / deviation.powi(3);
        Self { count, mean, deviation, skewness: if deviation == 0.0 { 0.0 } else { skewness } }
    }

    /// The bound that the expected value exceeds with a probability of at most `error_rate`, by Student's t and, for values
    /// with a long tail above, Johnson's correction (1978, "Modified t Tests and Confidence Intervals for Asymmetrical
    /// Populations"). The rate is above 0 and at most 0.5. `None` below two values. Strongly skewed values exceed it more often.
    #[must_use]
    pub fn upper_bound(&self, error_rate: f64) -> Option<f64> {
        (self.count > 1).then(|| self.mean + self.deviation * self.deviations_above(self.count, error_rate))
    }

    /// The distance of the upper bound of `count` such values from their mean, in standard deviations. At least 2 values.
    pub(crate) fn deviations_above(&self, count: usize, error_rate: f64) -> f64 {
        let t = upper_quantile(count - 1, error_rate);
        let count_f = count as f64;
        // A short tail above would take the bound nearer: it stays.
        t / count_f.sqrt() + self.skewness.max(0.0) * (1.0 + 2.0 * t * t) / (6.0 * count_f)
    }

    /// The bound that the expected value is below with a probability of at most `error_rate`. Its ranges are those
    /// of [`Self::upper_bound`]. A long tail above makes it too low, which is safe.
    #[must_use]
    pub fn lower_bound(&self, error_rate: f64) -> Option<f64> {
        let degrees = self.count.checked_sub(1).filter(|&degrees| degrees > 0)?;
        Some(self.mean - upper_quantile(degrees, error_rate) * self.deviation / (self.count as f64).sqrt())
    }
}

/// The error rate of a round of certification, a number from 0 to [`MAX_ROUNDS`] − 1. Each round has half the rate of the one
/// before. Together the rounds of one plan have [`ERROR_RATE`].
#[must_use]
pub fn round_error_rate(round: u32) -> f64 {
    let shares: f64 = (0..MAX_ROUNDS).map(|round| 0.5_f64.powi(round as i32)).sum();
    ERROR_RATE * 0.5_f64.powi(round as i32) / shares
}

/// The value that a variable of Student's t distribution exceeds with a probability of `error_rate`, from 0 to 1.
fn upper_quantile(degrees: usize, error_rate: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, degrees as f64) {
        Ok(distribution) if (0.0..=1.0).contains(&error_rate) => distribution.inverse_cdf(1.0 - error_rate),
        _ => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Percentage points of the distribution, from Abramowitz and Stegun, table 26.10, and to more digits by SciPy.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (degrees, error_rate, expected) in [
            (1, 0.05, 6.313_751_515),
            (2, 0.05, 2.919_985_580),
            (7, 0.05, 1.894_578_605),
            (63, 0.05, 1.669_402_222),
            (30, 0.005, 2.749_995_654),
        ] {
            let found = upper_quantile(degrees, error_rate);
            assert!((found - expected).abs() < 1e-6, "{degrees} {error_rate}: {found}");
        }
        assert!(upper_quantile(0, 0.05).is_nan() && upper_quantile(5, f64::NAN).is_nan());
    }
}
