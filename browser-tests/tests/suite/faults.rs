//! Servers that stop abruptly: the page says so, and goes on from where it was.

use browser::input::Drag;
use browser_tests::visit::{Expected, Picture, SOON, Visit};
use cluster::SessionRequest;
use cluster_tests::gateway_bench;
use cluster_tests::processes::{Processes, number_of};
use glam::UVec2;
use rustix::process::Signal;

use crate::scene::{gateway, slow_request};

const BANNER: &str = "!document.getElementById('banner').hidden";

/// Moves the camera a little, and waits for its exact picture.
async fn walk(visit: &Visit) -> Picture {
    let before = visit.state().await;
    visit.browser.drag(&Drag::along(vec![[320.0, 240.0], [330.0, 245.0]])).await.unwrap();
    let still = visit.settled().await;
    let expected = before.dragged([320.0, 240.0], [330.0, 245.0], 480.0);
    assert!(visit.state().await.difference(&expected) < 1e-9, "the camera goes on from where it was");
    visit.until(&format!("!({BANNER})")).await;
    still
}

#[tokio::test(flavor = "multi_thread")]
async fn pictures_go_on_without_a_compositor_that_was_killed() {
    let (mut bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    let killed = visit.settled().await.header.compositor;
    bench.cluster.nodes[number_of(&killed)].kill();
    assert_ne!(walk(&visit).await.header.compositor, killed);
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_comes_back_to_its_pose_when_its_gateway_does() {
    let (mut bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    visit.settled().await;
    let before = walk(&visit).await;
    let shown = visit.canvas().await;
    let state = visit.state().await;
    bench.kill_gateway();
    visit.until(BANNER).await;
    assert!(visit.canvas().await == shown, "the last picture stays");
    let count = visit.picture_count().await;
    bench.restart_gateway();
    visit.until(&format!("myriorama.statistics.pictures.length > {count}")).await;
    let after = visit.settled().await;
    assert_eq!((after.header.camera, visit.state().await), (before.header.camera, state));
    assert!(visit.canvas().await == shown);
    walk(&visit).await;
    visit.end(Expected::LostConnections).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn pictures_go_on_without_a_coordinator_and_with_the_next() {
    let (mut bench, url) = gateway().await;
    let visit = Visit::to(&url).await;
    visit.settled().await;
    bench.cluster.kill_coordinator();
    walk(&visit).await;
    bench.cluster.restart_coordinator();
    let client = cluster_tests::cluster::connected(&bench.cluster.coordinator.address).await;
    client.wait_for_nodes(3, SOON).await.unwrap();
    walk(&visit).await;
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn pictures_go_on_though_processes_are_stopped_and_killed() {
    let mut processes = Processes::start(env!("CARGO_BIN_EXE_browser_cluster"), 3).await;
    // The memory of these nodes holds small sets.
    let request = SessionRequest { sample_size_px: Some(UVec2::new(64, 48)), ..slow_request() };
    let gateway = gateway_bench::gateway_of(&processes.coordinator.address, request);
    let visit = Visit::to(&format!("{}/", gateway.address)).await;
    let stopped = visit.settled().await.header.compositor;
    processes.nodes[number_of(&stopped)].signal(Signal::STOP);
    let next = walk(&visit).await.header.compositor;
    assert_ne!(next, stopped);
    processes.nodes[number_of(&next)].kill();
    walk(&visit).await;
    processes.coordinator.kill();
    walk(&visit).await;
    processes.nodes[number_of(&stopped)].signal(Signal::CONT);
    visit.end(Expected::NoError).await;
}
