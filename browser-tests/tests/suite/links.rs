//! A slow link makes pictures smaller, not older, and a freed one makes them larger again.

use std::time::{Duration, Instant};

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
    let (start, before) = (Instant::now(), visit.picture_count().await);
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
    pictures.last().unwrap().header.size_px[1]
}

#[tokio::test(flavor = "multi_thread")]
async fn a_slow_link_has_small_pictures_and_a_freed_one_larger_ones() {
    let (bench, _) = gateway().await;
    let proxy = Proxy::to(&bench.gateway.address, 1);
    let slow = Way::Link { bytes_per_s: BYTES_PER_S, delay: DELAY };
    proxy.set(slow, slow);
    let visit = Visit::to(&proxy.address).await;
    visit.settled().await;
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
