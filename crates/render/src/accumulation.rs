//! Light that was summed before, to be added to: a still scene's samples grow better from set to set.

use std::{array, collections::VecDeque, ops::Range};

use gpu::PooledBuffer;
use parking_lot::Mutex;

/// Sums that are kept; the oldest go first.
const KEPT: usize = 16;

/// Sums over the first rays of every pixel's sequences.
pub(crate) struct Sums {
    pub buffer: PooledBuffer,
    /// Numbers of the rays to be added now: to lamps, and of ambient light.
    pub rays: [Range<u32>; 2],
}

/// The last sums, by their scene, light and pixels ([`crate::batch::Batch::key`]).
#[derive(Default)]
pub(crate) struct Accumulations(Mutex<VecDeque<(String, Sums)>>);

impl Accumulations {
    /// Sums with no more rays than `wanted`, which are now to be reached.
    pub fn take(&self, key: &str, wanted: [u32; 2]) -> Option<Sums> {
        let mut kept = self.0.lock();
        let at = kept.iter().position(|(other, sums)| {
            other == key && sums.rays.iter().zip(wanted).all(|(rays, wanted)| rays.end <= wanted)
        })?;
        let (_, Sums { buffer, rays }) = kept.remove(at)?;
        Some(Sums { buffer, rays: array::from_fn(|kind| rays[kind].end..wanted[kind]) })
    }

    /// Keeps sums whose rays have been traced.
    pub fn put(&self, key: String, sums: Sums) {
        let mut kept = self.0.lock();
        kept.push_back((key, sums));
        if kept.len() > KEPT {
            kept.pop_front();
        }
    }
}
