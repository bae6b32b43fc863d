//! Peers with invalid requests, another version, another protocol, or another's name. Each is refused within a second,
//! by a status that names the field where there is one. A concurrent client sees no effect.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use bytes::Bytes;
use cluster::{SamplerReport, SessionRequest, Timeline};
use cluster_tests::cluster::connected;
use cluster_tests::processes::Processes;
use cluster_tests::raw;
use cluster_tests::watcher::{Watcher, watched_request as request};
use depth_image::{Camera, PinholeCamera};
use glam::{UVec2, Vec3};
use network_proxy::Random;
use tonic::{Code, Status};
use wire::rpc::{CoordinatorClient, connect};

use super::{CLOSED, PROGRAM, finish};

/// Greatest time of a refusal.
const AT_ONCE: Duration = Duration::from_secs(1);
const JOIN: &str = "/myriorama.v1.CoordinatorService/JoinCluster";
const OPEN: &str = "/myriorama.v1.CoordinatorService/OpenSession";
const FETCH: &str = "/myriorama.v1.SamplerService/FetchSampleImages";
const VIEWS: &str = "/myriorama.v1.CompositorService/RenderViews";

/// A cluster with a concurrent client.
pub struct Beside {
    pub cluster: Processes,
    pub watcher: Watcher,
    since: Instant,
}

impl Beside {
    pub async fn start(nodes: usize) -> Self {
        let cluster = Processes::start(PROGRAM, nodes).await;
        let watcher = Watcher::start(&cluster.client).await;
        Self { cluster, watcher, since: Instant::now() }
    }

    /// The concurrent client saw no fault.
    pub async fn finish(self, what: &str) {
        let wait = self.watcher.healed(self.since, CLOSED, |_| true).await;
        assert!(wait < 2 * AT_ONCE, "{what}: no frames for {wait:?}");
        finish(what, wait, &self.cluster, &self.watcher);
    }
}

/// Runs a request within the deadline.
async fn refusal<T>(call: impl Future<Output = Result<T, Status>>) -> Status {
    tokio::time::timeout(AT_ONCE, call).await.expect("at once").err().expect("refused")
}

#[tokio::test(flavor = "multi_thread")]
async fn other_versions_and_malformed_messages_are_refused() {
    let beside = Beside::start(2).await;
    let coordinator = &beside.cluster.coordinator.address;
    let node = &beside.cluster.nodes[0].address;
    let join = [raw::text_field(1, "old"), raw::text_field(2, "http://127.0.0.1:1")].concat();
    let versions =
        [(None, "protocol_version is 0"), (Some(1), "protocol_version is 1"), (Some(77), "protocol_version is 77")];
    for (version, says) in versions {
        let number = version.map_or_else(Vec::new, |version| raw::number_field(15, version));
        let refused = refusal(raw::call(coordinator, JOIN, [join.clone(), number].concat().into())).await;
        assert_eq!(refused.code(), Code::FailedPrecondition, "{refused}");
        assert!(refused.message().contains(says), "{refused}");
        let number = version.map_or_else(Vec::new, |version| raw::number_field(31, version));
        let refused = refusal(raw::call(coordinator, OPEN, number.into())).await;
        assert_eq!(refused.code(), Code::FailedPrecondition, "a client: {refused}");
        assert!(refused.message().contains(says), "{refused}");
    }
    let mut random = Random::new(5);
    for path in [JOIN, OPEN] {
        let noise: Bytes = (0..1000).map(|_| random.bits() as u8).collect();
        let refused = refusal(raw::call(coordinator, path, noise)).await;
        assert!([Code::Internal, Code::InvalidArgument].contains(&refused.code()), "{refused}");
        let long = vec![0; 3 << 20].into();
        assert_eq!(refusal(raw::call(coordinator, path, long)).await.code(), Code::OutOfRange);
    }
    for (path, field) in [(VIEWS, "views is missing"), (FETCH, "image_indices is missing")] {
        let refused = refusal(raw::call(node, path, Bytes::new())).await;
        assert!(refused.message().contains(field), "{refused}");
    }
    assert_eq!(beside.cluster.client.status().await.unwrap().nodes.len(), 2, "nobody joined");
    beside.finish("other versions and noise").await;
}

/// Viewpoints in a hundred places, each half as far again as the one before.
fn everywhere(camera: PinholeCamera) -> Vec<PinholeCamera> {
    (0..100).map(|i| PinholeCamera { eye_in_world: camera.eye_in_world * 1.5f32.powi(i), ..camera }).collect()
}

/// Viewpoints whose distance is not finite.
fn beyond(camera: PinholeCamera) -> Vec<PinholeCamera> {
    [-3e38, 3e38].map(|x| PinholeCamera { eye_in_world: Vec3::X * x, ..camera }).to_vec()
}

#[tokio::test(flavor = "multi_thread")]
async fn absurd_requests_are_refused_by_field() {
    let beside = Beside::start(2).await;
    let coordinator = CoordinatorClient::new(connect(&beside.cluster.coordinator.address).await.unwrap());
    let camera = request().typical_view;
    let huge = PinholeCamera { size_px: UVec2::splat(65_535), ..camera };
    let absurd = [
        (SessionRequest { views_per_set: 1_000_000, ..request() }, "views_per_set_count is 1000000"),
        (SessionRequest { typical_view: huge, ..request() }, "typical_view: camera size_px"),
        (
            SessionRequest { typical_view: PinholeCamera { eye_in_world: Vec3::NAN, ..camera }, ..request() },
            "eye_in_world",
        ),
        (SessionRequest { sample_cameras: vec![Camera::Pinhole(huge)], ..request() }, "camera.pinhole: camera size_px"),
        (SessionRequest { sample_cameras: vec![Camera::Pinhole(camera); 17], ..request() }, "sample_cameras has 17"),
        (
            SessionRequest { sample_size_px: Some(UVec2::splat(65_535)), ..request() },
            "sample_image_size: camera size_px",
        ),
        (SessionRequest { sample_size_px: Some(UVec2::ZERO), ..request() }, "sample_image_size"),
        (SessionRequest { method: String::new(), ..request() }, "reconstruction_method"),
        (SessionRequest { viewpoints: vec![camera; 257], ..request() }, "viewpoints has 257"),
        (SessionRequest { viewpoints: vec![huge], ..request() }, "viewpoints: camera size_px"),
        (
            SessionRequest { viewpoints: vec![camera], sample_cameras: vec![Camera::Pinhole(camera)], ..request() },
            "viewpoints: sample_cameras are given, too",
        ),
        (SessionRequest { viewpoints: everywhere(camera), ..request() }, "viewpoints: they are spread over"),
        (SessionRequest { viewpoints: beyond(camera), ..request() }, "viewpoints: camera eye_in_world is not finite"),
        (SessionRequest { lighting: "x".repeat(300), ..request() }, "lighting has 300"),
        (
            SessionRequest { timeline: Timeline { step_s: 1e300, ..request().timeline }, ..request() },
            "timeline.step_s is 1",
        ),
    ];
    for (request, field) in absurd {
        let open = async {
            let mut events = coordinator.open_session(request).await?;
            loop {
                match tokio_stream::StreamExt::next(&mut events).await {
                    Some(Err(status)) => return Err::<(), _>(status),
                    Some(Ok(_)) => (),
                    None => return Ok(()),
                }
            }
        };
        let refused = refusal(open).await;
        assert_eq!(refused.code(), Code::InvalidArgument, "{field}: {refused}");
        assert!(refused.message().contains(field), "{field}: {refused}");
    }
    beside.finish("absurd requests").await;
}

fn socket(address: &str) -> TcpStream {
    let address: SocketAddr = address.trim_start_matches("http://").parse().unwrap();
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(8))).unwrap();
    stream
}

/// The bytes until the server ends the connection, and the time that takes.
fn answer(address: &str, bytes: &[u8]) -> (Vec<u8>, Duration) {
    let mut stream = socket(address);
    let start = Instant::now();
    let mut all = Vec::new();
    let _ = stream.write_all(bytes);
    let ended = stream.read_to_end(&mut all);
    let timed_out = ended.is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock);
    assert!(!timed_out, "the connection is still open");
    (all, start.elapsed())
}

#[tokio::test(flavor = "multi_thread")]
async fn connections_without_http2_are_cut() {
    let beside = Beside::start(2).await;
    let mut random = Random::new(6);
    let noise: Vec<u8> = (0..100_000).map(|_| random.bits() as u8).collect();
    let garbled = [raw::http2_start(), noise.clone()].concat();
    for server in [&beside.cluster.coordinator.address, &beside.cluster.nodes[0].address] {
        for bytes in [b"GET / HTTP/1.1\r\nHost: here\r\n\r\n".to_vec(), noise.clone(), garbled.clone()] {
            let server = server.clone();
            let bytes = bytes.clone();
            let (_, took) = tokio::task::spawn_blocking(move || answer(&server, &bytes)).await.unwrap();
            assert!(took < AT_ONCE, "{took:?}");
        }
    }
    // A silent peer may be slow: the limit is that of keepalive.
    let server = beside.cluster.nodes[0].address.clone();
    let (_, took) = tokio::task::spawn_blocking(move || answer(&server, b"PRI")).await.unwrap();
    assert!((4.0..7.0).contains(&took.as_secs_f64()), "{took:?}");
    beside.finish("peers without a language").await;
}

/// Reads until the headers that end the call, which have its status.
fn until_refused(mut stream: TcpStream) -> Duration {
    const HEADERS_AND_END: [u8; 6] = [1, 5, 0, 0, 0, 1];
    let mut all = Vec::new();
    let mut part = [0; 4096];
    let start = Instant::now();
    while !all.windows(HEADERS_AND_END.len()).any(|bytes| bytes == HEADERS_AND_END) {
        let count = stream.read(&mut part).unwrap();
        assert!(count > 0, "cut off without a word");
        all.extend_from_slice(&part[..count]);
    }
    start.elapsed()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_claimed_length_of_4_gib_takes_no_memory() {
    let beside = Beside::start(2).await;
    let node = &beside.cluster.nodes[0];
    let before = node.memory_bytes();
    let mut open = Vec::new();
    for _ in 0..32 {
        let mut stream = socket(&node.address);
        let head = raw::frame(0, 0, 1, &raw::message_head(u32::MAX));
        stream.write_all(&[raw::http2_start(), raw::call_headers(FETCH), head].concat()).unwrap();
        open.push(stream);
    }
    let refused = tokio::task::spawn_blocking(move || open.into_iter().map(until_refused).max()).await.unwrap();
    assert!(refused.is_some_and(|took| took < AT_ONCE), "{refused:?}");
    let grown = node.memory_bytes().saturating_sub(before);
    assert!(grown < 64 << 20, "{grown} bytes");
    beside.finish("lengths of 4 GiB").await;
}

/// The later of two processes with one name counts; the earlier waits until it has left.
#[tokio::test(flavor = "multi_thread")]
async fn the_later_of_two_processes_with_one_name_counts() {
    let beside = Beside::start(2).await;
    let Beside { cluster, watcher, .. } = &beside;
    let address_of = async || {
        let status = cluster.client.status().await.unwrap();
        status.nodes.into_iter().find(|node| node.node_name == "n0").map(|node| node.address)
    };
    let mut twin = cluster.node("n0", &[]);
    let deadline = Instant::now() + CLOSED;
    while address_of().await.as_deref() != Some(&twin.address) {
        assert!(Instant::now() < deadline);
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    watcher.calls_after(Instant::now(), 5, CLOSED).await;
    let epoch = watcher.epoch();
    tokio::time::sleep(Duration::from_secs(3)).await;
    assert_eq!(address_of().await.as_deref(), Some(&*twin.address));
    assert_eq!(watcher.epoch(), epoch, "they do not replace each other");
    twin.kill();
    let deadline = Instant::now() + CLOSED;
    while address_of().await.as_deref() != Some(&cluster.nodes[0].address) {
        assert!(Instant::now() < deadline, "the earlier one comes back");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    beside.finish("two processes with one name").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn reports_of_another_plan_change_nothing() {
    let beside = Beside::start(2).await;
    let coordinator = CoordinatorClient::new(connect(&beside.cluster.coordinator.address).await.unwrap());
    let epoch = beside.watcher.epoch();
    let report = |plan_epoch, compositor: &str, sampler: &str| SamplerReport {
        plan_epoch,
        compositor: compositor.to_owned(),
        sampler: sampler.to_owned(),
        reason: "malice".to_owned(),
    };
    for report in [report(epoch + 1, "n0", "n1"), report(epoch, "stranger", "n0"), report(epoch, "n0", "n0")] {
        assert_eq!(refusal(coordinator.report_sampler(report)).await.code(), Code::FailedPrecondition);
    }
    let client = connected(&beside.cluster.coordinator.address).await;
    assert_eq!(client.status().await.unwrap().plan_epoch, epoch);
    beside.finish("reports that fit no plan").await;
}
