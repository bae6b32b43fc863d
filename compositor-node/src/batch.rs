//! Which waiting views go to the device together.

use std::collections::VecDeque;
use std::time::Instant;

use depth_image::ViewPlanes;
use glam::UVec2;
use tokio::sync::{OwnedSemaphorePermit, mpsc};
use tonic::Status;
use wire::{FrameCodec, RequestedView, SampleSetId};

use crate::output::Output;
use crate::sets::ReadySet;

/// Views of one call to the device.
pub(crate) const MAX_BATCH: usize = 64;
/// Pixels of one call: 64 views of full HD would hold half a gigabyte.
const MAX_BATCH_PIXELS: usize = 64 << 20;

/// Views with equal keys can be made in one call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BatchKey {
    pub(crate) sample_set_id: SampleSetId,
    pub(crate) method: String,
    pub(crate) planes: ViewPlanes,
    pub(crate) size_px: UVec2,
}

/// What views are made from.
#[derive(Clone)]
pub(crate) enum Source {
    /// A complete sample set.
    Set(ReadySet),
    /// The scene itself.
    Scene { scene_hash: String, lighting: String, scene_time_s: f32 },
}

/// A view that waits for the device, with the way back to its client.
pub(crate) struct Waiting {
    pub(crate) key: BatchKey,
    pub(crate) source: Source,
    pub(crate) view: RequestedView,
    pub(crate) codec: FrameCodec,
    pub(crate) set_wait_s: f64,
    pub(crate) since: Instant,
    pub(crate) reply: mpsc::Sender<Result<Output, Status>>,
    pub(crate) credit: OwnedSemaphorePermit,
}

/// Takes the first view and those behind it that can be made with it. The others keep their order.
pub(crate) fn take_batch<T>(waiting: &mut VecDeque<T>, key: impl Fn(&T) -> &BatchKey) -> Vec<T> {
    let Some(first) = waiting.pop_front() else {
        return Vec::new();
    };
    let wanted = key(&first).clone();
    let most = (MAX_BATCH_PIXELS / (wanted.size_px.element_product() as usize).max(1)).clamp(1, MAX_BATCH);
    let mut batch = vec![first];
    let mut rest = VecDeque::with_capacity(waiting.len());
    for view in waiting.drain(..) {
        if batch.len() < most && *key(&view) == wanted { batch.push(view) } else { rest.push_back(view) }
    }
    *waiting = rest;
    batch
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(index: u64, side_px: u32) -> BatchKey {
        BatchKey {
            sample_set_id: SampleSetId { plan_epoch: 1, index },
            method: String::new(),
            planes: ViewPlanes::default(),
            size_px: UVec2::splat(side_px),
        }
    }

    #[test]
    fn batches_never_mix_sets_and_keep_the_order() {
        let mut waiting: VecDeque<_> = (0..200).map(|i| (key(i / 3 % 2, 64), i)).collect();
        let mut seen = Vec::new();
        while !waiting.is_empty() {
            let batch = take_batch(&mut waiting, |(key, _)| key);
            assert!(batch.len() <= MAX_BATCH && batch.iter().all(|(key, _)| *key == batch[0].0));
            assert!(batch.is_sorted_by_key(|(_, i)| *i));
            seen.extend(batch.into_iter().map(|(_, i)| i));
        }
        seen.sort_unstable();
        assert_eq!(seen, (0..200).collect::<Vec<_>>());
    }

    #[test]
    fn large_views_make_small_batches() {
        let mut waiting: VecDeque<_> = (0..8).map(|_| (key(0, 4096), ())).collect();
        assert_eq!(take_batch(&mut waiting, |(key, ())| key).len(), 4);
        let mut waiting: VecDeque<_> = (0..2).map(|_| (key(0, 16_384), ())).collect();
        assert_eq!(take_batch(&mut waiting, |(key, ())| key).len(), 1);
    }
}
