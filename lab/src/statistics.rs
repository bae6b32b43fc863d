//! Statistics of measured values.

/// The middle of some numbers; NaN without any.
#[must_use]
pub fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The geometric mean of numbers above 0; `None` without any.
#[must_use]
pub fn geometric_mean(numbers: &[f64]) -> Option<f64> {
    let mean = numbers.iter().map(|number| number.ln()).sum::<f64>() / numbers.len() as f64;
    (!numbers.is_empty()).then(|| mean.exp())
}

/// The number that this share of all is at or below; NaN without any.
#[must_use]
pub fn quantile(mut numbers: Vec<f64>, share: f64) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let last = numbers.len().saturating_sub(1);
    numbers.get(((last as f64 * share).ceil() as usize).min(last)).copied().unwrap_or(f64::NAN)
}
