//! Times of several works.

use std::time::Instant;

use crate::statistics::median;

/// Seconds of each work, as the median of `runs` rounds after one that does not count. The works take turns, so that
/// none has the quieter machine.
pub fn in_turn<W: Copy>(
    works: &[W],
    runs: usize,
    mut work: impl FnMut(W) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<f64>> {
    let mut seconds = vec![Vec::with_capacity(runs); works.len()];
    for round in 0..=runs {
        for (&one, seconds) in works.iter().zip(&mut seconds) {
            let start = Instant::now();
            work(one)?;
            if round > 0 {
                seconds.push(start.elapsed().as_secs_f64());
            }
        }
    }
    Ok(seconds.into_iter().map(median).collect())
}
