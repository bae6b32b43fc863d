//! The sample cameras are drawn where they are.

use browser::input::Place;
use browser::inspect::Pixels;
use browser_tests::visit::{Expected, Visit};
use cluster_tests::cluster::rig;
use depth_image::Camera;

use crate::scene::gateway;
use crate::surface::{camera_of, place_of};

/// Behind the sample cameras.
const BEHIND: &str = "#c=0,1.8,6;0,0.5,0;45";
/// Lines are wider.
const NEAR_PX: f64 = 2.0;
const DRAWN: &str = "(() => {
    const { width, height } = document.getElementById('marks');
    const { data } = document.getElementById('marks').getContext('2d').getImageData(0, 0, width, height);
    return data.some((value) => value > 0);
})()";

fn is_marked(marks: &Pixels, [x, y]: Place) -> bool {
    let width = marks.size_px[0] as usize;
    let is_near = |at: usize| {
        let [column, row] = [at % width, at / width].map(|place| place as f64 + 0.5);
        (column - x).abs() < NEAR_PX && (row - y).abs() < NEAR_PX
    };
    marks.alpha.iter().enumerate().any(|(at, alpha)| *alpha > 0 && is_near(at))
}

#[tokio::test(flavor = "multi_thread")]
async fn frusta_begin_at_the_sample_cameras_while_they_are_on() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&format!("{url}{BEHIND}")).await;
    let camera = camera_of(&visit.settled().await);
    visit.until(&format!("!{DRAWN}")).await;
    visit.press('o').await;
    visit.until(DRAWN).await;
    let marks = visit.browser.canvas("#marks").await.unwrap();
    for sample in rig().iter().map(Camera::reference) {
        let place = place_of(&camera, sample.eye_in_world);
        assert!(is_marked(&marks, place), "no line at {place:?}");
    }
    assert!(!is_marked(&marks, [100.0, 100.0]), "everything is marked");
    visit.press('o').await;
    visit.until(&format!("!{DRAWN}")).await;
    visit.end(Expected::NoError).await;
}
