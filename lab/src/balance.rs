//! The pipeline's balance by the equations of Lages et al., which the schedule's [`k_fd`](coordinator::schedule::k_fd) is
//! compared with.

/// Eq. 3 as it is printed, with ⌈ ⌉. Kept to show that it is worse.
pub fn k_fd_printed(s: usize, g: f64, v: usize, c: f64, p: usize) -> usize {
    let a = s as f64 * g;
    let b = v as f64 * c;
    ((a * p as f64 + b) / (a + b)).ceil() as usize
}

/// Eq. 2: seconds a sample set when `k` of `p` nodes sample. Infinite where work has no node.
pub fn pipeline_time(s: usize, g: f64, v: usize, c: f64, p: usize, k: usize) -> f64 {
    shared_s(s as f64 * g, k).max(shared_s(v as f64 * c, p.saturating_sub(k)))
}

/// The time of work that nodes share.
fn shared_s(work_s: f64, nodes: usize) -> f64 {
    if work_s > 0.0 { work_s / nodes as f64 } else { 0.0 }
}

/// The least K with the least time, by trying all that leave a node for each kind of work.
pub fn brute_force_k(s: usize, g: f64, v: usize, c: f64, p: usize) -> usize {
    (1..p).min_by(|a, b| pipeline_time(s, g, v, c, p, *a).total_cmp(&pipeline_time(s, g, v, c, p, *b))).unwrap_or(p)
}

#[cfg(test)]
mod tests {
    use coordinator::schedule::k_fd;

    use super::*;

    /// Regular parameter sets: 9 × 7 × 10 × 10 × 7 = 44,100.
    fn parameter_sets() -> impl Iterator<Item = (usize, f64, usize, f64, usize)> {
        let sets = [1, 2, 3, 4, 5, 6, 8, 12, 16]
            .into_iter()
            .flat_map(|s| [0.01, 0.03, 0.1, 0.3, 0.5, 1.0, 3.0].map(|g| (s, g)));
        let views = sets.flat_map(|(s, g)| [1, 2, 5, 10, 45, 90, 290, 500, 1000, 4000].map(|v| (s, g, v)));
        let costs = views.flat_map(|(s, g, v)| {
            [0.001, 0.003, 0.01, 0.02, 0.05, 0.1, 0.103, 0.2, 0.5, 1.0].map(|ratio| (s, g, v, ratio * g))
        });
        costs.flat_map(|(s, g, v, c)| [2, 3, 4, 5, 7, 11, 24].map(|p| (s, g, v, c, p)))
    }

    #[test]
    fn floor_is_optimal_and_the_printed_ceil_is_not() {
        let mut sets = 0;
        let mut ceil_worse = 0;
        let mut ceil_leaves_none = 0;
        for (s, g, v, c, p) in parameter_sets() {
            let time = |k| pipeline_time(s, g, v, c, p, k);
            let best = time(brute_force_k(s, g, v, c, p));
            let floor = k_fd(s, g, v, c, p);
            assert!((1..p).contains(&floor));
            assert!(time(floor) <= best * (1.0 + 1e-9), "{s} {g} {v} {c} {p}: {floor}");
            let ceil = k_fd_printed(s, g, v, c, p);
            ceil_worse += usize::from(time(ceil) > best * (1.0 + 1e-9));
            ceil_leaves_none += usize::from(ceil >= p);
            sets += 1;
        }
        assert_eq!(sets, 44_100);
        assert!(ceil_worse > sets * 9 / 10, "{ceil_worse}");
        assert!(ceil_leaves_none > 1000, "{ceil_leaves_none}");
    }

    #[test]
    fn work_without_a_node_takes_forever() {
        assert!(pipeline_time(4, 1.0, 100, 0.1, 5, 5).is_infinite());
    }
}
