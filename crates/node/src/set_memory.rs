//! The sets that a role keeps in memory, which it can give back.

use std::hash::Hash;

use cluster::SetContent;

use crate::byte_cache::ByteCache;
use crate::plan::PlansInForce;

/// A cached value that belongs to a sample set.
pub trait OfSet: Send + Sync + 'static {
    /// The set's content.
    fn content(&self) -> &SetContent;
    /// The workload that it was loaded for, and its index there.
    fn origin(&self) -> (u64, u32);
}

/// Sets in memory for later.
pub trait SetMemory: Send + Sync {
    /// Evicts all sets that are not in use; gives their bytes.
    fn free(&self) -> usize;
    /// Evicts the sets that are not in use, were loaded for workloads that have ended, and are in no other's plan; gives
    /// their bytes.
    fn free_ended(&self, plans: &PlansInForce) -> usize;
}

impl<K: Clone + Eq + Hash + Send + Sync + 'static, V: OfSet> SetMemory for ByteCache<K, V> {
    fn free(&self) -> usize {
        self.evict_unused(|_| false)
    }

    fn free_ended(&self, plans: &PlansInForce) -> usize {
        self.evict_unused(|value| {
            let (workload_number, set_index) = value.origin();
            plans.in_force(workload_number).is_some() || plans.have_set(value.content(), set_index)
        })
    }
}
