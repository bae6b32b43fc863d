//! A view beside the same view drawn directly: its figures, its slider, its end.

use std::collections::{BTreeMap, BTreeSet};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use browser::{Key, View};
use browser_tests::visit::{Expected, Visit};
use cluster::Refinement;
use cluster_tests::scalar_engine::{FLOOR_LINEAR, SKY_LINEAR, ball_linear, srgb8};
use codec::{DecodeLimits, FrameCodec, decode_frame};
use glam::UVec2;
use metrics::{flip_map, psnr_db, ssim_map};
use serde::Deserialize;

use crate::scene::gateway;

/// Large enough for the panel.
const LARGE: View = View { size_px: [800, 600], scale: 1.0, is_touch: false };
/// The size of the comparison of that view: its still's own.
const COMPARED_PX: [u32; 2] = LARGE.size_px;
const SHOWN: &str = "document.getElementById('compared').checkVisibility()";
/// The gateway's answer for the camera on the screen.
const ASK: &str = "const { queryOf, requestJson } = await import(new URL('api.js', document.baseURI));
    const view = myriorama.view();
    return requestJson('compare.json', queryOf(view))";
const FIGURES: &str = "Object.fromEntries([...document.querySelectorAll('#measures div')].map((row) =>
    [row.firstChild.textContent, row.lastChild.textContent]))";
const SOURCES: &str = "['view', 'direct', 'flip'].map((name) => document.getElementById(`compare-${name}`).src)";

#[derive(Debug, Deserialize)]
struct Comparison {
    size_px: [u32; 2],
    foreground_psnr_db: f64,
    foreground_flip: f64,
    psnr_db: f64,
    ssim: f64,
    flip: f64,
    view: String,
    direct: String,
    flip_map: String,
}

/// The pixels of a picture in a URL.
fn decoded(url: &str) -> Vec<u8> {
    let png = BASE64_STANDARD.decode(url.strip_prefix("data:image/png;base64,").unwrap()).unwrap();
    decode_frame(FrameCodec::Png, UVec2::from_array(COMPARED_PX), &png, &DecodeLimits::default()).unwrap()
}

/// PSNR, SSIM and FLIP of two pictures.
fn errors(view: &[u8], direct: &[u8]) -> [f64; 3] {
    let [test, reference] =
        [view, direct].map(|srgb8| depth_image::View::from_srgb8(COMPARED_PX.into(), srgb8.to_vec()));
    let psnr_db = psnr_db(&reference, &test, None).unwrap().unwrap();
    let mean = |map: metrics::ScoreMap| map.mean(None).unwrap().unwrap();
    [psnr_db, mean(ssim_map(&reference, &test).unwrap()), mean(flip_map(&reference, &test).unwrap())]
}

/// Opens the comparison.
async fn compare(visit: &Visit) {
    visit.press('c').await;
    visit.until(SHOWN).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_figures_are_those_of_the_two_pictures() {
    let (bench, url) = gateway().await;
    let visit = Visit::in_view(&url, LARGE).await;
    let camera = visit.settled().await.header.camera;
    compare(&visit).await;
    let answer: Comparison = visit.browser.run(ASK, Vec::new()).await.unwrap();
    assert_eq!(answer.size_px, COMPARED_PX);
    let sources: [String; 3] = visit.browser.value(SOURCES).await.unwrap();
    assert!(sources == [answer.view.clone(), answer.direct.clone(), answer.flip_map], "the same pictures");
    let view = decoded(&answer.view);
    let direct = decoded(&answer.direct);
    assert!(view == bench.reference(&camera.into(), COMPARED_PX).await, "the view is a finished still");
    let colors: BTreeSet<_> = direct.as_chunks::<3>().0.iter().copied().collect();
    let surfaces = [ball_linear(0.0, Refinement::default()), FLOOR_LINEAR, SKY_LINEAR].map(srgb8);
    assert!(surfaces.iter().all(|color| colors.contains(color)), "between them are edges");
    let [psnr_db, ssim, flip] = errors(&view, &direct);
    for (seen, expected) in [(answer.psnr_db, psnr_db), (answer.ssim, ssim), (answer.flip, flip)] {
        assert!((seen - expected).abs() < 1e-6, "{seen} instead of {expected}");
    }
    let shown: BTreeMap<String, String> = visit.browser.value(FIGURES).await.unwrap();
    assert_eq!(shown["PSNR"], format!("{psnr_db:.1} dB"));
    // The sky of both pictures is the same.
    assert!(answer.foreground_psnr_db < psnr_db && answer.foreground_flip > flip);
    assert_eq!(shown["Foreground PSNR"], format!("{:.1} dB", answer.foreground_psnr_db));
    assert_eq!(shown["Foreground FLIP"], format!("{:.4}", answer.foreground_flip));
    assert_eq!((&shown["SSIM"], &shown["FLIP"]), (&format!("{ssim:.4}"), &format!("{flip:.4}")));
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn keys_move_the_slider_and_not_the_camera_and_motion_closes_the_panel() {
    let (_bench, url) = gateway().await;
    let visit = Visit::in_view(&url, LARGE).await;
    visit.rested().await;
    compare(&visit).await;
    let before = visit.state().await;
    for (key, percent) in [(Key::Right, 51), (Key::End, 100), (Key::Left, 99), (Key::Home, 0)] {
        visit.browser.press(key).await.unwrap();
        let slider = "[document.activeElement.id, document.getElementById('split').ariaValueText,
            getComputedStyle(document.getElementById('compare-view')).clipPath]";
        let [focused, text, clip]: [String; 3] = visit.browser.value(slider).await.unwrap();
        assert_eq!(
            (focused.as_str(), text),
            ("split", format!("{percent} % from samples, {} % drawn directly", 100 - percent))
        );
        assert!(clip.contains(&format!("{}%", 100 - percent)) || percent == 100, "{clip}");
    }
    assert_eq!(visit.state().await, before);
    visit.press(Key::Left).await;
    assert!(!visit.is_shown("#comparison").await, "another view is on the screen");
    visit.rested().await;
    compare(&visit).await;
    visit.browser.press(Key::Escape).await.unwrap();
    assert!(!visit.is_shown("#comparison").await);
    visit.until("document.activeElement.id === 'picture'").await;
    visit.end(Expected::NoError).await;
}
