//! Windows of other shapes and finer screens show the same scene undistorted.

use browser::View;
use browser::inspect::Pixels;
use browser_tests::visit::{Expected, Picture, Visit};
use cluster::Refinement;
use cluster_tests::gateway_bench::PageCamera;
use cluster_tests::scalar_engine::{BALL_RADIUS_M, FLOOR_LINEAR, SKY_LINEAR, ball_center, ball_linear, srgb8};
use glam::{UVec2, Vec2, Vec3};

use crate::scene::{SAMPLE_PX, gateway};

/// The least and the greatest place of something in a picture.
type Extents = [Vec2; 2];

fn extents(places: impl Iterator<Item = Vec2>) -> Extents {
    places.fold([Vec2::INFINITY, Vec2::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
}

/// Where the ball is on the screen: pixels whose colour is nearest to its own.
fn seen(canvas: &Pixels) -> Extents {
    let [ball, others @ ..] = [ball_linear(0.0, Refinement::default()), FLOOR_LINEAR, SKY_LINEAR].map(srgb8);
    let distance = |pixel: &[u8], color: [u8; 3]| pixel.iter().zip(color).map(|(a, b)| a.abs_diff(b)).max();
    let is_ball = |pixel: &[u8]| others.iter().all(|&other| distance(pixel, ball) < distance(pixel, other));
    let width = canvas.size_px[0] as usize;
    let pixels = canvas.srgb8.chunks_exact(3).enumerate().filter(|(_, pixel)| is_ball(pixel));
    extents(pixels.map(|(at, _)| Vec2::new((at % width) as f32 + 0.5, (at / width) as f32 + 0.5)))
}

/// Where the ball is in a picture of a camera, by points all over it.
fn expected(camera: &PageCamera, size_px: [u32; 2]) -> Extents {
    let camera = camera.of_size(UVec2::from_array(size_px));
    let point = |turn: f32, height: f32| {
        let (sine, cosine) = turn.to_radians().sin_cos();
        let around = (1.0 - height * height).sqrt();
        ball_center(0.0) + BALL_RADIUS_M * Vec3::new(around * cosine, height, around * sine)
    };
    let points = (0..360).flat_map(|turn| (-100..=100).map(move |height| point(turn as f32, height as f32 / 100.0)));
    extents(points.filter_map(|point| camera.project(point)).map(|at| at.pixel))
}

/// The ball is where it belongs, to two samples.
fn assert_round(still: &Picture, canvas: &Pixels) {
    assert_eq!(still.header.size_px, canvas.size_px);
    let seen = seen(canvas);
    let expected = expected(&still.header.camera.into(), canvas.size_px);
    let sample_px = canvas.size_px[1] as f32 / SAMPLE_PX.y as f32;
    let is_close = |a: Vec2, b: Vec2| (a - b).abs().max_element() <= 2.0 * sample_px;
    assert!(is_close(seen[0], expected[0]) && is_close(seen[1], expected[1]), "{seen:?} instead of {expected:?}");
    let stretched = expected.map(|at| at * Vec2::new(1.1, 1.0));
    assert!(!is_close(seen[1], stretched[1]), "a stretched ball is seen");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_ball_stays_round_in_windows_of_all_shapes() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    let camera = visit.settled().await.header.camera;
    for size_px in [[640, 480], [900, 400], [420, 560]] {
        visit.browser.set_view(View { size_px, ..View::default() }).await.unwrap();
        visit.until(&format!("myriorama.screen.size.join() === '{},{}'", size_px[0], size_px[1])).await;
        let (still, canvas) = visit.settled_canvas().await;
        assert_eq!(still.header.camera, camera, "the camera stays");
        assert_round(&still, &canvas);
    }
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_screen_with_finer_pixels_has_a_finer_picture() {
    let (bench, url) = gateway().await;
    let view = View { size_px: [320, 240], scale: 2.0, ..View::default() };
    let visit = Visit::in_view(&url, view).await;
    let (still, canvas) = visit.settled_canvas().await;
    assert_eq!(canvas.size_px, [640, 480]);
    assert_round(&still, &canvas);
    assert!(canvas.srgb8 == bench.reference(&still.header.camera.into(), canvas.size_px).await);
    visit.end(Expected::NoError).await;
}
