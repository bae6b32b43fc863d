//! Equal jobs dealt to unequal workers, so that the last one ends as early as can be.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Who does jobs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worker {
    /// Before the first job.
    pub start_s: f64,
    /// Of one job.
    pub job_s: f64,
}

/// Less than any job; free jobs would never fill a worker.
const LEAST_JOB_S: f64 = 1e-12;

impl Worker {
    fn job_s(&self) -> f64 {
        self.job_s.max(LEAST_JOB_S)
    }

    fn end_s(&self, jobs: usize) -> f64 {
        if jobs == 0 { 0.0 } else { self.start_s + jobs as f64 * self.job_s() }
    }
}

/// Jobs of each worker.
#[must_use]
pub fn deal(jobs: usize, workers: &[Worker]) -> Vec<usize> {
    let level_s = level_s(jobs, workers);
    // Rounded down a little, so that the sum never exceeds the jobs.
    let below = |worker: &Worker| ((level_s - worker.start_s) / worker.job_s() * (1.0 - 1e-12)).max(0.0) as usize;
    let mut shares: Vec<usize> = workers.iter().map(below).collect();
    let left = jobs.saturating_sub(shares.iter().sum());
    deal_rest(left, workers, &mut shares);
    shares
}

/// Each of the jobs left to whoever ends it first; of several the first one.
fn deal_rest(left: usize, workers: &[Worker], shares: &mut [usize]) {
    // Times are not negative, so that their bits are in their order.
    let next = |i: usize, share: usize| Reverse((workers[i].end_s(share + 1).to_bits(), i));
    let mut ends: BinaryHeap<_> = shares.iter().enumerate().map(|(i, &share)| next(i, share)).collect();
    for _ in 0..left {
        let Some(Reverse((_, first))) = ends.pop() else { return };
        shares[first] += 1;
        ends.push(next(first, shares[first]));
    }
}

/// When all end together if jobs can be cut: Σ (t - start) / job = jobs over those who begin before t.
fn level_s(jobs: usize, workers: &[Worker]) -> f64 {
    let mut level_s = f64::INFINITY;
    loop {
        let busy = workers.iter().filter(|worker| worker.start_s < level_s);
        let (rate, ahead) = busy.fold((0.0, jobs as f64), |(rate, ahead), worker| {
            (rate + 1.0 / worker.job_s(), ahead + worker.start_s / worker.job_s())
        });
        let lower_s = ahead / rate;
        if !(rate > 0.0 && lower_s < level_s) {
            return if level_s.is_finite() { level_s } else { 0.0 };
        }
        level_s = lower_s;
    }
}

/// When the last worker ends; 0 without jobs, and infinite without workers.
#[must_use]
pub fn finish_s(jobs: usize, workers: &[Worker]) -> f64 {
    if jobs > 0 && workers.is_empty() {
        return f64::INFINITY;
    }
    deal(jobs, workers).iter().zip(workers).map(|(&share, worker)| worker.end_s(share)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schedule::test_support::Random;

    fn equal(count: usize) -> Vec<Worker> {
        vec![Worker { start_s: 0.0, job_s: 0.1 }; count]
    }

    #[test]
    fn equal_workers_get_even_shares() {
        for count in 1..12 {
            for jobs in 0..40 {
                let shares = deal(jobs, &equal(count));
                assert_eq!(shares.iter().sum::<usize>(), jobs);
                assert!(shares.iter().all(|&share| share <= jobs.div_ceil(count)), "{jobs} {shares:?}");
                let end_s = jobs.div_ceil(count) as f64 * 0.1;
                assert!((finish_s(jobs, &equal(count)) - end_s).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn edges() {
        assert_eq!(deal(3, &[]), Vec::<usize>::new());
        assert!(finish_s(3, &[]).is_infinite());
        assert_eq!(finish_s(0, &[]), 0.0);
        assert_eq!(deal(5, &[Worker { start_s: 9.0, job_s: 1.0 }, Worker { start_s: 0.0, job_s: 1.0 }]), [0, 5]);
        let free = deal(1 << 20, &[Worker { start_s: 0.0, job_s: 0.0 }; 3]);
        assert_eq!(free.iter().sum::<usize>(), 1 << 20);
    }

    /// One job after the other to whoever ends it first is optimal for equal jobs, and slow.
    #[test]
    fn as_good_as_one_by_one() {
        let mut random = Random(1);
        for _ in 0..500 {
            let worker = |random: &mut Random| Worker { start_s: random.unit(), job_s: 0.01 + random.unit() };
            let workers: Vec<Worker> = (0..1 + random.below(8)).map(|_| worker(&mut random)).collect();
            let jobs = random.below(60) as usize;
            let mut shares = vec![0; workers.len()];
            deal_rest(jobs, &workers, &mut shares);
            let slow_s = shares.iter().zip(&workers).map(|(&n, worker)| worker.end_s(n)).fold(0.0, f64::max);
            assert!(finish_s(jobs, &workers) <= slow_s + 1e-9);
            assert_eq!(deal(jobs, &workers).iter().sum::<usize>(), jobs);
        }
    }
}
