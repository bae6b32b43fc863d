//! Links with a pose, and pages under a path.

use browser_tests::prefix::PrefixServer;
use browser_tests::visit::{Expected, Visit};
use glam::DVec3;
use serde_json::json;

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

/// Says that the page is of another version than its server, before its modules run. It counts how often the page is loaded.
const OF_ANOTHER_VERSION: &str = "
    sessionStorage.setItem('loads', 1 + Number(sessionStorage.getItem('loads')));
    document.addEventListener('readystatechange', () => {
        document.querySelector('meta[name=version]').content = '0.0.0';
    });";

#[tokio::test(flavor = "multi_thread")]
async fn a_page_of_another_version_loads_itself_again_once() {
    let (_bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    visit.rested().await;
    let script = json!({ "source": OF_ANOTHER_VERSION });
    visit.browser.devtools("Page.addScriptToEvaluateOnNewDocument", script).await.unwrap();
    visit.browser.open(&url).await.unwrap();
    visit.until("Number(sessionStorage.getItem('loads')) === 2").await;
    visit.rested().await;
    assert_eq!(visit.browser.value::<String>("sessionStorage.getItem('loads')").await.unwrap(), "2");
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
