//! Requests of HTTP to a gateway, over its real port: numbers are those of the Rust client, tokens count, places are limited.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster_tests::gateway_bench::{GatewayBench, PageCamera};
use cluster_tests::watcher::eventually;
use depth_image::ViewPlanes;
use gateway::{GatewayConfig, Token};
use glam::{DVec3, UVec2, Vec2};
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio::task::JoinSet;

const LOCAL: &str = "Host: localhost\r\n";
const SIZE: [u32; 2] = [64, 48];
const CAMERA: PageCamera = PageCamera { eye: [0.1, 1.2, 3.0], target: [0.0, 0.5, 0.0], fov_y_deg: 51.0 };
/// The query of that camera and size.
const VIEW: &str = "eye=0.1,1.2,3&target=0,0.5,0&fov=51&size=64x48";
const SOON: Duration = Duration::from_secs(20);
/// Views over HTTP that are made or wait.
const PLACES: usize = 4 + 64;
/// The time that a request's headers may take.
const HEADERS_WITHIN: Duration = Duration::from_secs(10);
/// A busy machine.
const SLACK: Duration = Duration::from_secs(10);

async fn bench() -> GatewayBench {
    GatewayBench::start(|config| config).await
}

/// A gateway that has answered, and whose next views wait until they are released.
async fn held() -> Arc<GatewayBench> {
    let bench = bench().await;
    let (head, _) = bench.get(&format!("/api/v1/compare.json?{VIEW}"), LOCAL).await;
    assert_eq!(status_of(&head), 200, "{head}");
    for engine in &bench.cluster.engines {
        engine.hold_views_of(UVec2::from_array(SIZE));
    }
    Arc::new(bench)
}

fn release(bench: &GatewayBench) {
    bench.cluster.engines.iter().for_each(|engine| engine.release());
}

fn status_of(head: &str) -> u16 {
    head.split(' ').nth(1).unwrap().parse().unwrap()
}

/// The value of a header.
fn field<'h>(head: &'h str, name: &str) -> Option<&'h str> {
    let fields = head.lines().filter_map(|line| line.split_once(": "));
    fields.into_iter().find_map(|(given, value)| given.eq_ignore_ascii_case(name).then_some(value))
}

/// Begins a request; its answer is a status.
fn ask(bench: &Arc<GatewayBench>, answers: &mut JoinSet<u16>, path: &str) {
    let bench = bench.clone();
    let path = path.to_owned();
    answers.spawn(async move { status_of(&bench.get(&path, LOCAL).await.0) });
}

/// Numbers of a file of NumPy.
fn numbers(file: &[u8]) -> Vec<f32> {
    let header_bytes = 10 + usize::from(u16::from_le_bytes([file[8], file[9]]));
    file[header_bytes..].as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

async fn reference_depth(bench: &GatewayBench) -> Vec<f32> {
    let planes = ViewPlanes::WITH_DEPTH;
    let view = bench.reference_view(&CAMERA, SIZE, planes).await;
    view.inverse_depth_per_m.unwrap().into_iter().map(f32::recip).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn depth_is_that_of_the_rust_client_to_the_bit() {
    let bench = bench().await;
    let (head, file) = bench.get(&format!("/api/v1/depth.npy?{VIEW}"), LOCAL).await;
    assert_eq!(status_of(&head), 200, "{head}");
    let seen = numbers(&file);
    let expected = reference_depth(&bench).await;
    assert!(seen == expected, "depths differ");
    assert!(seen.iter().any(|depth| depth.is_finite()) && seen.iter().any(|depth| depth.is_infinite()));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_point_is_the_surface_at_its_pixel() {
    let bench = bench().await;
    let depths = reference_depth(&bench).await;
    let camera = CAMERA.of_size(UVec2::from_array(SIZE));
    let at = depths.iter().position(|depth| depth.is_finite()).unwrap();
    let [column, row] = [at as u32 % SIZE[0], at as u32 / SIZE[0]];
    let (_, body) = bench.get(&format!("/api/v1/point.json?{VIEW}&at={column},{row}"), LOCAL).await;
    let point: Value = serde_json::from_slice(&body).unwrap();
    assert_eq!((&point["at"], &point["source"]), (&json!([column, row]), &json!("cameras")));
    let ray = camera.ray(Vec2::new(column as f32, row as f32) + 0.5);
    let seen = DVec3::from_array(serde_json::from_value(point["point"].clone()).unwrap());
    assert!(seen.distance(ray.at(depths[at]).as_dvec3()) < 1e-4, "{point}");
    let empty = depths.iter().position(|depth| depth.is_infinite()).unwrap() as u32;
    let (_, body) =
        bench.get(&format!("/api/v1/point.json?{VIEW}&at={},{}", empty % SIZE[0], empty / SIZE[0]), LOCAL).await;
    let nothing: Value = serde_json::from_slice(&body).unwrap();
    assert_eq!(
        (&nothing["source"], &nothing["point"], &nothing["cameras"]),
        (&json!("nothing"), &Value::Null, &json!([]))
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_of_provenance_names_its_colours_in_a_header() {
    let bench = bench().await;
    let (head, body) = bench.get(&format!("/api/v1/view.png?{VIEW}&show=provenance"), LOCAL).await;
    assert!(status_of(&head) == 200 && body.starts_with(b"\x89PNG"), "{head}");
    let legend: Vec<(String, String)> = serde_json::from_str(field(&head, "myriorama-legend").unwrap()).unwrap();
    assert!(legend.iter().any(|(name, _)| name == "camera 1"), "{legend:?}");
    assert!(legend.iter().all(|(_, color)| color.len() == 7 && color.starts_with('#')), "{legend:?}");
    let (head, _) = bench.get(&format!("/api/v1/view.png?{VIEW}"), LOCAL).await;
    assert_eq!(field(&head, "myriorama-legend"), None, "colours of a view have no names");
}

#[tokio::test(flavor = "multi_thread")]
async fn queries_out_of_range_are_refused_by_name() {
    let bench = bench().await;
    for (path, name) in [
        ("view.png?show=x", "show"),
        ("view.png?size=1921x1080", "size"),
        ("view.png?fov=0", "fov"),
        ("compare.json?size=1921x360", "size"),
        ("point.json?size=64x48&at=64,0", "at"),
        ("point.json?size=64x48&at=-1,0", "at"),
        ("depth.npy?eye=1,nan", "eye"),
        ("depth.npy?method=mesh", "method"),
        ("cameras.json?cell=1", "cell"),
    ] {
        let (head, body) = bench.get(&format!("/api/v1/{path}"), LOCAL).await;
        let reason = String::from_utf8_lossy(&body);
        assert!(status_of(&head) == 400 && reason.contains(name), "{path}: {head}: {reason}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn views_beyond_the_places_are_refused_and_the_others_arrive() {
    let bench = held().await;
    let mut answers = JoinSet::new();
    for _ in 0..PLACES + 3 {
        ask(&bench, &mut answers, &format!("/api/v1/view.png?{VIEW}"));
    }
    let in_time = tokio::time::timeout(SOON, async {
        for _ in 0..3 {
            assert_eq!(answers.join_next().await.unwrap().unwrap(), 429);
        }
    });
    in_time.await.expect("refusals while the others wait");
    release(&bench);
    let others = tokio::time::timeout(SOON, answers.join_all()).await.expect("answers");
    assert_eq!(others, [200; PLACES]);
}

#[tokio::test(flavor = "multi_thread")]
async fn one_view_is_compared_at_a_time() {
    let bench = held().await;
    let mut answers = JoinSet::new();
    let path = format!("/api/v1/compare.json?{VIEW}");
    ask(&bench, &mut answers, &path);
    let engines = &bench.cluster.engines;
    eventually("a view", SOON, || engines.iter().any(|engine| engine.held_calls() > 0)).await;
    assert_eq!(status_of(&bench.get(&path, LOCAL).await.0), 429);
    release(&bench);
    assert_eq!(answers.join_all().await, [200]);
    assert_eq!(status_of(&bench.get(&path, LOCAL).await.0), 200, "the next one has its place");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_token_is_brought_by_bearer_or_by_the_cookie_of_its_link() {
    let token = Token::random().unwrap();
    let bench = GatewayBench::start(|config| GatewayConfig { token: Some(token.clone()), ..config }).await;
    let query = token.query();
    let secret = query.strip_prefix("?token=").unwrap();
    let (head, _) = bench.get(&format!("/{query}"), LOCAL).await;
    assert_eq!((status_of(&head), field(&head, "location")), (303, Some("./")), "{head}");
    let cookie = field(&head, "set-cookie").unwrap();
    assert!(cookie.contains("; HttpOnly; SameSite=Strict") && !cookie.contains("Secure"), "{cookie}");
    let pair = cookie.split(';').next().unwrap();
    for (headers, status) in [
        (format!("Authorization: Bearer {secret}\r\n"), 200),
        (format!("Cookie: other=1; {pair}\r\n"), 200),
        (String::new(), 401),
        (format!("Authorization: Bearer {}\r\n", &secret[1..]), 401),
        (format!("Cookie: {pair}0\r\n"), 401),
    ] {
        let (head, body) = bench.get(&format!("/api/v1/view.png?{VIEW}"), &format!("{LOCAL}{headers}")).await;
        assert_eq!(status_of(&head), status, "{headers}: {head}");
        assert!(!String::from_utf8_lossy(&body).contains(secret));
    }
    for (path, status) in
        [("/", 200), ("/main.js", 200), ("/status", 200), ("/api/v1/socket", 401), ("/api/v1/status.json", 401)]
    {
        assert_eq!(status_of(&bench.get(path, LOCAL).await.0), status, "{path}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_whose_headers_never_end_is_ended_while_others_are_served() {
    let bench = bench().await;
    let mut slow = TcpStream::connect(bench.authority()).await.unwrap();
    let start = Instant::now();
    let (mut reading, mut writing) = slow.split();
    let drip = async {
        writing.write_all(b"GET / HTTP/1.1\r\nHost: localhost\r\n").await.unwrap();
        while writing.write_all(b"A: b\r\n").await.is_ok() {
            assert_eq!(status_of(&bench.get("/", LOCAL).await.0), 200);
            tokio::time::sleep(Duration::from_millis(200)).await;
        }
    };
    let mut rest = Vec::new();
    let ended = async { drop(reading.read_to_end(&mut rest).await) };
    let within = HEADERS_WITHIN + SLACK;
    let ended = async {
        tokio::select! { () = ended => (), () = drip => () }
    };
    tokio::time::timeout(within, ended).await.expect("an end");
    assert!(start.elapsed() > HEADERS_WITHIN / 2, "{:?}", start.elapsed());
    assert!(!rest.starts_with(b"HTTP/1.1 200"), "the page is sent");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_thousand_connections_at_once_leave_another_visitor_served() {
    let bench = bench().await;
    let mut opening = JoinSet::new();
    for _ in 0..1000 {
        let authority = bench.authority().to_owned();
        opening.spawn(async move {
            let mut stream = TcpStream::connect(authority).await.unwrap();
            stream.write_all(b"GET / HTTP/1.1\r\n").await.unwrap();
            stream
        });
    }
    let open = opening.join_all().await;
    let answer = tokio::time::timeout(SOON, bench.get(&format!("/api/v1/view.png?{VIEW}"), LOCAL)).await;
    let (head, body) = answer.expect("an answer");
    assert!(status_of(&head) == 200 && body.starts_with(b"\x89PNG"), "{head}");
    assert_eq!(open.len(), 1000);
}
