//! Scenes on the device, bounded in bytes.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;
use render::GpuScene;

/// Scenes by hash. The least recently used are evicted for new ones, but none that is in use: the bound is exceeded instead,
/// as it is by one large scene alone.
///
/// This is no `node::ByteCache`: an engine is called without a runtime, a load must not wait for room while its node's plan
/// waits for the scene, and a scene grows after it was loaded, by the tree that rays need.
pub(crate) struct SceneCache<S = GpuScene> {
    max_bytes: AtomicU64,
    bytes: fn(&S) -> u64,
    /// The one that was used last is at the end.
    scenes: Mutex<Vec<(String, Arc<S>)>>,
}

impl<S> SceneCache<S> {
    pub fn new(max_bytes: u64, bytes: fn(&S) -> u64) -> Self {
        Self { max_bytes: max_bytes.into(), bytes, scenes: Mutex::default() }
    }

    /// Changes the bound, for scenes to come.
    pub fn set_max_bytes(&self, max_bytes: u64) {
        self.max_bytes.store(max_bytes, Ordering::Release);
    }

    /// Whether a scene is there. This is a use of it.
    pub fn has(&self, hash: &str) -> bool {
        self.get(hash).is_some()
    }

    /// A scene, which is in use until it is dropped.
    pub fn get(&self, hash: &str) -> Option<Arc<S>> {
        let mut scenes = self.scenes.lock();
        let at = scenes.iter().position(|(kept, _)| kept == hash)?;
        let found = scenes.remove(at);
        let scene = found.1.clone();
        scenes.push(found);
        Some(scene)
    }

    /// Adds a scene that is not there.
    pub fn put(&self, hash: &str, scene: S) {
        let mut scenes = self.scenes.lock();
        scenes.push((hash.to_owned(), Arc::new(scene)));
        let mut bytes: u64 = scenes.iter().map(|(_, scene)| (self.bytes)(scene)).sum();
        let max_bytes = self.max_bytes.load(Ordering::Acquire);
        while bytes > max_bytes {
            let newest = scenes.len() - 1;
            let idle = scenes[..newest].iter().position(|(_, scene)| Arc::strong_count(scene) == 1);
            let Some(idle) = idle else { return };
            bytes -= (self.bytes)(&scenes.remove(idle).1);
        }
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
        assert_eq!((cache.has("a"), cache.has("none")), (true, false));
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
    fn a_scene_beyond_the_bound_is_there_alone() {
        let cache = cache(10, &[("a", 4), ("large", 100)]);
        assert_eq!(kept(&cache), ["large"]);
        cache.put("b", 4);
        assert_eq!(kept(&cache), ["b"]);
    }
}
