//! The bound holds at each step, and what is in use stays.

use tokio::task::{JoinHandle, yield_now};

use super::*;

/// A value that counts its bytes as long as it exists.
struct Block {
    bytes: usize,
    existing: Arc<AtomicUsize>,
}

impl Drop for Block {
    fn drop(&mut self) {
        self.existing.fetch_sub(self.bytes, Ordering::SeqCst);
    }
}

#[derive(Clone)]
struct Bench {
    cache: ByteCache<u32, Block>,
    existing: Arc<AtomicUsize>,
    loads: Arc<AtomicUsize>,
}

impl<K, V> ByteCache<K, V> {
    fn used_bytes(&self) -> usize {
        self.0.state.lock().used_bytes
    }
}

impl Bench {
    fn new(max_bytes: usize) -> Self {
        Self { cache: ByteCache::new("blocks", max_bytes), existing: Arc::default(), loads: Arc::default() }
    }

    async fn get(&self, key: u32, bytes: usize) -> Result<Pinned<Block>, Status> {
        self.get_sized(key, bytes, bytes).await
    }

    async fn get_sized(&self, key: u32, most_bytes: usize, bytes: usize) -> Result<Pinned<Block>, Status> {
        let existing = self.existing.clone();
        let loads = self.loads.clone();
        let load = async move {
            loads.fetch_add(1, Ordering::SeqCst);
            existing.fetch_add(bytes, Ordering::SeqCst);
            let block = Block { bytes, existing };
            yield_now().await;
            Ok((block, bytes))
        };
        self.cache.get(key, most_bytes, load).await
    }

    fn wait_for(&self, key: u32, bytes: usize) -> JoinHandle<Pinned<Block>> {
        let bench = self.clone();
        tokio::spawn(async move { bench.get(key, bytes).await.unwrap() })
    }

    fn loads(&self) -> usize {
        self.loads.load(Ordering::SeqCst)
    }

    fn assert_bounded(&self) {
        let used = self.cache.used_bytes();
        let existing = self.existing.load(Ordering::SeqCst);
        assert!(existing <= used && used <= self.cache.max_bytes(), "{existing} of {used}");
    }
}

/// Lets every task go on as far as it can.
async fn settle() {
    for _ in 0..50 {
        yield_now().await;
    }
}

#[tokio::test]
async fn a_value_is_loaded_once_for_all_and_goes_on_when_the_first_leaves() {
    let bench = Bench::new(100);
    let (open, opened) = watch::channel(false);
    let slow = |cache: ByteCache<u32, Block>, mut opened: watch::Receiver<bool>, bench: Bench| async move {
        let load = async move {
            bench.loads.fetch_add(1, Ordering::SeqCst);
            let _ = opened.wait_for(|open| *open).await;
            Ok((Block { bytes: 0, existing: bench.existing }, 10))
        };
        cache.get(1, 10, load).await
    };
    let first = tokio::spawn(slow(bench.cache.clone(), opened.clone(), bench.clone()));
    settle().await;
    first.abort();
    let others = [0, 1].map(|_| tokio::spawn(slow(bench.cache.clone(), opened.clone(), bench.clone())));
    settle().await;
    open.send_replace(true);
    for other in others {
        assert_eq!(other.await.unwrap().unwrap().0.bytes, 10);
    }
    assert_eq!(bench.loads(), 1);
}

#[tokio::test]
async fn the_value_that_was_used_longest_ago_is_evicted() {
    let bench = Bench::new(20);
    for key in [0, 1, 0, 2, 0] {
        bench.get(key, 10).await.unwrap();
    }
    assert_eq!(bench.loads(), 3, "0 was cached");
    assert!(bench.cache.loaded(&1).is_none() && bench.cache.loaded(&2).is_some());
}

#[tokio::test]
async fn a_value_waits_while_all_others_are_in_use() {
    let bench = Bench::new(20);
    let first = bench.get(0, 10).await.unwrap();
    let second = bench.get(1, 10).await.unwrap();
    let waiting = bench.wait_for(2, 10);
    let behind = bench.wait_for(3, 5);
    settle().await;
    assert!(!waiting.is_finished() && bench.loads() == 2);
    drop(second.clone());
    settle().await;
    assert!(!waiting.is_finished() && !behind.is_finished());
    drop((first, second));
    drop((waiting.await.unwrap(), behind.await.unwrap()));
    bench.assert_bounded();
    assert!(bench.cache.loaded(&0).is_none() && bench.cache.loaded(&1).is_none());
}

#[tokio::test]
async fn values_wait_in_order_but_for_one_of_more_than_half_the_bound() {
    let bench = Bench::new(20);
    let first = bench.get(0, 12).await.unwrap();
    let second = bench.get(1, 4).await.unwrap();
    let waiting = bench.wait_for(2, 10);
    let behind = bench.wait_for(3, 2);
    settle().await;
    assert!(!behind.is_finished(), "it has room, and does not overtake");
    drop(second);
    settle().await;
    assert!(!waiting.is_finished() && bench.cache.loaded(&1).is_some(), "nothing is evicted in vain");
    drop(first);
    drop((waiting.await.unwrap(), behind.await.unwrap()));
    let pinned = bench.get(5, 1).await.unwrap();
    let huge = bench.wait_for(4, 20);
    settle().await;
    drop(bench.wait_for(6, 10).await.unwrap());
    assert!(!huge.is_finished(), "it keeps no other waiting");
    drop(pinned);
    drop(huge.await.unwrap());
    bench.assert_bounded();
}

#[tokio::test]
async fn a_load_that_nobody_waits_for_any_more_takes_no_room() {
    let bench = Bench::new(10);
    let pinned = bench.get(0, 10).await.unwrap();
    let left = bench.wait_for(1, 10);
    settle().await;
    left.abort();
    settle().await;
    drop(pinned);
    settle().await;
    assert!(bench.cache.loaded(&0).is_some() && !bench.cache.is_loading(&1));
    assert_eq!((bench.loads(), bench.cache.used_bytes()), (1, 10));
    bench.get(1, 10).await.unwrap();
}

#[tokio::test]
async fn failures_leave_and_give_their_room_back() {
    let bench = Bench::new(10);
    let fail = async { Err(Status::unavailable("lost")) };
    assert_eq!(bench.cache.get(0, 10, fail).await.err().unwrap().message(), "lost");
    let panicked = bench.cache.get(0, 10, async { panic!("in a test") }).await.err().unwrap();
    assert!(panicked.message().contains("loading blocks failed"), "{panicked}");
    assert_eq!(bench.cache.used_bytes(), 0);
    let refused = bench.get(0, 11).await.err().unwrap();
    assert_eq!(refused.code(), tonic::Code::ResourceExhausted);
    assert_eq!(refused.message(), "set-memory: 11 bytes of blocks exceed the 10 bytes of this node");
    bench.get(0, 10).await.unwrap();
    assert_eq!(bench.loads(), 1);
}

#[tokio::test]
async fn a_value_counts_by_its_true_size_once_it_is_known() {
    let bench = Bench::new(20);
    let small = bench.get_sized(0, 20, 5).await.unwrap();
    assert_eq!(bench.cache.used_bytes(), 5);
    bench.get(1, 15).await.unwrap();
    let large = bench.get_sized(2, 1, 18).await.unwrap();
    assert_eq!(bench.cache.used_bytes(), 23, "it exists, beside one in use");
    let waiting = bench.wait_for(3, 2);
    settle().await;
    assert!(!waiting.is_finished());
    drop((small, large));
    drop(waiting.await.unwrap());
    bench.assert_bounded();
}

#[tokio::test]
async fn a_value_is_loaded_ahead_only_where_it_has_room_at_once() {
    let bench = Bench::new(20);
    let pinned = bench.get(0, 15).await.unwrap();
    let ahead = |key: u32, recently: Duration| {
        let existing = bench.existing.clone();
        let load = async move {
            existing.fetch_add(10, Ordering::SeqCst);
            Ok((Block { bytes: 10, existing }, 10))
        };
        bench.cache.load_ahead(key, 10, recently, load)
    };
    assert!(!ahead(1, Duration::ZERO));
    settle().await;
    assert!(bench.cache.loaded(&1).is_none());
    drop(pinned);
    assert!(!ahead(1, Duration::from_secs(3600)), "the other was used just now");
    settle().await;
    assert!(bench.cache.loaded(&1).is_none() && bench.cache.loaded(&0).is_some());
    assert!(ahead(1, Duration::ZERO));
    settle().await;
    assert!(bench.cache.loaded(&1).is_some() && bench.cache.loaded(&0).is_none());
    assert_eq!(bench.cache.loaded_where(|block| block.bytes == 10).len(), 1);
}

#[tokio::test]
async fn nothing_is_loaded_ahead_of_those_that_wait_for_room() {
    for waiting_bytes in [10, 20] {
        let bench = Bench::new(20);
        let pinned = bench.get(0, 16).await.unwrap();
        let waiting = bench.wait_for(1, waiting_bytes);
        settle().await;
        let load = |key, bytes| {
            let load = async { Err(Status::internal("it is not begun")) };
            bench.cache.load_ahead(key, bytes, Duration::ZERO, load)
        };
        assert!(!load(2, 4), "{waiting_bytes} bytes wait");
        assert!(load(0, 16), "it is there");
        drop(pinned);
        waiting.await.unwrap();
    }
}

/// A value that looks whether the cache is locked when it is dropped.
struct Looking(ByteCache<u32, Looking>, Arc<AtomicUsize>);

impl Drop for Looking {
    fn drop(&mut self) {
        self.1.fetch_add(1, Ordering::SeqCst);
        assert!(self.0.0.state.try_lock().is_some(), "the cache is locked");
    }
}

#[tokio::test]
async fn evicted_values_are_dropped_outside_the_lock() {
    let cache = ByteCache::new("values", 10);
    let dropped = Arc::<AtomicUsize>::default();
    let get = |key: u32, bytes: usize| {
        let value = Looking(cache.clone(), dropped.clone());
        cache.get(key, bytes, async move { Ok((value, bytes)) })
    };
    get(0, 10).await.unwrap();
    get(1, 10).await.unwrap();
    assert_eq!(dropped.load(Ordering::SeqCst), 1);
    assert_eq!((cache.free(), cache.used_bytes(), dropped.load(Ordering::SeqCst)), (10, 0, 2));
    let pinned = get(2, 4).await.unwrap();
    get(3, 4).await.unwrap();
    assert_eq!((cache.free(), cache.used_bytes()), (4, 4), "one is in use");
    drop(pinned);
    cache.free();
}

fn next(seed: &mut u64) -> u64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    *seed >> 33
}

/// Requests, ends of use and waits in any order: no step exceeds the bound, nothing in use leaves, and all requests end.
#[tokio::test]
async fn the_bound_holds_at_each_step_of_any_sequence() {
    for mut seed in 0..50 {
        let bench = Bench::new(100);
        let mut waiting = Vec::new();
        let mut pins = Vec::<Pinned<Block>>::new();
        for _ in 0..200 {
            if next(&mut seed).is_multiple_of(2) && !pins.is_empty() {
                pins.swap_remove(next(&mut seed) as usize % pins.len());
            } else if waiting.len() < 10 {
                let key = next(&mut seed) as u32 % 12;
                waiting.push((key, bench.wait_for(key, 8 + 7 * key as usize)));
            }
            for _ in 0..next(&mut seed) % 9 {
                yield_now().await;
                bench.assert_bounded();
            }
            let (ended, open): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|(_, task)| task.is_finished());
            waiting = open;
            for (key, task) in ended {
                let pinned = task.await.unwrap();
                assert!(Arc::ptr_eq(&pinned.0, &bench.cache.loaded(&key).unwrap().0), "it stays while it is in use");
                pins.push(pinned);
            }
        }
        for _ in 0..20 {
            pins.clear();
            settle().await;
            // The value of a task that has ended is in use until the task is dropped.
            waiting.retain(|(_, task)| !task.is_finished());
        }
        assert!(waiting.is_empty(), "{} requests wait for ever", waiting.len());
        bench.assert_bounded();
    }
}

#[tokio::test]
async fn the_latest_of_values_that_are_alike_stay_and_so_do_those_in_use() {
    let bench = Bench::new(100);
    let in_use = bench.get(1, 5).await.unwrap();
    for key in [2, 3, 4] {
        bench.get(key, 5).await.unwrap();
    }
    bench.get(9, 7).await.unwrap();
    bench.cache.keep_latest(2, |block| block.bytes == 5);
    let kept = [1, 2, 3, 4, 9].map(|key| bench.cache.loaded(&key).is_some());
    assert_eq!(kept, [true, false, true, true, true]);
    drop(in_use);
    bench.cache.keep_latest(2, |block| block.bytes == 5);
    assert_eq!(bench.existing.load(Ordering::SeqCst), 17);
    bench.assert_bounded();
}
