//! Memory and processor time of processes, as Linux reports them.

/// The most memory that this process has held, in MB; `None` where the system does not tell.
pub fn peak_memory_mb() -> Option<f64> {
    Some(status_bytes("self", "VmHWM:")? / 1e6)
}

/// Resident memory of a process, by number or `self`, in MiB; `None` where the system does not tell.
pub fn memory_mib(process: &str) -> Option<f64> {
    Some(status_bytes(process, "VmRSS:")? / f64::from(1 << 20))
}

/// Seconds that a process has had of processors; `None` where the system does not tell.
pub fn processor_s(process: u32) -> Option<f64> {
    /// Linux counts in hundredths, whatever its own clock.
    const TICKS_PER_S: f64 = 100.0;
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name, in brackets, may have spaces.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(ticks / TICKS_PER_S)
}

fn status_bytes(process: &str, field: &str) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(field))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_process_has_memory() {
        assert!(memory_mib("self").is_some_and(|mib| mib > 1.0));
        assert_eq!(memory_mib("none"), None);
    }
}
