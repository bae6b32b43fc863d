//! A scene that moves: it plays, stands still, and shows the moment of the slider.

use std::collections::BTreeSet;

use browser_tests::visit::{Expected, Visit};
use cluster::SessionRequest;

use crate::scene::{gateway_of, slow_request};

/// The moments of the pictures so far: the end of their sets' names.
const MOMENTS: &str = "myriorama.statistics.pictures.map((picture) => Number(picture.header.set.split('.')[1]))";

async fn moments(visit: &Visit) -> Vec<u32> {
    visit.browser.value(MOMENTS).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_plays_until_it_is_paused_and_shows_the_moment_of_the_slider() {
    // All moments have sessions of their own, which a slow machine must admit together: small images are quick.
    let (_bench, url) = gateway_of(SessionRequest { sample_size_px: None, ..slow_request() }).await;
    let visit = Visit::to(&url).await;
    visit.rested().await;
    assert_eq!(BTreeSet::from_iter(moments(&visit).await), BTreeSet::from([0]), "it stands still at first");
    visit.press(' ').await;
    visit.until(&format!("new Set({MOMENTS}).size >= 4")).await;
    visit.press(' ').await;
    visit.rested().await;
    let paused: u32 = visit.browser.value("document.getElementById('time').valueAsNumber").await.unwrap();
    assert_eq!(moments(&visit).await.last(), Some(&paused));
    let seek = "const time = document.getElementById('time');
        time.value = arguments[0];
        time.dispatchEvent(new Event('input', { bubbles: true }))";
    for moment in [5, 0] {
        visit.browser.run::<()>(seek, vec![moment.into()]).await.unwrap();
        visit.rested().await;
        assert_eq!(moments(&visit).await.last(), Some(&moment));
    }
    visit.end(Expected::NoError).await;
}
