//! A page that is used for long holds no more memory than its statistics.

use std::time::{Duration, Instant};

use browser::input::Drag;
use browser_tests::visit::{Expected, Visit};

use crate::pictures::to_and_fro;
use crate::scene::gateway;

/// What a page may grow beside its statistics: compiled code, and the browser's own lists.
const MAX_GROWN_BYTES: f64 = 300e3;
/// A page compiles its code within this time.
const WARM_UP: Duration = Duration::from_secs(4);
const TIME: Duration = Duration::from_secs(20);

/// Drags and rests for a time; returns the number of pictures, and the memory without them.
async fn walk(visit: &Visit, time: Duration) -> (usize, f64) {
    let start = Instant::now();
    while start.elapsed() < time {
        visit.browser.drag(&Drag::along(to_and_fro([200.0, 200.0], 40))).await.unwrap();
        visit.rested().await;
    }
    let pictures = visit.picture_count().await;
    visit.browser.run::<()>("myriorama.statistics.pictures = []", Vec::new()).await.unwrap();
    (pictures, visit.browser.heap_bytes().await.unwrap())
}

#[tokio::test(flavor = "multi_thread")]
async fn drags_and_rests_leave_no_memory_behind() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    let (_, before) = walk(&visit, WARM_UP).await;
    let (pictures, after) = walk(&visit, TIME).await;
    assert!(pictures >= 20, "{pictures} pictures");
    assert!(after - before < MAX_GROWN_BYTES, "{} bytes for {pictures} pictures", after - before);
    visit.end(Expected::NoError).await;
}
