//! The bound on a mean from few values.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

/// The probability with which a promise may be wrong.
pub(crate) const ERROR_RATE: f64 = 0.05;

/// The bound that the expected value exceeds with a probability of at most 5 %, by Student's t. With few values that have a
/// long tail above, it is exceeded more often. `None` below two values. A value that is not finite makes it NaN.
#[must_use]
pub fn upper_bound(values: &[f64]) -> Option<f64> {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let distribution = StudentsT::new(0.0, 1.0, count - 1.0).ok()?;
    let quantile = distribution.inverse_cdf(1.0 - ERROR_RATE);
    Some(mean + quantile * (squares / (count - 1.0) / count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Percentage points of the distribution are those of Abramowitz and Stegun, table 26.10.
    #[test]
    fn the_bound_is_the_mean_and_deviations_by_the_table() {
        // The mean is 0 and the deviation of the mean 1.
        let two = upper_bound(&[-1.0, 1.0]).unwrap();
        assert!((two - 6.313_751_515).abs() < 1e-6, "{two}");
        let side = 8_f64.sqrt() * (7.0_f64 / 8.0).sqrt();
        let eight: Vec<f64> = (0..8).map(|i| if i % 2 == 0 { side } else { -side }).collect();
        let eight = upper_bound(&eight).unwrap();
        assert!((eight - 1.894_578_605).abs() < 1e-6, "{eight}");
        assert!(upper_bound(&[1.0]).is_none() && upper_bound(&[]).is_none());
        assert!(upper_bound(&[1.0, f64::NAN]).unwrap().is_nan(), "a bound that keeps nothing");
    }
}
