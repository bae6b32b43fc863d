//! Times of several works.

use std::time::Instant;

use crate::statistics::median;

/// A work that takes longer is timed once.
const LONG_S: f64 = 4.0;

/// Seconds of each work, as the median of `runs` rounds after one that does not count. The works take turns, so that
/// none has the quieter machine.
pub fn in_turn<W: Copy>(
    works: &[W],
    runs: usize,
    mut work: impl FnMut(W) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<f64>> {
    let mut seconds: Vec<Vec<f64>> = vec![Vec::with_capacity(runs); works.len()];
    for round in 0..=runs {
        for (&one, seconds) in works.iter().zip(&mut seconds) {
            if seconds.last().is_some_and(|last_s| *last_s > LONG_S) {
                continue;
            }
            let start = Instant::now();
            work(one)?;
            if round > 0 {
                seconds.push(start.elapsed().as_secs_f64());
            }
        }
    }
    Ok(seconds.into_iter().map(median).collect())
}
