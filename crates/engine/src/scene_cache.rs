//! Scenes on the device, bounded in bytes.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::{Mutex, MutexGuard};
use render::GpuScene;

/// Scenes by hash. The least recently used are evicted when others come or grow, but none that is in use: the bound is
/// exceeded instead, as it is by one large scene alone.
///
/// This is no `node::ByteCache`: an engine is called without a runtime, a load must not wait for room while its node's plan
/// waits for the scene, and a scene grows after it was loaded, by the tree that rays need.
pub(crate) struct SceneCache<S = GpuScene> {
    max_bytes: AtomicU64,
    bytes: fn(&S) -> u64,
    /// The one that was used last is at the end.
    scenes: Mutex<Scenes<S>>,
}

type Scenes<S> = Vec<(String, Arc<S>)>;

impl<S> SceneCache<S> {
    pub fn new(max_bytes: u64, bytes: fn(&S) -> u64) -> Self {
        Self { max_bytes: max_bytes.into(), bytes, scenes: Mutex::default() }
    }

    pub fn max_bytes(&self) -> u64 {
        self.max_bytes.load(Ordering::Acquire)
    }

    /// Changes the bound, for scenes to come.
    pub fn set_max_bytes(&self, max_bytes: u64) {
        self.max_bytes.store(max_bytes, Ordering::Release);
    }

    /// A scene, which is in use until it is dropped.
    pub fn get(&self, hash: &str) -> Option<Arc<S>> {
        let mut scenes = self.scenes.lock();
        let at = scenes.iter().position(|(kept, _)| kept == hash)?;
        let found = scenes.remove(at);
        let scene = found.1.clone();
        scenes.push(found);
        // Scenes grow after they were put, by the tree that rays need.
        self.evict(scenes);
        Some(scene)
    }

    /// Adds a scene that is not there.
    pub fn put(&self, hash: &str, scene: S) {
        let mut scenes = self.scenes.lock();
        scenes.push((hash.to_owned(), Arc::new(scene)));
        self.evict(scenes);
    }

    /// Takes out the least recently used that are idle, until the others are within the bound. The last one stays. Evicted scenes
    /// are dropped once the others are free to use.
    fn evict(&self, mut scenes: MutexGuard<'_, Scenes<S>>) {
        let bytes: u64 = scenes.iter().map(|(_, scene)| (self.bytes)(scene)).sum();
        let mut beyond = bytes.saturating_sub(self.max_bytes());
        let last = scenes.len().saturating_sub(1);
        let evicted = scenes.extract_if(..last, |(_, scene)| {
            let leaves = beyond > 0 && Arc::strong_count(scene) == 1;
            beyond = if leaves { beyond.saturating_sub((self.bytes)(scene)) } else { beyond };
            leaves
        });
        let evicted: Scenes<S> = evicted.collect();
        drop(scenes);
        drop(evicted);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cache(max_bytes: u64, scenes: &[(&str, u64)]) -> SceneCache<u64> {
        let cache = SceneCache::new(max_bytes, |bytes| *bytes);
        scenes.iter().for_each(|(hash, bytes)| cache.put(hash, *bytes));
        cache
    }

    fn kept(cache: &SceneCache<u64>) -> Vec<String> {
        cache.scenes.lock().iter().map(|(hash, _)| hash.clone()).collect()
    }

    #[test]
    fn the_least_recently_used_scenes_leave() {
        let cache = cache(10, &[("a", 4), ("b", 4)]);
        assert!(cache.get("a").is_some() && cache.get("none").is_none());
        cache.put("c", 5);
        assert_eq!(kept(&cache), ["a", "c"]);
    }

    #[test]
    fn a_scene_in_use_stays_and_leaves_once_it_is_not() {
        let cache = cache(10, &[("a", 8), ("b", 1)]);
        let in_use = cache.get("a");
        cache.put("c", 9);
        assert_eq!(kept(&cache), ["a", "c"], "beyond the bound");
        drop(in_use);
        cache.put("d", 1);
        assert_eq!(kept(&cache), ["c", "d"]);
    }

    #[test]
    fn scenes_that_grow_beyond_the_bound_drive_others_out() {
        let cache = SceneCache::new(10, |bytes: &AtomicU64| bytes.load(Ordering::Relaxed));
        ["a", "b"].iter().for_each(|hash| cache.put(hash, AtomicU64::new(4)));
        cache.get("b").expect("kept").store(7, Ordering::Relaxed);
        assert!(cache.get("b").is_some() && cache.get("a").is_none());
    }

    #[test]
    fn a_scene_beyond_the_bound_is_there_alone() {
        let cache = cache(10, &[("a", 4), ("large", 100)]);
        assert_eq!(kept(&cache), ["large"]);
        cache.put("b", 4);
        assert_eq!(kept(&cache), ["b"]);
    }
}
