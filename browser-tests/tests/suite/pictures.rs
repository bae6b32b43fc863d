//! Pictures are those of the Rust client, and those of a drag follow it.

use std::time::{Duration, Instant};

use browser::input::{Drag, Place};
use browser_tests::visit::{Expected, Picture, SOON, Visit};

use crate::scene::gateway;

/// The greatest difference between a picture's age and its parts.
const AGE_ERROR_MS: f64 = 2.0;
const DRAG_PICTURES: usize = 100;

/// A path to and fro, of an event for each pixel.
pub fn to_and_fro(from: Place, columns: u32) -> Vec<Place> {
    let there = 0..=columns;
    let back = (0..columns).rev();
    there.chain(back).map(|step| [from[0] + f64::from(step), from[1] + f64::from(step) * 0.25]).collect()
}

/// A picture whose columns are one to the right.
fn shifted(srgb8: &[u8], width: usize) -> Vec<u8> {
    let row = |row: &[u8]| [&row[..3], &row[..row.len() - 3]].concat();
    srgb8.chunks_exact(3 * width).flat_map(row).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rested_page_shows_the_picture_of_the_rust_client_to_the_bit() {
    let (bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    let (still, canvas) = visit.settled_canvas().await;
    assert_eq!((canvas.size_px, still.header.size_px), ([640, 480], [640, 480]));
    let reference = bench.reference(&still.header.camera.into(), canvas.size_px).await;
    assert!(canvas.srgb8 == reference, "the canvas differs from the client's picture");
    assert!(canvas.srgb8 != shifted(&reference, 640), "a shifted picture is seen");
    visit.until("document.getElementById('badge').textContent === 'still'").await;
    visit.end(Expected::NoError).await;
}

/// Drags until the page has shown this many pictures in motion.
async fn drag_for(visit: &Visit, pictures: usize) {
    let start = Instant::now();
    let before = visit.picture_count().await;
    while visit.picture_count().await < before + pictures {
        assert!(start.elapsed() < 2 * SOON, "{} pictures", visit.picture_count().await - before);
        visit.browser.drag(&Drag::along(to_and_fro([200.0, 200.0], 40))).await.unwrap();
    }
}

fn assert_parts_add_up(picture: &Picture) {
    let sum: f64 = picture.parts.values().sum();
    assert!((sum - picture.age).abs() <= AGE_ERROR_MS, "{sum} ms of {picture:?}");
    assert!(picture.parts.values().all(|part| *part > -AGE_ERROR_MS), "{picture:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_pictures_of_a_drag_rise_and_end_with_its_last_pose() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    visit.settled().await;
    drag_for(&visit, DRAG_PICTURES).await;
    visit.browser.drag(&Drag::along(vec![[300.0, 200.0], [340.0, 220.0]])).await.unwrap();
    let last = visit.settled().await;
    let pictures = visit.pictures().await;
    let first_shown: Vec<u64> = pictures.iter().filter(|p| !p.is_repeat).map(|p| p.header.number).collect();
    assert!(first_shown.is_sorted_by(|a, b| a < b), "{first_shown:?}");
    assert!(pictures.iter().filter(|picture| !picture.header.still).count() >= DRAG_PICTURES / 2);
    pictures.iter().for_each(assert_parts_add_up);
    assert_eq!(last.header.number, visit.browser.value::<u64>("myriorama.number()").await.unwrap());
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn two_browsers_show_two_cameras() {
    let (bench, url) = gateway().await;
    let [one, other] = Visit::two(&url).await;
    let right = Drag::along(vec![[300.0, 240.0], [320.0, 240.0]]);
    let down = Drag { interval: Duration::ZERO, ..Drag::along(vec![[300.0, 240.0], [300.0, 270.0]]) };
    tokio::join!(one.settled(), other.settled());
    let dragged = tokio::join!(one.browser.drag(&right), other.browser.drag(&down));
    assert!(dragged.0.is_ok() && dragged.1.is_ok(), "{dragged:?}");
    let mut seen = Vec::new();
    for visit in [one, other] {
        let (still, canvas) = visit.settled_canvas().await;
        let reference = bench.reference(&still.header.camera.into(), canvas.size_px).await;
        let others = canvas.srgb8.iter().zip(&reference).filter(|(shown, expected)| shown != expected).count();
        assert!(others == 0, "{others} of {} values differ: {still:?}", reference.len());
        seen.push(canvas);
        visit.end(Expected::NoError).await;
    }
    assert!(seen[0] != seen[1], "both show the same");
}
