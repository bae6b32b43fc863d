//! Overlays of provenance and depth: shown at rest with their legends, gone in motion, one at a time.

use std::collections::BTreeSet;

use browser::View;
use browser::input::Drag;
use browser_tests::visit::{Expected, Visit};

use crate::scene::gateway;

/// Wide enough for all buttons.
const WIDE: View = View { size_px: [900, 480], scale: 1.0, is_touch: false };
const SHOWN: &str =
    "!document.getElementById('overlay').hidden && document.getElementById('entries').children.length > 0";
/// Names and colours of the legend.
const ENTRIES: &str = "[...document.querySelectorAll('#entries li')].map((entry) =>
    [entry.textContent, getComputedStyle(entry.firstChild).backgroundColor])";
/// Keeps, after each move of the pointer, whether the overlay was hidden.
const WATCH_MOVES: &str = "window.hidden_in_motion = [];
    const overlay = document.getElementById('overlay');
    document.getElementById('picture').addEventListener('pointermove', () => hidden_in_motion.push(overlay.hidden))";
/// The ball fills the middle, and the floor in view is behind its front, which is one unit away.
const BEFORE_THE_BALL: &str = "#c=-0.4,0.6,1.5;-0.4,0.6,0;40";
const FRONT_DEPTH: f64 = 1.0;
/// Two samples on the ball's front.
const DEPTH_ERROR: f64 = 0.01;

/// The names of a legend, whose colours must be those of the overlay.
async fn legend(visit: &Visit) -> Vec<String> {
    let entries: Vec<(String, String)> = visit.browser.value(ENTRIES).await.unwrap();
    let overlay = visit.browser.canvas("#overlay").await.unwrap();
    let colors = overlay.srgb8.as_chunks::<3>().0.iter().map(|[r, g, b]| format!("rgb({r}, {g}, {b})"));
    let seen = BTreeSet::from_iter(colors);
    let named = entries.iter().map(|(_, color)| color.clone()).collect();
    assert!(seen.is_superset(&named), "{named:?} in {seen:?}");
    entries.into_iter().map(|(name, _)| name).collect()
}

async fn pressed(visit: &Visit) -> Vec<String> {
    let pressed = "[...document.querySelectorAll('[aria-label=Inspection] [aria-pressed=true]')].map((b) => b.id)";
    visit.browser.value(pressed).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn provenance_names_all_its_colours_and_is_hidden_in_motion() {
    let (_bench, url) = gateway().await;
    let visit = Visit::in_view(&url, WIDE).await;
    visit.rested().await;
    visit.press('p').await;
    visit.until(SHOWN).await;
    assert_eq!(legend(&visit).await, ["camera 0", "camera 1", "camera 2", "background"]);
    let overlay = visit.browser.canvas("#overlay").await.unwrap();
    let colors = BTreeSet::from_iter(overlay.srgb8.as_chunks::<3>().0);
    assert_eq!(colors.len(), 4, "the legend names all");
    visit.browser.run::<()>(WATCH_MOVES, Vec::new()).await.unwrap();
    visit.browser.drag(&Drag::along(vec![[300.0, 240.0], [320.0, 240.0], [340.0, 240.0]])).await.unwrap();
    let hidden: Vec<bool> = visit.browser.value("hidden_in_motion").await.unwrap();
    assert!(!hidden.is_empty() && hidden.iter().all(|hidden| *hidden), "{hidden:?}");
    visit.rested().await;
    visit.until(SHOWN).await;
    assert_ne!(visit.browser.canvas("#overlay").await.unwrap(), overlay, "it is of the new camera");
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_overlay_is_shown_at_a_time_by_keys_and_buttons() {
    let (_bench, url) = gateway().await;
    let visit = Visit::in_view(&url, WIDE).await;
    visit.rested().await;
    for (kind, name) in [("provenance", "Provenance"), ("depth", "Depth"), ("provenance", "Provenance")] {
        visit.browser.click(&format!("#{kind}")).await.unwrap();
        visit.until(SHOWN).await;
        assert_eq!((pressed(&visit).await, visit.text("#legend-name").await), (vec![kind.to_owned()], name.to_owned()));
    }
    visit.press('d').await;
    visit.until(SHOWN).await;
    assert_eq!(pressed(&visit).await, ["depth"]);
    visit.press('d').await;
    assert!(pressed(&visit).await.is_empty());
    assert!(!visit.is_shown("#overlay").await && !visit.is_shown("#legend").await);
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_legend_of_depth_begins_at_the_balls_front() {
    let (_bench, url) = gateway().await;
    let visit = Visit::in_view(&format!("{url}{BEFORE_THE_BALL}"), WIDE).await;
    visit.rested().await;
    visit.press('d').await;
    visit.until(SHOWN).await;
    let depths: Vec<f64> = legend(&visit).await.iter().map(|depth| depth.parse().unwrap()).collect();
    assert!((depths[0] - FRONT_DEPTH).abs() < DEPTH_ERROR, "{depths:?}");
    assert!(depths.len() > 2 && depths.is_sorted_by(|near, far| near < far), "{depths:?}");
    visit.end(Expected::NoError).await;
}
