//! Networks that fail: proxies before every node, between each node and the coordinator, and before the client.

use std::time::{Duration, Instant};

use client::Session;
use cluster::{RenderViews, RequestedView};
use cluster_tests::cluster::{camera, connected};
use cluster_tests::processes::{Processes, number_of};
use cluster_tests::watcher::Watcher;
use codec::FrameCodec;
use depth_image::ViewPlanes;
use glam::UVec2;
use network_proxy::{Proxy, Way};
use tokio_stream::StreamExt as _;
use wire::rpc::{CompositorClient, connect};

use super::{CLOSED, PROGRAM, SILENT, compositor_of, finish, has_role, sampler_of};

/// A cluster whose links can fail.
struct Network {
    cluster: Processes,
    watcher: Watcher,
    /// Links from clients, compositors and the coordinator to each node.
    to_node: Vec<Proxy>,
    /// Links from each node to the coordinator.
    to_coordinator: Vec<Proxy>,
    /// The link from the client to the coordinator.
    of_client: Proxy,
}

impl Network {
    async fn start(nodes: usize) -> Self {
        let mut cluster = Processes::start(PROGRAM, 0).await;
        let mut to_node = Vec::new();
        let mut to_coordinator = Vec::new();
        for number in 0..nodes {
            let front = Proxy::start(number as u64);
            let up = Proxy::to(&cluster.coordinator.address, 100 + number as u64);
            let node = cluster.node_by(&up.address, &format!("n{number}"), &["--advertise", &front.address]);
            front.lead_to(&node.address);
            cluster.nodes.push(node);
            to_node.push(front);
            to_coordinator.push(up);
        }
        cluster.client.wait_for_nodes(nodes, CLOSED).await.unwrap();
        let of_client = Proxy::to(&cluster.coordinator.address, 200);
        let watcher = Watcher::start(&connected(&of_client.address).await).await;
        Self { cluster, watcher, to_node, to_coordinator, of_client }
    }

    /// The name of a node, and its links.
    fn links_of(&self, victim: fn(&Session) -> String) -> (String, &Proxy, &Proxy) {
        let name = victim(&self.watcher.session);
        let number = number_of(&name);
        (name, &self.to_node[number], &self.to_coordinator[number])
    }

    fn finish(&self, what: &str, wait: Duration) {
        finish(what, wait, &self.cluster, &self.watcher);
    }

    /// The longest time without frames during a fault.
    async fn through(&self, what: &str, lasting: Duration, most: Duration) {
        let since = Instant::now();
        tokio::time::sleep(lasting).await;
        let wait = self.watcher.healed(since, lasting + most, |_| true).await;
        assert!(wait < most, "{what}: no frames for {wait:?}");
        self.finish(what, wait);
    }
}

/// All links of the host are silent, and restored later.
async fn lost_host(what: &str, victim: fn(&Session) -> String) {
    let network = Network::start(3).await;
    let (name, to_node, to_coordinator) = network.links_of(victim);
    let since = Instant::now();
    to_node.partition();
    to_coordinator.partition();
    let wait = network.watcher.healed(since, SILENT, |session| !has_role(session, &name)).await;
    to_node.heal();
    to_coordinator.heal();
    network.cluster.client.wait_for_nodes(3, CLOSED).await.unwrap();
    network.watcher.calls_after(Instant::now(), 5, CLOSED).await;
    network.finish(what, wait);
}

/// The node is a member, and requests to it get no answer.
async fn half_open(what: &str, victim: fn(&Session) -> String, forth: Way) {
    let network = Network::start(3).await;
    let (name, to_node, _) = network.links_of(victim);
    let since = Instant::now();
    to_node.set(forth, Way::Stall);
    let wait = network.watcher.healed(since, SILENT, |session| !has_role(session, &name)).await;
    network.finish(what, wait);
}

/// The processes whose links to the coordinator fail.
type Links = fn(&Network) -> Vec<&Proxy>;

fn of_nodes(network: &Network) -> Vec<&Proxy> {
    network.to_coordinator.iter().collect()
}

fn of_client(network: &Network) -> Vec<&Proxy> {
    vec![&network.of_client]
}

/// One direction or both between the coordinator and others fail. Frames go on, and plans follow when the link is
/// restored.
async fn away(what: &str, links: Links, forth: Way, back: Way) {
    let network = Network::start(3).await;
    links(&network).iter().for_each(|link| link.set(forth, back));
    network.through(what, Duration::from_secs(12), CLOSED).await;
    links(&network).iter().for_each(|link| link.heal());
    network.cluster.client.wait_for_nodes(3, CLOSED).await.unwrap();
    network.through(&format!("{what}, mended"), Duration::from_secs(1), CLOSED).await;
}

/// Large pictures take longer over a low bandwidth than keepalive waits for an answer.
async fn low_bandwidth() {
    let network = Network::start(2).await;
    let (_, to_node, _) = network.links_of(compositor_of);
    let bytes_per_s = 80e3;
    to_node.set(Way::Slow { bytes_per_s }, Way::Slow { bytes_per_s });
    let view = |frame| client::ViewRequest { frame, set_index: 0, camera: camera(0.1, UVec2::new(2048, 1536)) };
    let start = Instant::now();
    let frames = network.watcher.session.render_views((0..4).map(view)).unwrap().all().await.unwrap();
    let bytes: u64 = frames.iter().map(|frame| frame.header.total_bytes()).sum();
    println!("thin line: {bytes} bytes took {:.2} s", start.elapsed().as_secs_f64());
    let least_s = bytes as f64 / bytes_per_s;
    assert!(least_s > 8.0, "longer than keepalive waits");
    assert!(start.elapsed().as_secs_f64() < 1.9 * least_s, "nothing was sent twice: {:?}", start.elapsed());
}

/// Keepalive takes up to 10 s to notice, so that all faults run at the same time.
#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn frames_go_on_within_15_s_of_a_partition() {
    tokio::join!(
        lost_host("sampler's host lost", sampler_of),
        lost_host("compositor's host lost", compositor_of),
        half_open("sampler half open", sampler_of, Way::Stall),
        half_open("compositor half open", compositor_of, Way::Stall),
        half_open("compositor's answers lost", compositor_of, Way::Pass),
        away("coordinator and nodes partitioned", of_nodes, Way::Stall, Way::Stall),
        away("coordinator hears no nodes", of_nodes, Way::Stall, Way::Pass),
        away("nodes do not hear the coordinator", of_nodes, Way::Pass, Way::Stall),
        away("coordinator and client partitioned", of_client, Way::Stall, Way::Stall),
        low_bandwidth(),
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_go_on_after_connections_are_cut() {
    let network = Network::start(3).await;
    for victim in [compositor_of, sampler_of] {
        let (_, to_node, to_coordinator) = network.links_of(victim);
        for proxy in [to_node, &network.of_client, to_coordinator] {
            proxy.cut();
            network.through("connections reset", Duration::from_millis(300), CLOSED).await;
        }
    }
}

/// The node is a member and refuses connections.
#[tokio::test(flavor = "multi_thread")]
async fn a_node_that_refuses_connections_is_replaced() {
    for (what, victim) in [("sampler", sampler_of as fn(&Session) -> String), ("compositor", compositor_of)] {
        let network = Network::start(3).await;
        let (name, to_node, _) = network.links_of(victim);
        let since = Instant::now();
        to_node.refuse();
        let wait = network.watcher.healed(since, SILENT, |session| !has_role(session, &name)).await;
        network.finish(&format!("{what} refuses connections"), wait);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_go_on_over_late_slow_and_lossy_links() {
    let network = Network::start(3).await;
    let all = || network.to_node.iter().chain(&network.to_coordinator).chain([&network.of_client]);
    let delay = Duration::from_millis(20);
    let jitter = Duration::from_millis(10);
    let late = Way::Late { delay, jitter, one_in: 20 };
    all().for_each(|link| link.set(late, late));
    network.through("40 ms of delay and 5 % loss", Duration::from_secs(3), CLOSED).await;
    all().for_each(Proxy::heal);
    let slow = Way::Slow { bytes_per_s: 100e3 };
    network.links_of(compositor_of).1.set(slow, slow);
    network.through("slow compositor", Duration::from_secs(2), CLOSED).await;
    all().for_each(Proxy::heal);
    network.links_of(sampler_of).1.set(slow, slow);
    network.through("slow sampler", Duration::from_secs(2), CLOSED).await;
}

/// After a corrupt length of a frame its connection is silent, and after a corrupt number of a stream, or length of a message,
/// the stream alone.
#[tokio::test(flavor = "multi_thread")]
async fn frames_that_are_corrupted_on_the_way_are_not_shown() {
    let network = Network::start(3).await;
    for _ in 0..6 {
        for proxy in &network.to_node {
            proxy.set(Way::Pass, Way::Spoilt { one_in: 40 });
        }
        tokio::time::sleep(Duration::from_millis(700)).await;
        network.to_node.iter().for_each(Proxy::heal);
        // The last changed byte may be one that silences a stream.
        let wait = network.watcher.healed(Instant::now(), SILENT, |_| true).await;
        network.finish("a byte of every fortieth piece changed", wait);
    }
    network.through("as it was", Duration::from_secs(1), SILENT).await;
}

/// A client that requests many views and reads none delays no other, and its waiting frames are bounded.
#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_does_not_read_delays_no_other() {
    let network = Network::start(2).await;
    let plan = network.watcher.session.plan().assignment;
    let name = compositor_of(&network.watcher.session);
    let node = &network.cluster.nodes[number_of(&name)];
    let before = node.memory_bytes();
    let greedy = CompositorClient::new(connect(&plan.compositors[0].address).await.unwrap());
    let view = |frame| RequestedView { frame, camera: camera(0.1, UVec2::new(128, 96)) };
    let request = RenderViews {
        plan_epoch: plan.plan_epoch,
        workload_number: plan.workload_number,
        set_index: 0,
        method: "splat".to_owned(),
        codec: FrameCodec::Lz4,
        planes: ViewPlanes::ALL,
        views: (0..4096).map(view).collect(),
        live: None,
    };
    let unread =
        greedy.render_views(tokio_stream::iter(vec![request; 8]).chain(tokio_stream::pending())).await.unwrap();
    network.through("beside a client that does not read", Duration::from_secs(4), CLOSED).await;
    let grown = node.memory_bytes().saturating_sub(before);
    println!("its node holds {:.0} MB more", grown as f64 / 1e6);
    assert!(grown < 200 << 20, "{grown} bytes for one client");
    drop(unread);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_thousand_connections_leak_nothing() {
    let cluster = Processes::start(PROGRAM, 1).await;
    let watcher = Watcher::start(&cluster.client).await;
    let servers = [&cluster.coordinator, &cluster.nodes[0]];
    let before = servers.map(|server| server.open_files());
    let since = Instant::now();
    for number in 0..500 {
        for server in servers {
            if number % 2 == 0 {
                let _silent =
                    tokio::net::TcpStream::connect(server.address.trim_start_matches("http://")).await.unwrap();
            } else {
                let _ = wire::rpc::is_serving(&server.address, "").await.unwrap();
            }
        }
    }
    let wait = watcher.healed(since, CLOSED, |_| true).await;
    let left = || servers.iter().zip(before).map(|(server, before)| server.open_files().saturating_sub(before)).max();
    cluster_tests::watcher::eventually("all are closed", CLOSED, || left() <= Some(3)).await;
    finish("a thousand connections", wait, &cluster, &watcher);
}
