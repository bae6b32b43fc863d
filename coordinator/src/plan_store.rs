//! Where measurements for budgets are kept.

use std::fmt::Debug;
use std::io;

use planner::{Kept, KeptKey};

/// Keeps measurements for later plans. Calls block.
pub trait PlanStore: Debug + Send + Sync {
    /// The measurements of a key; none where there are none that can be used.
    fn read(&self, key: &KeptKey) -> Kept;

    /// Keeps the measurements of a key, in place of those before.
    ///
    /// # Errors
    /// They cannot be kept.
    fn write(&self, kept: &Kept) -> io::Result<()>;
}
