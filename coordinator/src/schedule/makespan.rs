//! Equal jobs on workers of unequal speed, distributed so that the last worker ends as early as possible.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// When a worker begins its first job, and what each job takes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Worker {
    pub(super) start_s: f64,
    pub(super) job_s: f64,
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

    /// Times are not negative, so that their bits are in their order.
    fn end_bits(&self, jobs: usize) -> u64 {
        self.end_s(jobs).to_bits()
    }
}

/// The number of jobs of each worker.
pub(super) fn distribute(jobs: usize, workers: &[Worker]) -> Vec<usize> {
    let level_s = level_s(jobs, workers);
    // Rounded down a little, so that the sum never exceeds the jobs.
    let below = workers.iter().map(|worker| (level_s - worker.start_s) / worker.job_s() * (1.0 - 1e-12));
    let mut shares: Vec<usize> = below.map(|jobs| jobs.max(0.0) as usize).collect();
    let left = jobs.saturating_sub(shares.iter().sum());
    distribute_rest(left, workers, &mut shares);
    shares
}

/// Gives each of the jobs left to the worker that ends it first; among several, to the first.
fn distribute_rest(left: usize, workers: &[Worker], shares: &mut [usize]) {
    let ends = workers.iter().zip(&*shares).enumerate();
    let mut ends: BinaryHeap<_> = ends.map(|(i, (worker, share))| Reverse((worker.end_bits(share + 1), i))).collect();
    for _ in 0..left {
        let Some(Reverse((_, first))) = ends.pop() else { return };
        shares[first] += 1;
        ends.push(Reverse((workers[first].end_bits(shares[first] + 1), first)));
    }
}

/// When all workers would end together if jobs were divisible: Σ (t - start) / job = jobs, over the workers that begin
/// before t.
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
pub(super) fn makespan_s(jobs: usize, workers: &[Worker]) -> f64 {
    if jobs > 0 && workers.is_empty() {
        return f64::INFINITY;
    }
    distribute(jobs, workers).iter().zip(workers).map(|(&share, worker)| worker.end_s(share)).fold(0.0, f64::max)
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
                let shares = distribute(jobs, &equal(count));
                assert_eq!(shares.iter().sum::<usize>(), jobs);
                assert!(shares.iter().all(|&share| share <= jobs.div_ceil(count)), "{jobs} {shares:?}");
                let end_s = jobs.div_ceil(count) as f64 * 0.1;
                assert!((makespan_s(jobs, &equal(count)) - end_s).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn few_free_and_late_workers_get_their_jobs() {
        assert_eq!(distribute(3, &[]), Vec::<usize>::new());
        assert!(makespan_s(3, &[]).is_infinite());
        assert_eq!(makespan_s(0, &[]), 0.0);
        assert_eq!(distribute(5, &[Worker { start_s: 9.0, job_s: 1.0 }, Worker { start_s: 0.0, job_s: 1.0 }]), [0, 5]);
        let free = distribute(1 << 20, &[Worker { start_s: 0.0, job_s: 0.0 }; 3]);
        assert_eq!(free.iter().sum::<usize>(), 1 << 20);
    }

    /// Each job in turn to the worker that ends it first is optimal for equal jobs, and slow.
    #[test]
    fn the_makespan_is_that_of_jobs_given_one_by_one() {
        let mut random = Random(1);
        for _ in 0..500 {
            let worker = |random: &mut Random| Worker { start_s: random.unit(), job_s: 0.01 + random.unit() };
            let workers: Vec<Worker> = (0..1 + random.below(8)).map(|_| worker(&mut random)).collect();
            let jobs = random.below(60) as usize;
            let mut shares = vec![0; workers.len()];
            distribute_rest(jobs, &workers, &mut shares);
            let slow_s = shares.iter().zip(&workers).map(|(&n, worker)| worker.end_s(n)).fold(0.0, f64::max);
            assert!(makespan_s(jobs, &workers) <= slow_s + 1e-9);
            assert_eq!(distribute(jobs, &workers).iter().sum::<usize>(), jobs);
        }
    }
}
