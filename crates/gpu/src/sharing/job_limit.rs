//! A bound on the jobs that hold a device's memory: so many of each class, in the order of their arrival.

use std::collections::VecDeque;
use std::time::Instant;

use parking_lot::{Condvar, Mutex};

use super::WorkClass;
use super::queue::count_waited;

/// Bounds the jobs of each class. A job of one class never waits for one of another.
pub struct JobLimit {
    most: usize,
    classes: [ClassJobs; WorkClass::COUNT],
}

#[derive(Default)]
struct ClassJobs {
    jobs: Mutex<Jobs>,
    /// Signals that a job has ended or begun.
    changed: Condvar,
}

#[derive(Default)]
struct Jobs {
    running: usize,
    waiting: VecDeque<u64>,
    last_ticket: u64,
}

/// A job that counts until it is dropped.
pub struct Job<'l>(&'l ClassJobs);

impl JobLimit {
    /// At most so many jobs of each class.
    #[must_use]
    pub fn of(most: usize) -> Self {
        Self { most: most.max(1), classes: Default::default() }
    }

    /// Waits until there is room for one more.
    pub fn begin(&self, class: WorkClass) -> Job<'_> {
        let class = &self.classes[class as usize];
        let mut jobs = class.jobs.lock();
        jobs.last_ticket += 1;
        let ticket = jobs.last_ticket;
        jobs.waiting.push_back(ticket);
        let start = Instant::now();
        while jobs.running >= self.most || jobs.waiting.front() != Some(&ticket) {
            class.changed.wait(&mut jobs);
        }
        count_waited(start);
        jobs.waiting.pop_front();
        jobs.running += 1;
        // The next may have room, too.
        class.changed.notify_all();
        Job(class)
    }
}

impl Drop for Job<'_> {
    fn drop(&mut self) {
        self.0.jobs.lock().running -= 1;
        self.0.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::thread;

    use super::*;

    #[test]
    fn jobs_beyond_the_limit_wait_in_order_and_other_classes_do_not() {
        let limit = JobLimit::of(2);
        let [first, second] = [(); 2].map(|()| limit.begin(WorkClass::Batch));
        let (sender, began) = mpsc::channel();
        thread::scope(|threads| {
            for number in 0..3 {
                let limit = &limit;
                let sender = sender.clone();
                threads.spawn(move || {
                    let _job = limit.begin(WorkClass::Batch);
                    sender.send(number).expect("a receiver");
                });
                while limit.classes[1].jobs.lock().waiting.len() <= number {
                    thread::yield_now();
                }
            }
            drop(limit.begin(WorkClass::Live));
            assert!(began.try_recv().is_err());
            drop(first);
            let order: Vec<_> = began.iter().take(3).collect();
            assert_eq!(order, [0, 1, 2]);
        });
        drop(second);
    }
}
