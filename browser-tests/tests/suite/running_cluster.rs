//! The viewer of a cluster that runs already: `deploy/cluster.sh --test` gives its link.

use browser::input::Drag;
use browser_tests::visit::{Expected, Visit};

/// The link of the viewer.
const LINK: &str = "MYRIORAMA_VIEWER";

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs a cluster that runs: deploy/cluster.sh --test"]
async fn a_visitor_of_a_running_cluster_drags_and_rests() {
    let link = std::env::var(LINK).expect("the link of a viewer in MYRIORAMA_VIEWER");
    let visit = Visit::to(&link).await;
    visit.rested().await;
    let address: String = visit.browser.value("location.href").await.unwrap();
    assert!(!address.contains("token="), "{address}");
    let before = visit.picture_count().await;
    let path = (0..100).map(|step| [200.0 + 2.0 * f64::from(step), 200.0]).collect();
    visit.browser.drag(&Drag::along(path)).await.unwrap();
    visit.rested().await;
    let shown = visit.picture_count().await - before;
    assert!(shown >= 3, "{shown} pictures of a drag");
    println!("{shown} pictures of a drag, then an exact still");
    visit.end(Expected::NoError).await;
}
