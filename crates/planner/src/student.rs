//! Student's t distribution at whole degrees of freedom.
//!
//! The closed sums are those of Abramowitz and Stegun, 26.7.3 and 26.7.4: no special function is needed.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// The value that a variable with `degrees` degrees of freedom exceeds with a probability of `error_rate`, 0 to 0.5.
pub(crate) fn upper_quantile(degrees: usize, error_rate: f64) -> f64 {
    // The angle θ = atan(t / √ν) has a finite range, which halves at every step.
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if within_angle(degrees, middle) < 1.0 - 2.0 * error_rate { low = middle } else { high = middle }
    }
    (0.5 * (low + high)).tan() * (degrees as f64).sqrt()
}

/// The probability of |t| ≤ √ν tan θ.
fn within_angle(degrees: usize, angle: f64) -> f64 {
    let (sine, cosine) = angle.sin_cos();
    let is_odd = degrees % 2 == 1;
    let (mut term, mut sum) = (if is_odd { cosine } else { 1.0 }, 0.0);
    // The terms' powers of the cosine end at ν − 2; each factor is (k − 1) / k.
    let mut power = if is_odd { 1 } else { 0 };
    while power + 2 <= degrees {
        sum += term;
        power += 2;
        term *= cosine * cosine * (power as f64 - 1.0) / power as f64;
    }
    if is_odd { FRAC_2_PI * (angle + sine * sum) } else { sine * sum }
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
            (3, 0.05, 2.353_363_435),
            (7, 0.05, 1.894_578_605),
            (31, 0.05, 1.695_518_783),
            (63, 0.05, 1.669_402_222),
            (10, 0.025, 2.228_138_852),
            (30, 0.005, 2.749_995_654),
        ] {
            let found = upper_quantile(degrees, error_rate);
            assert!((found - expected).abs() < 1e-6, "{degrees} {error_rate}: {found}");
        }
    }
}
