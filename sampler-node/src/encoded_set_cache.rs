//! The latest few sets, encoded. Each is sampled once, however many requests wait for it.

use std::collections::VecDeque;
use std::future::Future;
use std::sync::Arc;

use cluster::SetContent;
use codec::EncodedDepthImage;
use parking_lot::Mutex;
use tokio::sync::OnceCell;
use tonic::Status;

/// The content of a set, the number of tiles of an image, and the indices of images or tiles. Without the plan: a static
/// scene is not sampled again for another.
pub(crate) type Key = (SetContent, u32, Vec<u32>);

/// Encoded images with their indices.
pub(crate) type EncodedImages = Arc<Vec<(u32, EncodedDepthImage)>>;

type Cell = Arc<OnceCell<EncodedImages>>;

/// A cache that is bounded by bytes and evicts the set that was used longest ago.
#[derive(Debug)]
pub(crate) struct EncodedSetCache {
    max_bytes: usize,
    sets: Mutex<VecDeque<(Key, Cell)>>,
}

impl EncodedSetCache {
    pub(crate) fn new(max_bytes: usize) -> Self {
        Self { max_bytes, sets: Mutex::default() }
    }

    /// The images of a set, made for the first request. Making goes on when that request is dropped.
    pub(crate) async fn get<F>(
        self: &Arc<Self>,
        key: Key,
        make: impl FnOnce() -> F + Send + 'static,
    ) -> Result<EncodedImages, Status>
    where
        F: Future<Output = Result<EncodedImages, Status>> + Send + 'static,
    {
        let (cell, cache) = (self.cell(key), self.clone());
        let making = tokio::spawn(async move {
            let images = cell.get_or_try_init(make).await?.clone();
            cache.evict();
            Ok(images)
        });
        making.await.map_err(|error| Status::internal(format!("sampling failed: {error}")))?
    }

    fn cell(&self, key: Key) -> Cell {
        let mut sets = self.sets.lock();
        let at = sets.iter().position(|(other, _)| *other == key);
        let entry = at.and_then(|at| sets.remove(at)).unwrap_or_else(|| (key, Cell::default()));
        let cell = entry.1.clone();
        sets.push_back(entry);
        cell
    }

    /// Evicts sets until the rest fits; the latest stays.
    fn evict(&self) {
        let mut sets = self.sets.lock();
        let bytes =
            |cell: &Cell| cell.get().map_or(0, |images| images.iter().map(|(_, image)| image.payload.len()).sum());
        let mut total: usize = sets.iter().map(|(_, cell)| bytes(cell)).sum();
        while total > self.max_bytes && sets.len() > 1 {
            total -= sets.pop_front().map_or(0, |(_, cell)| bytes(&cell));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;

    use cluster::{Assignment, Policy, SamplePlanes, SceneHash, SceneRef, Timeline, Workload};
    use codec::{PlaneSet, encode_depth_image};
    use depth_image::{Aabb, Camera, DepthImage, Illumination, PinholeCamera};
    use glam::{UVec2, Vec3};

    use super::*;

    fn camera() -> Camera {
        Camera::Pinhole(PinholeCamera::looking_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0, UVec2::splat(8)))
    }

    fn key(set_index: u32) -> Key {
        let workload = Workload {
            scene: SceneRef { hash: SceneHash::of(b""), package_bytes: 0 },
            sample_cameras: vec![camera()],
            cell_first_indices: Vec::new(),
            sampling: "conventional".to_owned(),
            lighting: "unlit".to_owned(),
            planes: SamplePlanes::default(),
            volume: Aabb { min: Vec3::NEG_ONE, max: Vec3::ONE },
            background_linear: Vec3::ZERO,
            timeline: Timeline { start_s: 0.0, step_s: 1.0, set_count: 9 },
            illumination: Illumination::default(),
            refinement_steps: 1,
        };
        let plan = Assignment {
            plan_epoch: 1,
            workload_number: 1,
            policy: Policy::Pipeline,
            workload,
            samplers: Vec::new(),
            compositors: Vec::new(),
            tile_count: 1,
            relay_fanout: None,
        };
        (plan.set_content(set_index).unwrap(), 1, vec![0])
    }

    fn images() -> EncodedImages {
        let image = DepthImage {
            camera: camera(),
            inverse_depth_per_m: vec![0.5; 64],
            color_rgb9e5: (0..64).collect(),
            normal_oct16: None,
            surface_id: None,
            specular: None,
            passed: None,
            corner_inverse_depth_per_m: None,
        };
        Arc::new(vec![(0, encode_depth_image(&image, PlaneSet::ALL).unwrap())])
    }

    async fn get(cache: &Arc<EncodedSetCache>, set_index: u32, made: &Arc<AtomicUsize>) -> EncodedImages {
        let made = made.clone();
        let make = move || async move {
            tokio::time::sleep(Duration::from_millis(20)).await;
            made.fetch_add(1, Ordering::SeqCst);
            Ok(images())
        };
        cache.get(key(set_index), make).await.unwrap()
    }

    #[tokio::test]
    async fn requests_at_the_same_time_or_dropped_ones_make_no_set_twice() {
        let (cache, made) = (Arc::new(EncodedSetCache::new(1 << 20)), Arc::new(AtomicUsize::new(0)));
        let impatient = tokio::time::timeout(Duration::from_millis(2), get(&cache, 0, &made)).await;
        assert!(impatient.is_err());
        let (a, b) = tokio::join!(get(&cache, 0, &made), get(&cache, 0, &made));
        assert!(Arc::ptr_eq(&a, &b));
        assert_eq!(made.load(Ordering::SeqCst), 1);
    }

    #[tokio::test]
    async fn the_set_that_was_used_longest_ago_is_evicted() {
        let bytes: usize = images().iter().map(|(_, image)| image.payload.len()).sum();
        let (cache, made) = (Arc::new(EncodedSetCache::new(2 * bytes)), Arc::new(AtomicUsize::new(0)));
        for set_index in [0, 1, 0, 2, 0] {
            get(&cache, set_index, &made).await;
        }
        assert_eq!(made.load(Ordering::SeqCst), 3, "set 0 was cached");
        get(&cache, 1, &made).await;
        assert_eq!(made.load(Ordering::SeqCst), 4, "set 1 was not");
    }

    #[tokio::test]
    async fn a_failure_is_not_cached() {
        let (cache, made) = (Arc::new(EncodedSetCache::new(1 << 20)), Arc::new(AtomicUsize::new(0)));
        let failed = cache.get(key(0), || async { Err(Status::internal("lost")) }).await;
        assert_eq!(failed.unwrap_err().message(), "lost");
        get(&cache, 0, &made).await;
    }
}
