//! A slow link makes pictures smaller, not older, and a freed one makes them larger again.

use std::time::{Duration, Instant};

use browser::View;
use browser::input::Drag;
use browser_tests::visit::{Expected, Picture, SOON, Visit};
use network_proxy::{Proxy, Way};

use crate::pictures::to_and_fro;
use crate::scene::gateway;

/// 1 Mbit/s.
const BYTES_PER_S: f64 = 125e3;
/// Half of the round trip.
const DELAY: Duration = Duration::from_millis(40);
/// The greatest median age on the slow link: the round trip, the gateway's budget, and as much again for a busy machine.
const MAX_MEDIAN_AGE_MS: f64 = 80.0 + 2.0 * 150.0;
/// The longest time without a picture on the slow link.
const MAX_GAP_MS: f64 = 1500.0;

/// The pictures in motion of a drag that lasts for some time.
async fn drag_for(visit: &Visit, time: Duration) -> Vec<Picture> {
    let start = Instant::now();
    let before = visit.picture_count().await;
    while start.elapsed() < time {
        visit.browser.drag(&Drag::along(to_and_fro([200.0, 200.0], 40))).await.unwrap();
    }
    let new = visit.pictures().await.split_off(before);
    new.into_iter().filter(|picture| !picture.header.still).collect()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn last_height_px(pictures: &[Picture]) -> u32 {
    pictures.last().map_or(0, |picture| picture.header.size_px[1])
}

#[tokio::test(flavor = "multi_thread")]
async fn a_slow_link_has_small_pictures_and_a_freed_one_larger_ones() {
    let (bench, _) = gateway().await;
    let proxy = Proxy::to(&bench.gateway.address, 1);
    let slow = Way::Link { bytes_per_s: BYTES_PER_S, delay: DELAY };
    proxy.set(slow, slow);
    let visit = Visit::alone(&proxy.address, View::default()).await;
    // All samples of a still take this link for a quarter of a minute.
    visit.until("window.myriorama?.statistics.pictures.length > 0").await;
    drag_for(&visit, Duration::from_secs(4)).await;
    let pictures = drag_for(&visit, Duration::from_secs(6)).await;
    let age_ms = median(pictures.iter().map(|picture| picture.age));
    assert!(age_ms < MAX_MEDIAN_AGE_MS, "{age_ms} ms");
    let gaps = pictures.windows(2).map(|pair| pair[1].painted_at - pair[0].painted_at);
    let longest_ms = gaps.fold(0.0, f64::max);
    assert!(longest_ms < MAX_GAP_MS, "no picture for {longest_ms} ms");
    let small_px = last_height_px(&pictures);
    proxy.heal();
    let start = Instant::now();
    while last_height_px(&drag_for(&visit, Duration::from_secs(1)).await) <= small_px {
        assert!(start.elapsed() < SOON, "pictures stay at {small_px} rows");
    }
    visit.settled().await;
    visit.end(Expected::NoError).await;
}

/// 200 kbit/s.
const SLOW_BYTES_PER_S: f64 = 25e3;
/// The bytes of a still that takes the slow link for seconds, and its part that is there when a drag begins.
const STILL_BYTES: u64 = 100_000;
const BEGUN_BYTES: u64 = 30_000;
/// Two parts of the still, the picture, and the round trip; as much again for a busy machine.
const FIRST_MOVE: Duration = Duration::from_secs(3);

#[tokio::test(flavor = "multi_thread")]
async fn a_still_on_a_slow_link_ends_for_a_drag() {
    let (bench, _) = gateway().await;
    let proxy = Proxy::to(&bench.gateway.address, 1);
    let visit = Visit::alone(&proxy.address, View { size_px: [1600, 1000], ..View::default() }).await;
    visit.settled().await;
    let slow = Way::Link { bytes_per_s: SLOW_BYTES_PER_S, delay: DELAY };
    proxy.set(slow, slow);
    visit.browser.drag(&Drag::along(to_and_fro([200.0, 200.0], 10))).await.unwrap();
    let begun = format!(
        "(({{ header, left }}) => header.still && left > 0 && header.bytes - left > {BEGUN_BYTES})(myriorama.link.picture)"
    );
    visit.until(&begun).await;
    let bytes: u64 = visit.browser.value("myriorama.link.picture.header.bytes").await.unwrap();
    assert!(bytes > STILL_BYTES, "a still of {bytes} bytes");
    let start = Instant::now();
    let before = visit.picture_count().await;
    visit.browser.drag(&Drag::along(to_and_fro([200.0, 200.0], 10))).await.unwrap();
    visit.until(&format!("myriorama.statistics.pictures.length > {before}")).await;
    assert!(start.elapsed() < FIRST_MOVE, "{:?}", start.elapsed());
    assert!(!visit.pictures().await[before].header.still, "the still went on");
    proxy.heal();
    visit.settled().await;
    visit.end(Expected::NoError).await;
}
