//! Faults of the device: memory that it does not have, and its loss. They end one operation with an error, not the process.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use parking_lot::Mutex;

use crate::error::GpuError;

/// The faults of one device so far.
#[derive(Debug, Default)]
pub(crate) struct Faults {
    /// Times that memory ran out. What was lent before the last is not lent again: it may be without memory.
    shortages: AtomicU64,
    /// The first reason of the device's loss.
    pub lost: Mutex<Option<String>>,
    /// The next check fails, as a test wants it.
    pub injected: AtomicBool,
}

impl Faults {
    pub fn shortages(&self) -> u64 {
        self.shortages.load(Ordering::Acquire)
    }

    /// Notes that memory ran out.
    pub fn run_short(&self) {
        self.shortages.fetch_add(1, Ordering::AcqRel);
    }

    /// Fails when the device is lost.
    pub fn check_lost(&self) -> Result<(), GpuError> {
        self.lost.lock().clone().map_or(Ok(()), |reason| Err(GpuError::Lost(reason)))
    }

    /// Fails where a test asked for it.
    pub fn check_injected(&self) -> Result<(), GpuError> {
        if !self.injected.swap(false, Ordering::AcqRel) {
            return Ok(());
        }
        self.run_short();
        Err(GpuError::OutOfMemory("injected by a test".to_owned()))
    }
}
