//! Resources that live longer than one frame: making them each time costs more than many passes, and their memory a page
//! fault for every 4 KiB where the device is a processor.

use std::sync::{Arc, Weak};
use std::{collections::VecDeque, ops::Deref};

use parking_lot::Mutex;
use wgpu::BufferUsages;

use crate::{device::Gpu, faults::Faults};

/// The most bytes of free buffers: those of a few batches.
const MOST_FREE_BYTES: u64 = 128 << 20;

/// Items that nobody has.
struct Free<K, T> {
    items: Mutex<FreeItems<K, T>>,
    /// The most weight of all of them.
    most: u64,
    weight: fn(&K) -> u64,
    faults: Arc<Faults>,
}

struct FreeItems<K, T> {
    /// The device's shortages of memory when the first of them came back.
    shortages: u64,
    /// The one that came back last is at the end.
    items: VecDeque<(K, T)>,
}

/// Lends items of a kind; they come back when dropped.
pub struct Pool<K, T>(Arc<Free<K, T>>);

/// An item on loan, with the contents of its last loan.
pub struct Lent<K, T> {
    lent: Option<(K, T)>,
    home: Weak<Free<K, T>>,
    /// The device's shortages of memory when it was made or lent.
    shortages: u64,
}

/// A buffer's size and usage.
pub type BufferKind = (u64, BufferUsages);
/// A buffer on loan.
pub type PooledBuffer = Lent<BufferKind, wgpu::Buffer>;

/// Lends buffers of sizes rounded up to a power of two.
pub struct BufferPool {
    gpu: Arc<Gpu>,
    buffers: Pool<BufferKind, wgpu::Buffer>,
}

impl<K, T> Pool<K, T> {
    /// A pool of resources of a device that keeps at most `most_bytes` of them free: the one that came back first goes first.
    /// What was lent before the device's memory ran out is not lent again.
    #[must_use]
    pub fn of_device(gpu: &Gpu, most_bytes: u64, bytes: fn(&K) -> u64) -> Self {
        Self::new(gpu.faults.clone(), most_bytes, bytes)
    }

    fn new(faults: Arc<Faults>, most: u64, weight: fn(&K) -> u64) -> Self {
        let items = FreeItems { shortages: 0, items: VecDeque::new() };
        Self(Arc::new(Free { items: Mutex::new(items), most, weight, faults }))
    }
}

impl<K: PartialEq, T> Pool<K, T> {
    /// An item of this kind, made where none is free.
    #[must_use]
    pub fn lend(&self, kind: K, make: impl FnOnce(&K) -> T) -> Lent<K, T> {
        let shortages = self.0.faults.shortages();
        let kept = {
            let mut free = self.0.items.lock();
            if std::mem::replace(&mut free.shortages, shortages) != shortages {
                // The device needs the memory, and some may have none.
                free.items.clear();
            }
            let at = free.items.iter().rposition(|(other, _)| *other == kind);
            at.and_then(|at| free.items.remove(at))
        };
        let lent = kept.unwrap_or_else(|| {
            let made = make(&kind);
            (kind, made)
        });
        Lent { lent: Some(lent), home: Arc::downgrade(&self.0), shortages }
    }
}

impl<K, T> Lent<K, T> {
    /// An item of no pool.
    pub(crate) fn unpooled(kind: K, item: T) -> Self {
        Self { lent: Some((kind, item)), home: Weak::new(), shortages: 0 }
    }

    fn lent(&self) -> &(K, T) {
        self.lent.as_ref().expect("present until dropped")
    }

    /// The kind that was asked for.
    #[must_use]
    pub fn kind(&self) -> &K {
        &self.lent().0
    }
}

impl<K, T> Deref for Lent<K, T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.lent().1
    }
}

impl<K, T> Drop for Lent<K, T> {
    fn drop(&mut self) {
        let (Some(home), Some(lent)) = (self.home.upgrade(), self.lent.take()) else { return };
        let mut free = home.items.lock();
        if free.shortages != self.shortages || home.faults.shortages() != self.shortages {
            return;
        }
        if (home.weight)(&lent.0) > home.most {
            return;
        }
        free.items.push_back(lent);
        while free.items.iter().map(|(kind, _)| (home.weight)(kind)).sum::<u64>() > home.most {
            free.items.pop_front();
        }
    }
}

impl BufferPool {
    /// An empty pool.
    #[must_use]
    pub fn new(gpu: &Arc<Gpu>) -> Self {
        Self { gpu: gpu.clone(), buffers: Pool::of_device(gpu, MOST_FREE_BYTES, |&(bytes, _)| bytes) }
    }

    fn lend(&self, label: &str, bytes: u64, usage: BufferUsages) -> PooledBuffer {
        let size = bytes.max(256).next_power_of_two().min(bytes.max(256).next_multiple_of(1 << 22));
        self.buffers.lend((size, usage), |_| self.gpu.buffer(label, size, usage))
    }

    /// A device buffer that shaders write and copies read.
    #[must_use]
    pub fn lend_storage(&self, label: &str, bytes: u64) -> PooledBuffer {
        self.lend(label, bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST)
    }

    /// A host-visible buffer to read back into.
    #[must_use]
    pub fn lend_host(&self, label: &str, bytes: u64) -> PooledBuffer {
        self.lend(label, bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn returned_items_are_lent_again_and_surplus_ones_dropped() {
        let pool = Pool::new(Arc::default(), 2, |_| 1);
        let lend = |kind: char, value: u32| pool.lend(kind, |_| value);
        let a = lend('a', 1);
        let b = lend('b', 2);
        assert_eq!((*a, *lend('a', 3), *a.kind()), (1, 3, 'a'), "the first one is in use");
        drop(a);
        assert_eq!(*lend('a', 4), 1, "what came back last");
        drop(b);
        assert_eq!((*lend('b', 5), *lend('a', 6)), (2, 1));
        assert_eq!(*lend('a', 7), 1);
        drop((lend('c', 8), lend('d', 9), lend('e', 10)));
        assert_eq!(*lend('a', 11), 11, "two are kept, none of them this");
        let outlives = lend('f', 12);
        drop(pool);
        assert_eq!(*outlives, 12);
    }

    #[test]
    fn free_items_are_bounded_in_weight_and_those_unused_for_longest_go_first() {
        let pool = Pool::new(Arc::default(), 10, |weight: &u64| *weight);
        let kept = || pool.0.items.lock().items.iter().map(|(weight, ())| *weight).collect::<Vec<_>>();
        let lend = |weight: u64| pool.lend(weight, |_| ());
        let five = lend(5);
        let four = lend(4);
        let one = lend(1);
        drop((five, four, one));
        assert_eq!(kept(), [5, 4, 1]);
        drop(lend(5));
        assert_eq!(kept(), [4, 1, 5], "it was used last");
        drop(lend(3));
        assert_eq!(kept(), [1, 5, 3]);
        drop(lend(11));
        assert_eq!(kept(), [1, 5, 3], "larger than all that is kept");
    }
}
