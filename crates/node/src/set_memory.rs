//! The sets that a role keeps in memory, which it can give back.

use std::hash::Hash;

use crate::byte_cache::ByteCache;

/// Sets in memory for later.
pub trait SetMemory: Send + Sync {
    /// Evicts all sets that are not in use; gives their bytes.
    fn free(&self) -> usize;
}

impl<K: Clone + Eq + Hash + Send + Sync + 'static, V: Send + Sync + 'static> SetMemory for ByteCache<K, V> {
    fn free(&self) -> usize {
        self.evict_unused()
    }
}
