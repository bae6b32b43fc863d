//! A cache that is bounded in bytes. A value is loaded once for all that wait for it, and stays while it is in use.

use std::collections::HashMap;
use std::hash::Hash;
use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use tokio::sync::{Notify, watch};
use tonic::Status;

/// A cached value in use: it is not evicted before all clones are dropped.
pub struct Pinned<V>(Arc<Held<V>>);

/// A loaded value.
struct Held<V> {
    value: V,
    bytes: usize,
    pins: AtomicUsize,
    freed: Arc<Notify>,
}

impl<V> Pinned<V> {
    fn new(held: &Arc<Held<V>>) -> Self {
        held.pins.fetch_add(1, Ordering::AcqRel);
        Self(held.clone())
    }
}

impl<V> Clone for Pinned<V> {
    fn clone(&self) -> Self {
        Self::new(&self.0)
    }
}

impl<V> Drop for Pinned<V> {
    fn drop(&mut self) {
        if self.0.pins.fetch_sub(1, Ordering::AcqRel) == 1 {
            self.0.freed.notify_waiters();
        }
    }
}

impl<V> Deref for Pinned<V> {
    type Target = V;

    fn deref(&self) -> &V {
        &self.0.value
    }
}

/// A value and its size, or why it cannot be loaded.
type Loaded<V> = Result<(V, usize), Status>;
/// The end of a load; `None` before it.
type Outcome<V> = Option<Result<Pinned<V>, Status>>;

/// A loaded value with its key, and when it was last used.
type UsedValue<K, V> = (K, Arc<Held<V>>, Instant);

enum Entry<V> {
    Loading(watch::Receiver<Outcome<V>>),
    Loaded { held: Arc<Held<V>>, used_at: Instant },
}

struct State<K, V> {
    entries: HashMap<K, Entry<V>>,
    /// Bytes of loaded values, and of those that are being loaded.
    used_bytes: usize,
    /// Loads that wait for room.
    waiting: usize,
}

struct Inner<K, V> {
    /// The values, in refusals.
    what: &'static str,
    max_bytes: usize,
    state: Mutex<State<K, V>>,
    /// Loads wait for room one after the other: small ones cannot keep a large one waiting. One of more than half the bound
    /// has no turn. It may have to wait until hardly anything is in use, and must not keep all others waiting until then.
    turn: tokio::sync::Mutex<()>,
    freed: Arc<Notify>,
}

/// Values by key. The least recently used are evicted for new ones. A value that would exceed the bound while all others
/// are in use waits. Clones share the values.
pub struct ByteCache<K, V>(Arc<Inner<K, V>>);

impl<K, V> Clone for ByteCache<K, V> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<K: Clone + Eq + Hash + Send + Sync + 'static, V: Send + Sync + 'static> ByteCache<K, V> {
    /// An empty cache of `max_bytes`; refusals name its values by `what`.
    #[must_use]
    pub fn new(what: &'static str, max_bytes: usize) -> Self {
        let state = Mutex::new(State { entries: HashMap::new(), used_bytes: 0, waiting: 0 });
        Self(Arc::new(Inner { what, max_bytes, state, turn: tokio::sync::Mutex::default(), freed: Arc::default() }))
    }

    /// The bound.
    #[must_use]
    pub fn max_bytes(&self) -> usize {
        self.0.max_bytes
    }

    /// A value that is loaded already.
    #[must_use]
    pub fn loaded(&self, key: &K) -> Option<Pinned<V>> {
        self.0.state.lock().loaded(key)
    }

    /// Whether a value is being loaded, or waits for room.
    #[must_use]
    pub fn is_loading(&self, key: &K) -> bool {
        matches!(self.0.state.lock().entries.get(key), Some(Entry::Loading(_)))
    }

    /// All loaded values that are `wanted`. This counts as no use of them.
    #[must_use]
    pub fn loaded_where(&self, wanted: impl Fn(&V) -> bool) -> Vec<Pinned<V>> {
        let state = self.0.state.lock();
        let loaded = state.by_use().into_iter().filter(|(_, held, _)| wanted(&held.value));
        loaded.map(|(_, held, _)| Pinned::new(&held)).collect()
    }

    /// Evicts the least recently used of the values that are `alike` and not in use, until `most` that are alike are left.
    pub fn keep_latest(&self, most: usize, alike: impl Fn(&V) -> bool) {
        let mut state = self.0.state.lock();
        let mut beyond = state.by_use();
        beyond.retain(|(_, held, _)| alike(&held.value));
        beyond.truncate(beyond.len().saturating_sub(most));
        beyond.retain(|(_, held, _)| held.pins.load(Ordering::Acquire) == 0);
        let evicted = state.evict_until(0, beyond);
        drop(state);
        drop(evicted);
        self.0.freed.notify_waiters();
    }

    /// Evicts all values that are not in use; gives their bytes.
    pub fn free(&self) -> usize {
        let mut state = self.0.state.lock();
        let unused = state.unused(Duration::ZERO);
        let evicted = state.evict_until(0, unused);
        drop(state);
        let freed = evicted.iter().map(|held| held.bytes).sum();
        drop(evicted);
        self.0.freed.notify_waiters();
        freed
    }

    /// A value, loaded for the first that asks for it. A load that has begun goes on when those that wait for it leave, and a
    /// failed one is forgotten. `load` gives the value and its size, which should be at most `most_bytes`; it is dropped
    /// where another load serves.
    ///
    /// # Errors
    /// The load's own; `RESOURCE_EXHAUSTED` for a value beyond the bound.
    pub async fn get(
        &self,
        key: K,
        most_bytes: usize,
        load: impl Future<Output = Loaded<V>> + Send + 'static,
    ) -> Result<Pinned<V>, Status> {
        let mut outcome = {
            let mut state = self.0.state.lock();
            if let Some(value) = state.loaded(&key) {
                return Ok(value);
            }
            match state.entries.get(&key) {
                Some(Entry::Loading(outcome)) => outcome.clone(),
                _ => {
                    let (send, outcome) = watch::channel(None);
                    state.entries.insert(key.clone(), Entry::Loading(outcome.clone()));
                    tokio::spawn(self.clone().load_with_room(key, most_bytes, load, send));
                    outcome
                }
            }
        };
        let ended = outcome.wait_for(Option::is_some).await.map(|outcome| outcome.clone());
        ended.ok().flatten().unwrap_or_else(|| Err(Status::internal(format!("loading {} was given up", self.0.what))))
    }

    /// Begins to load a value ahead, where it has room at once: beside the values that were used within `recently`, and
    /// while none waits for room. Gives whether the value is loaded or being loaded.
    pub fn load_ahead(
        &self,
        key: K,
        most_bytes: usize,
        recently: Duration,
        load: impl Future<Output = Loaded<V>> + Send + 'static,
    ) -> bool {
        let mut state = self.0.state.lock();
        if let Some(entry) = state.entries.get_mut(&key) {
            // It is about to be used: what is loaded ahead after it must not evict it.
            if let Entry::Loaded { used_at, .. } = entry {
                *used_at = Instant::now();
            }
            return true;
        }
        if state.waiting > 0 {
            return false;
        }
        let Some(evicted) = state.make_room(most_bytes, self.0.max_bytes, recently) else { return false };
        let (send, outcome) = watch::channel(None);
        state.entries.insert(key.clone(), Entry::Loading(outcome));
        drop(state);
        drop(evicted);
        tokio::spawn(self.clone().load(key, most_bytes, load, send));
        true
    }

    /// Loads when there is room, unless all that asked for it have left by then.
    async fn load_with_room(
        self,
        key: K,
        most_bytes: usize,
        load: impl Future<Output = Loaded<V>> + Send + 'static,
        send: watch::Sender<Outcome<V>>,
    ) {
        self.0.state.lock().waiting += 1;
        let reserved = self.reserve(&key, most_bytes, &send).await;
        self.0.state.lock().waiting -= 1;
        match reserved {
            Ok(true) => self.load(key, most_bytes, load, send).await,
            Ok(false) => (),
            Err(refused) => self.end(&key, 0, Err(refused), &send),
        }
    }

    async fn load(
        self,
        key: K,
        reserved_bytes: usize,
        load: impl Future<Output = Loaded<V>> + Send + 'static,
        send: watch::Sender<Outcome<V>>,
    ) {
        // A task of its own: a panic in it must give the room back.
        let loaded = tokio::spawn(load)
            .await
            .unwrap_or_else(|error| Err(Status::internal(format!("loading {} failed: {error}", self.0.what))));
        self.end(&key, reserved_bytes, loaded, &send);
    }

    /// Waits for room of `bytes`, which then count as used. Gives up, and removes the entry, when all that asked have left.
    async fn reserve(&self, key: &K, bytes: usize, send: &watch::Sender<Outcome<V>>) -> Result<bool, Status> {
        let Inner { what, max_bytes, .. } = *self.0;
        if bytes > max_bytes {
            let reason = format!("set-memory: {bytes} bytes of {what} exceed the {max_bytes} bytes of this node");
            return Err(Status::resource_exhausted(reason));
        }
        let _turn = if bytes <= max_bytes / 2 { Some(self.0.turn.lock().await) } else { None };
        loop {
            let freed = self.0.freed.notified();
            tokio::pin!(freed);
            // From here on no notice is missed.
            freed.as_mut().enable();
            {
                let mut state = self.0.state.lock();
                // The entry itself holds one receiver.
                if send.receiver_count() <= 1 {
                    state.entries.remove(key);
                    return Ok(false);
                }
                if let Some(evicted) = state.make_room(bytes, max_bytes, Duration::ZERO) {
                    // The device may take long to free them.
                    drop(state);
                    drop(evicted);
                    return Ok(true);
                }
            }
            freed.await;
        }
    }

    /// Puts a loaded value in place of its room; a failed one leaves.
    fn end(&self, key: &K, reserved_bytes: usize, loaded: Loaded<V>, send: &watch::Sender<Outcome<V>>) {
        let mut state = self.0.state.lock();
        state.used_bytes -= reserved_bytes;
        state.entries.remove(key);
        let mut evicted = Vec::new();
        let outcome = loaded.map(|(value, bytes)| {
            match state.make_room(bytes, self.0.max_bytes, Duration::ZERO) {
                Some(others) => evicted = others,
                // It exists, larger than it was said to be: it counts, and others wait for it.
                None => state.used_bytes += bytes,
            }
            let held = Arc::new(Held { value, bytes, pins: AtomicUsize::new(0), freed: self.0.freed.clone() });
            let pinned = Pinned::new(&held);
            state.entries.insert(key.clone(), Entry::Loaded { held, used_at: Instant::now() });
            pinned
        });
        drop(state);
        drop(evicted);
        send.send_replace(Some(outcome));
        self.0.freed.notify_waiters();
    }
}

impl<K: Clone + Eq + Hash, V> State<K, V> {
    fn loaded(&mut self, key: &K) -> Option<Pinned<V>> {
        match self.entries.get_mut(key) {
            Some(Entry::Loaded { held, used_at }) => {
                *used_at = Instant::now();
                Some(Pinned::new(held))
            }
            _ => None,
        }
    }

    /// All loaded values and the times of their last uses, the one that was used longest ago first.
    fn by_use(&self) -> Vec<UsedValue<K, V>> {
        let mut loaded = Vec::new();
        for (key, entry) in &self.entries {
            if let Entry::Loaded { held, used_at } = entry {
                loaded.push((key.clone(), held.clone(), *used_at));
            }
        }
        loaded.sort_unstable_by_key(|(.., used_at)| *used_at);
        loaded
    }

    /// The values that are not in use and were not used within `recently`.
    fn unused(&self, recently: Duration) -> Vec<UsedValue<K, V>> {
        let mut unused = self.by_use();
        unused.retain(|(_, held, used_at)| held.pins.load(Ordering::Acquire) == 0 && used_at.elapsed() >= recently);
        unused
    }

    /// Takes room for `bytes`, with the values that were evicted for it; `None` where too much is in use.
    fn make_room(&mut self, bytes: usize, max_bytes: usize, recently: Duration) -> Option<Vec<Arc<Held<V>>>> {
        let unused = self.unused(recently);
        let evictable: usize = unused.iter().map(|(_, held, _)| held.bytes).sum();
        if self.used_bytes - evictable + bytes > max_bytes {
            return None;
        }
        let evicted = self.evict_until(max_bytes.saturating_sub(bytes), unused);
        self.used_bytes += bytes;
        Some(evicted)
    }

    /// Evicts the first of these values until at most `most_bytes` are used. The caller drops them outside the lock.
    fn evict_until(&mut self, most_bytes: usize, unused: Vec<UsedValue<K, V>>) -> Vec<Arc<Held<V>>> {
        let mut evicted = Vec::new();
        for (key, held, _) in unused {
            if self.used_bytes <= most_bytes {
                break;
            }
            self.used_bytes -= held.bytes;
            self.entries.remove(&key);
            evicted.push(held);
        }
        evicted
    }
}

#[cfg(test)]
#[path = "byte_cache_tests.rs"]
mod tests;
