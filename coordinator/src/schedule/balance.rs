//! The balance formula K_fd of Lages et al., eq. 2-5, and what it is checked against.
//!
//! With a = S·g and b = V·c, T(K) = max(a/K, b/(P-K)). T(K) < T(K-1) exactly while
//! K < K* = 1 + a(P-1)/(a+b), so that the optimum is ⌊K*⌋: the printed ⌈K*⌉ is a slip.

/// How many of `p` equal nodes sample `s` images of `g` seconds while the others make `v` views of `c`
/// seconds. P = 1 gives 1: that node does both, in turn. Without views all sample; without samples none.
#[must_use]
pub fn k_fd(s: usize, g: f64, v: usize, c: f64, p: usize) -> usize {
    let (a, b) = (s as f64 * g, v as f64 * c);
    match (a > 0.0, b > 0.0) {
        (false, _) => 0,
        (true, false) => p,
        (true, true) if p < 2 => p,
        // Beyond 2^53 nodes the cast would matter.
        (true, true) => (k_star(a, b, p).floor() as usize).clamp(1, p - 1),
    }
}

/// Eq. 3 as it is printed, with ⌈ ⌉. Kept to show that it is worse.
#[must_use]
pub fn k_fd_printed(s: usize, g: f64, v: usize, c: f64, p: usize) -> usize {
    k_star(s as f64 * g, v as f64 * c, p).ceil() as usize
}

fn k_star(a: f64, b: f64, p: usize) -> f64 {
    (a * p as f64 + b) / (a + b)
}

/// Eq. 2: seconds a sample set when `k` of `p` nodes sample. Infinite where work has no node.
#[must_use]
pub fn pipeline_time(s: usize, g: f64, v: usize, c: f64, p: usize, k: usize) -> f64 {
    let over = |work_s: f64, nodes: usize| if work_s > 0.0 { work_s / nodes as f64 } else { 0.0 };
    over(s as f64 * g, k).max(over(v as f64 * c, p.saturating_sub(k)))
}

/// The least K with the least time, by trying all that leave a node for each kind of work.
#[must_use]
pub fn brute_force_k(s: usize, g: f64, v: usize, c: f64, p: usize) -> usize {
    let time = |k: &usize| pipeline_time(s, g, v, c, p, *k);
    (1..p).min_by(|a, b| time(a).total_cmp(&time(b))).unwrap_or(p)
}

#[cfg(test)]
mod tests {
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
        let (mut sets, mut ceil_worse, mut ceil_leaves_none) = (0, 0, 0);
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
    fn edges() {
        assert_eq!(k_fd(4, 1.0, 100, 0.1, 1), 1, "one node does both");
        assert_eq!(k_fd(4, 1.0, 0, 0.1, 5), 5, "no views");
        assert_eq!(k_fd(4, 1.0, 100, 0.0, 5), 5, "free views");
        assert_eq!(k_fd(0, 1.0, 100, 0.1, 5), 0, "no samples");
        assert_eq!(k_fd(4, 0.0, 100, 0.1, 5), 0, "free samples");
        assert_eq!(k_fd(1000, 1.0, 1, 1e-9, 5), 4, "a node is left for views");
        assert_eq!(k_fd(1, 1e-9, 1000, 1.0, 5), 1, "a node is left for samples");
        assert!(pipeline_time(4, 1.0, 100, 0.1, 5, 5).is_infinite());
    }

    #[test]
    fn table_1_of_the_paper() {
        for p in 5..=11 {
            assert_eq!(k_fd(4, 1.0, 1000, 0.103, p), 1, "P = {p}");
        }
    }
}
