//! A double click makes the surface under it the pivot.

use browser_tests::visit::{Expected, Visit};
use browser_tests::walk::State;
use cluster_tests::scalar_engine::ball_center;

use crate::scene::gateway_of;
use crate::surface::{AT_SAMPLES, SKY, TOLERANCE_M, camera_of, dense_request, on_ball, place_of};

#[tokio::test(flavor = "multi_thread")]
async fn a_double_click_sets_the_pivot_on_the_surface_and_turns_nothing() {
    let (_bench, url) = gateway_of(dense_request()).await;
    let visit = Visit::to(&format!("{url}{AT_SAMPLES}")).await;
    let camera = camera_of(&visit.settled().await);
    let before = visit.state().await;
    let place = place_of(&camera, ball_center(0.0));
    visit.click_picture(place, 2).await;
    visit.until(&format!("myriorama.state().target[0] !== {}", before.target[0])).await;
    visit.rested().await;
    let after = visit.state().await;
    let point = on_ball(&camera, place);
    assert!(after.pivot().distance(point) < TOLERANCE_M, "{after:?} instead of {point}");
    let distance = (after.pivot() - before.eye()).dot(before.forward());
    assert!((after.distance - distance).abs() < 1e-9, "it comes no closer");
    assert_eq!(State { target: before.target, distance: before.distance, ..after }, before);
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_double_click_on_the_sky_changes_nothing() {
    let (_bench, url) = gateway_of(dense_request()).await;
    let visit = Visit::to(&format!("{url}{AT_SAMPLES}")).await;
    visit.rested().await;
    let before = visit.state().await;
    visit.click_picture(SKY, 2).await;
    visit.until("document.getElementById('toast').textContent === 'Nothing there.'").await;
    assert_eq!(visit.state().await, before);
    visit.end(Expected::NoError).await;
}
