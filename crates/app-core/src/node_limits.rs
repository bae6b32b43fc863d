//! The limits of a node: its memory, on the command line or by default, and the time of its views.

use std::fs;

use clap::Args;
use node::{NodeConfig, Quotas};

use crate::sizes::within;

/// On a GPU, whose free memory is not known.
const GPU_BYTES: usize = 2 << 30;
/// Where the system does not tell how much memory is available.
const UNKNOWN_AVAILABLE_BYTES: usize = 8 << 30;

/// The limits of a node.
#[derive(Debug, Clone, Copy, Args)]
pub struct NodeLimitArgs {
    /// The most memory for sample sets, in bytes or with K, M, G or T: half for sets on the device, half for packed
    /// images. Scenes on the device have as much again. [default: a quarter of the available memory; 2G on a GPU]
    #[arg(long, value_name = "SIZE", value_parser = bytes_of)]
    set_memory: Option<usize>,
    /// The most memory of a node for views that are queued or not sent yet, with their frames; a larger view is refused
    #[arg(long, value_name = "SIZE", value_parser = bytes_of, default_value = "2G")]
    view_memory: usize,
    /// The share of the time that views of the method direct may take while others are served
    #[arg(long, value_name = "SHARE", default_value_t = 0.1, value_parser = within(0.01..=1.0))]
    direct_share: f64,
    /// The most seconds of one view; a view that is predicted to take longer is refused
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0, value_parser = within(0.001..=86_400.0))]
    max_view_s: f64,
}

impl NodeLimitArgs {
    /// A configuration with these limits, and with this memory for sample sets.
    #[must_use]
    pub fn within(self, set_memory_bytes: usize, config: NodeConfig) -> NodeConfig {
        let quotas = Quotas { view_bytes: self.view_memory, ..config.quotas };
        let Self { direct_share, max_view_s, .. } = self;
        NodeConfig { set_memory_bytes, quotas, direct_share, max_view_s, ..config }
    }

    /// The memory for sample sets, and as much again for scenes on the device: the bytes that were given, or else the default for
    /// a device.
    #[must_use]
    pub fn set_memory_bytes(self, is_software: bool) -> usize {
        self.set_memory.unwrap_or_else(|| if is_software { available_bytes() / 4 } else { GPU_BYTES })
    }
}

/// A size, as in `512M` or `2G`; K is 1024.
fn bytes_of(text: &str) -> Result<usize, String> {
    let (digits, shift) = match text.char_indices().last() {
        Some((at, 'K' | 'k')) => (&text[..at], 10),
        Some((at, 'M' | 'm')) => (&text[..at], 20),
        Some((at, 'G' | 'g')) => (&text[..at], 30),
        Some((at, 'T' | 't')) => (&text[..at], 40),
        _ => (text, 0),
    };
    let count = Some(digits).filter(|digits| digits.bytes().all(|digit| digit.is_ascii_digit()));
    let count = count.and_then(|digits| digits.parse::<usize>().ok()).filter(|&count| count > 0);
    let bytes = count.and_then(|count| count.checked_mul(1 << shift));
    bytes.ok_or_else(|| "must be a whole number above 0, in bytes or with K, M, G or T, as in 512M".to_owned())
}

/// The memory that processes can still take, of the system or of the container.
fn available_bytes() -> usize {
    let meminfo = fs::read_to_string("/proc/meminfo").ok();
    let of_system = meminfo.as_deref().and_then(available_of).unwrap_or(UNKNOWN_AVAILABLE_BYTES);
    let limit = fs::read_to_string("/sys/fs/cgroup/memory.max").ok();
    let of_container = limit.and_then(|limit| limit.trim().parse().ok()).unwrap_or(usize::MAX);
    of_system.min(of_container)
}

fn available_of(meminfo: &str) -> Option<usize> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: usize = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_numbers_with_a_unit() {
        for (text, bytes) in [("1", 1), ("3k", 3 << 10), ("512M", 512 << 20), ("2G", 2 << 30), ("1T", 1 << 40)] {
            assert_eq!(bytes_of(text), Ok(bytes), "{text}");
        }
        for text in ["", "0", "0G", "G", "-1", "+1", "1.5G", "2GB", "2 G", "2é", "99999999999999999999", "99999999T"] {
            assert!(bytes_of(text).is_err(), "{text}");
        }
    }

    #[test]
    fn the_available_memory_is_read_in_kilobytes() {
        assert_eq!(available_of("MemTotal: 9 kB\nMemAvailable:   23620420 kB\n"), Some(23_620_420 << 10));
        assert_eq!(available_of("MemTotal: 9 kB\n"), None);
        assert!(available_bytes() > 0);
        let of = |set_memory| NodeLimitArgs { set_memory, view_memory: 1, direct_share: 0.1, max_view_s: 120.0 };
        assert_eq!((of(Some(7)).set_memory_bytes(true), of(Some(7)).set_memory_bytes(false)), (7, 7));
        assert_eq!(of(None).set_memory_bytes(false), 2 << 30);
    }
}
