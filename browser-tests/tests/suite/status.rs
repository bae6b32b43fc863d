//! The page of the cluster's status.

use std::collections::BTreeMap;

use browser::View;
use browser_tests::visit::{Expected, SOON, Visit};
use cluster_tests::cluster::connected;

use crate::scene::gateway;

const WITH_PLAN: &str = "document.querySelector('#workloads section h3')";
const NODES: &str = "[...document.querySelectorAll('#nodes tbody tr')].map((row) =>
    [...row.children].map((cell) => cell.textContent))";
/// Nodes that serve state the share of a second that they work.
const ALL_BUSY_KNOWN: &str = "[...document.querySelectorAll('#nodes tbody td:last-child')].every((cell) =>
    cell.textContent.endsWith(' %'))";
const FIGURES: &str = "Object.fromEntries([...document.querySelectorAll('#workloads dl div')].map((figure) =>
    [figure.firstChild.textContent, figure.lastChild.textContent]))";
const IS_NOW: &str = "document.getElementById('updated').textContent === 'Now, every second.'";
/// Times that the page is compared with the cluster, a fifth of a second apart.
const ATTEMPTS: usize = 50;

/// The page of the status, after a visit to the scene: its workload stays for a while.
async fn status_of(url: &str) -> Visit {
    let visit = Visit::in_view(url, View { size_px: [1000, 800], ..View::default() }).await;
    visit.rested().await;
    visit.browser.click("a[href=status]").await.unwrap();
    visit.until(WITH_PLAN).await;
    visit
}

#[tokio::test(flavor = "multi_thread")]
async fn the_status_names_the_nodes_the_policy_and_the_samplers() {
    let (bench, url) = gateway().await;
    let visit = status_of(&url).await;
    let nodes: Vec<[String; 4]> = visit.browser.value(NODES).await.unwrap();
    let names: Vec<&str> = nodes.iter().map(|[name, ..]| name.as_str()).collect();
    assert_eq!(names, ["n0", "n1", "n2"]);
    assert!(nodes.iter().all(|[_, device, ..]| device == "scalar loops"), "{nodes:?}");
    visit.until(ALL_BUSY_KNOWN).await;
    // The page shows the status of a moment ago, and a new plan may have come since.
    let mut differing = String::new();
    for _ in 0..ATTEMPTS {
        let status = bench.cluster.client.status().await.unwrap();
        let plan = &status.workloads[0].plan.as_ref().unwrap().assignment;
        let shown: BTreeMap<String, String> = visit.browser.value(FIGURES).await.unwrap();
        let nodes: Vec<[String; 4]> = visit.browser.value(NODES).await.unwrap();
        let policy = (plan.policy.to_string(), plan.samplers.len().to_string());
        let is_shown = |name: &str| nodes.iter().any(|[node, _, roles, _]| node == name && roles.contains("sampler"));
        let all_shown = plan.samplers.iter().all(|share| is_shown(&share.node_name));
        if all_shown && (&shown["Policy"], &shown["K, samplers"]) == (&policy.0, &policy.1) {
            differing.clear();
            break;
        }
        differing = format!("{nodes:?} {shown:?}, but {policy:?} {:?}", plan.samplers);
        tokio::time::sleep(std::time::Duration::from_millis(200)).await;
    }
    assert_eq!(differing, "");
    visit.end(Expected::NoError).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_status_says_that_the_coordinator_is_away_and_goes_on_with_the_next() {
    let (mut bench, url) = gateway().await;
    let visit = status_of(&url).await;
    visit.until(IS_NOW).await;
    bench.cluster.kill_coordinator();
    visit.until(&format!("!({IS_NOW})")).await;
    let said = visit.text("#updated").await;
    assert!(said.contains("coordinator"), "{said}");
    bench.cluster.restart_coordinator();
    let client = connected(&bench.cluster.coordinator.address).await;
    client.wait_for_nodes(3, SOON).await.unwrap();
    visit.until(&format!("{IS_NOW} && document.querySelectorAll('#nodes tbody tr').length === 3")).await;
    visit.end(Expected::LostConnections).await;
}
