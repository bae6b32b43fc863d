//! Stills whose light is refined in steps, and then their samples a pixel.

use browser_tests::visit::{Expected, Visit};
use cluster::{PolicyChoice, Refinement, SessionRequest, Timeline};
use cluster_tests::scalar_engine::{ball_linear, srgb8};
use serde_json::json;

use crate::scene::{gateway_of, slow_request};

const STEPS: u32 = 3;
/// Keeps each text of the badge, with the step of the picture below it.
const WATCH_BADGE: &str = "addEventListener('DOMContentLoaded', () => {
    window.badges = [];
    const badge = document.getElementById('badge');
    const note = () => badges.push([badge.textContent, myriorama.statistics.pictures.at(-1)?.header.light_step ?? 0]);
    new MutationObserver(note).observe(badge, { childList: true });
})";

#[tokio::test(flavor = "multi_thread")]
async fn a_still_from_samples_names_its_light_and_samples_and_is_never_exact() {
    let timeline = Timeline { start_s: 0.0, step_s: 0.0, set_count: STEPS };
    let (_bench, url) = gateway_of(SessionRequest { refinement_steps: STEPS, timeline, ..slow_request() }).await;
    let visit = Visit::to("about:blank").await;
    visit.browser.devtools("Page.addScriptToEvaluateOnNewDocument", json!({ "source": WATCH_BADGE })).await.unwrap();
    visit.browser.open(&url).await.unwrap();
    visit.settled().await;
    visit.until("document.getElementById('badge').textContent === 'still'").await;
    let pictures = visit.pictures().await;
    let mut steps: Vec<u32> = pictures.iter().filter(|p| p.header.still).map(|p| p.header.light_step).collect();
    steps.dedup();
    // A machine that is busy may have the second set before the visitor rests.
    assert!(steps == [1, 2, 3] || steps == [2, 3], "{steps:?}");
    let mut badges: Vec<(String, u32)> = visit.browser.value("badges").await.unwrap();
    // Without a number, it is the last picture in motion, which rests.
    badges.retain(|(text, _)| !["moving", "waiting", "still"].contains(&text.as_str()));
    let expected = [
        ("still (light 1 of 3)", 1),
        ("still (light 2 of 3)", 2),
        ("still (1 of 16 samples)", 3),
        ("still (4 of 16 samples)", 3),
    ];
    let expected = expected.iter().filter(|(_, step)| steps.contains(step));
    assert_eq!(badges, expected.map(|&(text, step)| (text.to_owned(), step)).collect::<Vec<_>>());
    let last = ball_linear(0.0, Refinement { step: STEPS - 1, steps: STEPS });
    assert!(visit.canvas().await.srgb8.as_chunks::<3>().0.contains(&srgb8(last)), "the ball in its last light");
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_still_that_is_drawn_directly_is_exact() {
    let (_bench, url) = gateway_of(SessionRequest { policy: PolicyChoice::Direct, ..slow_request() }).await;
    let visit = Visit::to(&url).await;
    visit.settled().await;
    visit.until("document.getElementById('badge').textContent === 'exact'").await;
    visit.end(Expected::NoError).await;
}
