//! Measured points are those of the scene, with their distance and the cameras that saw them.

use browser::input::Place;
use browser::{Key, View};
use browser_tests::visit::{Expected, Visit};
use cluster_tests::scalar_engine::ball_center;
use glam::DVec3;
use serde::Deserialize;

use crate::scene::gateway_of;
use crate::surface::{AT_SAMPLES, SKY, TOLERANCE_M, camera_of, dense_request, on_ball, on_floor, place_of};

/// Wide enough for panels beside the ball.
const WIDE: View = View { size_px: [800, 480], scale: 1.0, is_touch: false };
/// A place of the floor.
const FLOOR: Place = [300.0, 330.0];
/// The middle of the window, on the ball.
const MIDDLE: Place = [400.0, 240.0];
/// Figures have five digits.
const ROUNDING: f64 = 1e-4;

#[derive(Debug, Deserialize)]
struct Measured {
    at: [u32; 2],
    source: String,
    cameras: Vec<usize>,
    point: [f64; 3],
}

impl Measured {
    fn point(&self) -> DVec3 {
        DVec3::from_array(self.point)
    }

    /// What the page says of the cameras.
    fn seen_by(&self) -> String {
        assert!(self.source == "cameras" && !self.cameras.is_empty(), "{self:?}");
        let numbers: Vec<String> = self.cameras.iter().map(ToString::to_string).collect();
        let plural = if numbers.len() > 1 { "s" } else { "" };
        format!("seen by camera{plural} {}", numbers.join(", "))
    }
}

/// Waits until this number of points is measured, and returns them.
async fn measured(visit: &Visit, count: usize) -> Vec<Measured> {
    visit.until(&format!("document.querySelectorAll('#points dd').length === {count}")).await;
    visit.browser.value("myriorama.measure.results").await.unwrap()
}

fn assert_near(seen: &Measured, expected: DVec3) {
    assert!(seen.point().distance(expected) < TOLERANCE_M, "{seen:?} instead of {expected}");
}

#[tokio::test(flavor = "multi_thread")]
async fn measured_points_and_their_distance_are_those_of_the_scene() {
    let (_bench, url) = gateway_of(dense_request()).await;
    let visit = Visit::in_view(&format!("{url}{AT_SAMPLES}"), WIDE).await;
    let camera = camera_of(&visit.settled().await);
    visit.press('m').await;
    let ball = place_of(&camera, ball_center(0.0));
    visit.click_picture(ball, 1).await;
    let first = measured(&visit, 1).await.remove(0);
    assert_near(&first, on_ball(&camera, ball));
    assert_eq!(first.at.map(f64::from), ball.map(f64::floor));
    assert!(visit.text("#points").await.contains(&first.seen_by()));
    visit.click_picture(FLOOR, 1).await;
    let both = measured(&visit, 2).await;
    assert_near(&both[1], on_floor(&camera, FLOOR));
    let distance: f64 = visit.text("#distance-value").await.parse().unwrap();
    assert!((distance - both[0].point().distance(both[1].point())).abs() < ROUNDING, "{distance}: {both:?}");
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn enter_measures_the_middle_the_sky_has_no_point_and_escape_leaves() {
    let (_bench, url) = gateway_of(dense_request()).await;
    let visit = Visit::in_view(&format!("{url}{AT_SAMPLES}"), WIDE).await;
    let camera = camera_of(&visit.settled().await);
    visit.browser.click("#measure").await.unwrap();
    visit.press(Key::Enter).await;
    let middle = measured(&visit, 1).await.remove(0);
    assert_eq!(middle.at.map(f64::from), MIDDLE);
    assert_near(&middle, on_ball(&camera, MIDDLE));
    visit.click_picture(SKY, 1).await;
    visit.until("document.getElementById('measure-state').textContent === 'Nothing there.'").await;
    assert_eq!(measured(&visit, 1).await[0].point, middle.point, "the point before stays");
    let marks = async || visit.browser.canvas("#marks").await.unwrap().alpha;
    assert!(marks().await.iter().any(|alpha| *alpha > 0));
    visit.press(Key::Escape).await;
    assert!(!visit.is_shown("#measured").await);
    visit.until("!myriorama.measure.isOn && document.getElementById('measure').ariaPressed === 'false'").await;
    visit.browser.run::<()>("await new Promise(requestAnimationFrame)", Vec::new()).await.unwrap();
    assert!(marks().await.iter().all(|alpha| *alpha == 0), "marks stay");
    let before = visit.state().await;
    visit.click_picture(MIDDLE, 1).await;
    assert_eq!(visit.state().await, before, "a click is no more than a click");
    assert_eq!(visit.browser.value::<usize>("myriorama.measure.results.length").await.unwrap(), 0);
    visit.end(Expected::NoError).await;
}
