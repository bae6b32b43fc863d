//! Links with a pose, and pages under a path.

use browser_tests::prefix::PrefixServer;
use browser_tests::visit::{Expected, Visit};
use glam::DVec3;

use crate::scene::gateway;

#[tokio::test(flavor = "multi_thread")]
async fn a_link_opens_at_its_pose() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&format!("{url}#c=1,1.5,2.5;-0.2,0.5,0.1;40")).await;
    visit.settled().await;
    let state = visit.state().await;
    assert!((state.eye() - DVec3::new(1.0, 1.5, 2.5)).length() < 1e-9, "{state:?}");
    assert_eq!((state.target, state.fov_y), ([-0.2, 0.5, 0.1], 40.0));
    visit.until("location.hash.startsWith('#c=1,1.5,2.5;')").await;
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_works_under_a_path_of_another_server() {
    let (bench, _) = gateway().await;
    let server = PrefixServer::start(bench.authority(), "/any/path").await;
    let visit = Visit::to(&server.url).await;
    let still = visit.settled().await;
    let canvas = visit.canvas().await;
    assert!(canvas.srgb8 == bench.reference(&still.header.camera.into(), canvas.size_px).await);
    visit.press('d').await;
    visit.until("!document.getElementById('overlay').hidden").await;
    visit.end(Expected::NoError).await;
}
