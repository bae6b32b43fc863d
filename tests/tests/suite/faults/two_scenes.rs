//! Faults of one scene's nodes, while another scene is shown beside it.

use std::time::{Duration, Instant};

use client::Session;
use cluster::SessionRequest;
use cluster_tests::cluster::OTHER_SCENE;
use cluster_tests::processes::{Processes, number_of};
use cluster_tests::watcher::{Watcher, watched_request};

use super::{CLOSED, PROGRAM, compositor_of, finish, has_role, sampler_of};

/// The longest time without frames of the other scene: less than a fault takes to heal.
const UNDISTURBED: Duration = Duration::from_secs(2);

/// The nodes of a plan, by name.
fn nodes_of(session: &Session) -> Vec<String> {
    let plan = session.plan().assignment;
    let samplers = plan.samplers.into_iter().map(|share| share.node_name);
    let mut names: Vec<String> = samplers.chain(plan.compositors.into_iter().map(|share| share.node_name)).collect();
    names.sort();
    names.dedup();
    names
}

async fn killed(what: &str, victim: fn(&Session) -> String) {
    let mut cluster = Processes::start(PROGRAM, 4).await;
    let one = Watcher::start(&cluster.client).await;
    let of_other = SessionRequest { scene: Some(OTHER_SCENE.to_owned()), ..watched_request() };
    let other = Watcher::start_with(&cluster.client, of_other).await;
    // Both plans have nodes of their own by then.
    one.healed(Instant::now(), CLOSED, |session| nodes_of(session).len() < 4).await;
    let name = victim(&one.session);
    let before = nodes_of(&other.session);
    let epoch = other.epoch();
    let since = Instant::now();
    assert!(!has_role(&other.session, &name), "{name} serves one scene");
    cluster.nodes[number_of(&name)].kill();
    let wait = one.healed(since, CLOSED, |session| !has_role(session, &name)).await;
    let other_wait = other.healed(since, CLOSED, |_| true).await;
    assert!(other_wait < UNDISTURBED, "{what}: no frames of the other scene for {other_wait:?}");
    let has_moved = nodes_of(&other.session) != before;
    assert!(has_moved || other.epoch() == epoch, "{what}: a plan of the other scene without a reason");
    finish(what, wait, &cluster, &one);
    finish(&format!("{what}, the other scene"), other_wait, &cluster, &other);
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_of_a_scene_go_on_when_a_compositor_of_another_is_killed() {
    killed("compositor of one scene killed", compositor_of).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_of_a_scene_go_on_when_a_sampler_of_another_is_killed() {
    killed("sampler of one scene killed", sampler_of).await;
}
