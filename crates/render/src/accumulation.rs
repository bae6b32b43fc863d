//! Light that was summed before, to be added to: a still scene's samples grow better from set to set.

use std::{collections::VecDeque, ops::Range};

use depth_image::PinholeCamera;
use gpu::PooledBuffer;
use parking_lot::Mutex;

use crate::{Lighting, finish::FinishVariant, known_samples::RedundancyVariant};

/// Sums that are kept; the oldest go first.
const KEPT: usize = 16;

/// The scene, light and pixels of sums.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Key {
    pub scene: u64,
    pub lighting: Lighting,
    pub scene_time_s: f32,
    pub cameras: Vec<PinholeCamera>,
    pub finish: FinishVariant,
    /// The first image's.
    pub redundancy: Option<RedundancyVariant>,
}

/// Sums over the first rays of every pixel's sequences.
pub(crate) struct Sums {
    pub buffer: PooledBuffer,
    /// Numbers of the rays to be added now: to lamps, and of occlusion.
    shadow: Range<u32>,
    occlusion: Range<u32>,
}

#[derive(Default)]
pub(crate) struct Accumulations(Mutex<VecDeque<(Key, Sums)>>);

impl Sums {
    /// Empty sums, and `wanted` rays to be traced.
    pub fn new(buffer: PooledBuffer, wanted: [u32; 2]) -> Self {
        let [shadow, occlusion] = wanted;
        Self { buffer, shadow: 0..shadow, occlusion: 0..occlusion }
    }

    /// Numbers of the rays to be traced now.
    pub fn ranges(&self) -> [Range<u32>; 2] {
        [self.shadow.clone(), self.occlusion.clone()]
    }

    /// Rays that are in the sums already.
    pub fn rays_before(&self) -> u32 {
        self.shadow.start.max(self.occlusion.start)
    }
}

impl Accumulations {
    /// Sums with no more rays than `wanted`, which are now to be reached.
    pub fn take(&self, key: &Key, wanted: [u32; 2]) -> Option<Sums> {
        let mut kept = self.0.lock();
        let at = kept.iter().position(|(other, sums)| {
            other == key && sums.shadow.end <= wanted[0] && sums.occlusion.end <= wanted[1]
        })?;
        let (_, sums) = kept.remove(at)?;
        let (shadow, occlusion) = (sums.shadow.end..wanted[0], sums.occlusion.end..wanted[1]);
        Some(Sums { shadow, occlusion, ..sums })
    }

    /// Keeps sums whose rays have been traced.
    pub fn put(&self, key: Key, sums: Sums) {
        let mut kept = self.0.lock();
        kept.push_back((key, sums));
        if kept.len() > KEPT {
            kept.pop_front();
        }
    }
}
