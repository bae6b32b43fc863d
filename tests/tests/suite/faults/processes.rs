//! Processes that are killed, stopped, started again and asked to end.

use std::time::{Duration, Instant};

use client::Session;
use cluster_tests::cluster::connected;
use cluster_tests::processes::{Processes, number_of};
use cluster_tests::watcher::Watcher;
use rustix::process::Signal;

use super::{CLOSED, ONE_WITNESS, PROGRAM, SILENT, compositor_of, finish, has_role, sampler_of};

async fn killed(what: &str, victim: fn(&Session) -> String) {
    let mut cluster = Processes::start(PROGRAM, 3).await;
    let watcher = Watcher::start(&cluster.client).await;
    let name = victim(&watcher.session);
    let since = Instant::now();
    cluster.nodes[number_of(&name)].kill();
    let wait = watcher.healed(since, CLOSED, |session| !has_role(session, &name)).await;
    finish(what, wait, &cluster, &watcher);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_killed_sampler_is_replaced() {
    killed("sampler killed", sampler_of).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_killed_compositor_is_replaced() {
    killed("compositor killed", compositor_of).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_go_on_without_a_coordinator_and_a_plan_follows_its_return() {
    let mut cluster = Processes::start(PROGRAM, 3).await;
    let watcher = Watcher::start(&cluster.client).await;
    let epoch = watcher.epoch();
    let since = Instant::now();
    cluster.coordinator.kill();
    tokio::time::sleep(Duration::from_secs(2)).await;
    watcher.calls_after(Instant::now(), 5, Duration::from_secs(1)).await;
    let returned = Instant::now();
    cluster.restart_coordinator();
    let wait = watcher.healed(since, CLOSED, |session| session.plan().assignment.plan_epoch > epoch).await;
    let took = returned.elapsed();
    assert!(took < CLOSED, "{took:?}");
    finish(
        &format!("coordinator killed, a plan {:.2} s after its return", took.as_secs_f64()),
        wait,
        &cluster,
        &watcher,
    );
}

/// Sockets of a stopped process stay open, and nothing answers. Afterwards the process goes on as if nothing had happened.
async fn stopped(what: &str, nodes: usize, victim: fn(&Session) -> String, deadline: Duration) {
    let cluster = Processes::start(PROGRAM, nodes).await;
    let watcher = Watcher::start(&cluster.client).await;
    let name = victim(&watcher.session);
    let epoch = watcher.epoch();
    let since = Instant::now();
    let zombie = &cluster.nodes[number_of(&name)];
    zombie.signal(Signal::STOP);
    let wait = watcher.healed(since, deadline, |session| !has_role(session, &name)).await;
    zombie.signal(Signal::CONT);
    cluster.client.wait_for_nodes(nodes, CLOSED).await.unwrap();
    watcher.calls_after(Instant::now(), 10, CLOSED).await;
    assert!(watcher.epoch() > epoch);
    finish(what, wait, &cluster, &watcher);
}

/// Probes and keepalive take seconds to notice: all at the same time.
#[tokio::test(flavor = "multi_thread")]
async fn stopped_processes_are_replaced_and_fenced_when_they_continue() {
    tokio::join!(
        stopped("sampler stopped", 3, sampler_of, SILENT),
        stopped("the only compositor's sampler stopped", 2, sampler_of, ONE_WITNESS),
        stopped("compositor stopped", 3, compositor_of, SILENT),
        stopped_coordinator(),
    );
}

async fn stopped_coordinator() {
    let cluster = Processes::start(PROGRAM, 3).await;
    let watcher = Watcher::start(&cluster.client).await;
    let since = Instant::now();
    cluster.coordinator.signal(Signal::STOP);
    tokio::time::sleep(Duration::from_secs(12)).await;
    cluster.coordinator.signal(Signal::CONT);
    let client = connected(&cluster.coordinator.address).await;
    client.wait_for_nodes(3, CLOSED).await.unwrap();
    let wait = watcher.healed(since, CLOSED, |_| true).await;
    finish("coordinator stopped for 12 s", wait, &cluster, &watcher);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_is_terminated_under_load_ends_and_no_frame_is_lost() {
    let mut cluster = Processes::start(PROGRAM, 3).await;
    let watcher = Watcher::start(&cluster.client).await;
    for victim in [compositor_of, sampler_of] {
        let name = victim(&watcher.session);
        let since = Instant::now();
        let node = &mut cluster.nodes[number_of(&name)];
        node.signal(Signal::TERM);
        let (status, took) = node.ended(Duration::from_secs(10)).await;
        assert!(status.success(), "{status}");
        let wait = watcher.healed(since, CLOSED, |session| !has_role(session, &name)).await;
        finish(&format!("SIGTERM, ended after {:.2} s", took.as_secs_f64()), wait, &cluster, &watcher);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_node_whose_device_is_lost_is_replaced_and_comes_back() {
    let cluster = Processes::start(PROGRAM, 3).await;
    let watcher = Watcher::start(&cluster.client).await;
    let name = compositor_of(&watcher.session);
    let since = Instant::now();
    cluster.nodes[number_of(&name)].signal(Signal::USR1);
    let wait = watcher.healed(since, CLOSED, |session| !has_role(session, &name)).await;
    cluster.client.wait_for_nodes(3, CLOSED).await.expect("it has opened its device again");
    finish("device of a compositor lost", wait, &cluster, &watcher);
}

/// Samples are kept: the sampler's device is used again only for another workload, and to measure its costs.
#[tokio::test(flavor = "multi_thread")]
async fn a_session_opens_though_a_device_is_lost_meanwhile() {
    let cluster = Processes::start(PROGRAM, 3).await;
    for node in &cluster.nodes[..2] {
        node.signal(Signal::USR1);
    }
    let since = Instant::now();
    let watcher = Watcher::start(&cluster.client).await;
    let wait = watcher.healed(since, CLOSED, |session| has_role(session, "n2")).await;
    cluster.client.wait_for_nodes(3, CLOSED).await.expect("both have opened their devices again");
    finish("devices of two of three nodes lost", wait, &cluster, &watcher);
}
