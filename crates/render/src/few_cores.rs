//! Work on the host beside live streams: on half the cores at most.

use std::sync::OnceLock;
use std::thread::available_parallelism;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Does work of many threads, on half the cores where live streams need the others.
pub(crate) fn on_free_cores<T: Send>(is_shared: bool, work: impl FnOnce() -> T + Send) -> T {
    static HALF: OnceLock<Option<ThreadPool>> = OnceLock::new();
    let half = HALF.get_or_init(|| {
        let cores = available_parallelism().map_or(1, usize::from);
        ThreadPoolBuilder::new().num_threads((cores / 2).max(1)).build().ok()
    });
    match half {
        Some(half) if is_shared => half.install(work),
        _ => work(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shared_work_has_half_the_threads() {
        let all = on_free_cores(false, rayon::current_num_threads);
        let cores = available_parallelism().map_or(1, usize::from);
        assert_eq!(on_free_cores(true, rayon::current_num_threads), (cores / 2).max(1));
        assert_eq!(all, rayon::current_num_threads());
    }
}
