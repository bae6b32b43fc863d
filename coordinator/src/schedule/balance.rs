//! The balance formula K_fd of Lages et al., eq. 2-5.
//!
//! With a = S·g and b = V·c, T(K) = max(a/K, b/(P-K)). T(K) < T(K-1) exactly while
//! K < K* = 1 + a(P-1)/(a+b), so that the optimum is ⌊K*⌋: the printed ⌈K*⌉ is a slip.

/// How many of `p` equal nodes sample `s` images of `g` seconds while the others make `v` views of `c`
/// seconds. P = 1 gives 1: that node does both, in turn. Without views all sample; without samples none.
#[must_use]
pub fn k_fd(s: usize, g: f64, v: usize, c: f64, p: usize) -> usize {
    let a = s as f64 * g;
    let b = v as f64 * c;
    match (a > 0.0, b > 0.0) {
        (false, _) => 0,
        (true, false) => p,
        (true, true) if p < 2 => p,
        // Beyond 2^53 nodes the cast would matter.
        (true, true) => (((a * p as f64 + b) / (a + b)).floor() as usize).clamp(1, p - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges() {
        assert_eq!(k_fd(4, 1.0, 100, 0.1, 1), 1, "one node does both");
        assert_eq!(k_fd(4, 1.0, 0, 0.1, 5), 5, "no views");
        assert_eq!(k_fd(4, 1.0, 100, 0.0, 5), 5, "free views");
        assert_eq!(k_fd(0, 1.0, 100, 0.1, 5), 0, "no samples");
        assert_eq!(k_fd(4, 0.0, 100, 0.1, 5), 0, "free samples");
        assert_eq!(k_fd(1000, 1.0, 1, 1e-9, 5), 4, "a node is left for views");
        assert_eq!(k_fd(1, 1e-9, 1000, 1.0, 5), 1, "a node is left for samples");
    }

    #[test]
    fn table_1_of_the_paper() {
        for p in 5..=11 {
            assert_eq!(k_fd(4, 1.0, 1000, 0.103, p), 1, "P = {p}");
        }
    }
}
