//! Statistics of measured values.

use std::time::Instant;

/// The middle of some numbers; NaN without any.
pub fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The median of a value of all items; NaN without any.
pub fn median_of<T>(items: &[T], value: impl Fn(&T) -> f64) -> f64 {
    median(items.iter().map(value).collect())
}

/// The mean of a value of all items; NaN without any.
pub fn mean_of<T>(items: &[T], value: impl Fn(&T) -> f64) -> f64 {
    items.iter().map(value).sum::<f64>() / items.len() as f64
}

/// The sum of a count of all items.
pub fn sum_of<T>(items: &[T], count: impl Fn(&T) -> usize) -> f64 {
    items.iter().map(count).sum::<usize>() as f64
}

/// The median seconds of `runs` runs after one that does not count, since the first use of a shader builds it.
///
/// # Errors
/// The first error of a run.
pub fn median_seconds<T>(runs: usize, mut run: impl FnMut() -> anyhow::Result<T>) -> anyhow::Result<f64> {
    run()?;
    let mut seconds = Vec::with_capacity(runs);
    for _ in 0..runs {
        let start = Instant::now();
        let made = run()?;
        seconds.push(start.elapsed().as_secs_f64());
        drop(made);
    }
    Ok(median(seconds))
}

/// The geometric mean of numbers above 0; `None` without any.
pub fn geometric_mean(numbers: &[f64]) -> Option<f64> {
    let mean = numbers.iter().map(|number| number.ln()).sum::<f64>() / numbers.len() as f64;
    (!numbers.is_empty()).then(|| mean.exp())
}

/// The number that this share of all is at or below; NaN without any.
pub fn quantile(mut numbers: Vec<f64>, share: f64) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let last = numbers.len().saturating_sub(1);
    numbers.get(((last as f64 * share).ceil() as usize).min(last)).copied().unwrap_or(f64::NAN)
}
