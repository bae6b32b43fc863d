//! The load of the machine, which shows whether a measurement had it for itself.

use std::fs;

use crate::memory::processor_s;

/// Ticks of the kernel's counters in a second: fixed for programs since Linux 2.6.
const TICKS_PER_S: f64 = 100.0;

/// Processor time so far, in seconds of one core.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MachineTime {
    /// Seconds of all processes.
    pub busy_s: f64,
    /// Seconds of other guests of the same host.
    pub stolen_s: f64,
    /// Seconds of this process, the client.
    pub client_s: f64,
}

impl MachineTime {
    /// The counters now; zeros where the system has none.
    pub fn now() -> Self {
        let stat = fs::read_to_string("/proc/stat").unwrap_or_default();
        let (busy_s, stolen_s) = all(&stat).unwrap_or_default();
        Self { busy_s, stolen_s, client_s: processor_s(std::process::id()).unwrap_or_default() }
    }

    /// The difference of two readings.
    pub fn since(&self, before: &Self) -> Self {
        Self {
            busy_s: self.busy_s - before.busy_s,
            stolen_s: self.stolen_s - before.stolen_s,
            client_s: self.client_s - before.client_s,
        }
    }
}

/// The fields are user, nice, system, idle, iowait, irq, softirq and steal.
fn all(stat: &str) -> Option<(f64, f64)> {
    let line = stat.lines().find_map(|line| line.strip_prefix("cpu "))?;
    let ticks: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [busy_s, stolen_s] = [&[0, 1, 2, 5, 6][..], &[7]]
        .map(|places| places.iter().filter_map(|&place| ticks.get(place)).sum::<f64>() / TICKS_PER_S);
    Some((busy_s, stolen_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counters_are_read_by_their_place() {
        let stat = "cpu  100 10 50 900 5 4 6 30 0 0\ncpu0 1 1 1 1\n";
        assert_eq!(all(stat), Some((1.7, 0.3)));
        assert_eq!(all("nothing"), None);
    }

    #[test]
    fn work_is_seen() {
        let before = MachineTime::now();
        let mut sum = 0u64;
        while MachineTime::now().since(&before).client_s < 0.1 {
            sum = std::hint::black_box(sum.wrapping_add(1));
        }
        assert!(MachineTime::now().since(&before).busy_s > 0.0, "{sum}");
    }
}
