//! Visitors of a gateway, over its real port: pictures are those of the Rust client, and nobody can break it.

use std::time::Duration;

use cluster::SessionRequest;
use cluster_tests::gateway_bench::{GatewayBench, PageCamera, session_request};
use cluster_tests::scalar_engine::LIGHT_CACHE;
use codec::{DecodeLimits, FrameCodec, decode_frame};
use futures_util::{SinkExt as _, StreamExt as _};
use gateway::GatewayConfig;
use glam::UVec2;
use network_proxy::Proxy;
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest as _;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

const SOON: Duration = Duration::from_secs(10);
/// A page that answers nothing has gone after this time.
const SILENCE: Duration = Duration::from_secs(20);
const SIZE: [u32; 2] = [64, 48];
const EYE: [f64; 3] = [0.1, 1.2, 3.0];
const TARGET: [f64; 3] = [0.0, 0.5, 0.0];
const FOV_Y_DEG: f64 = 51.0;

struct Bench(GatewayBench);

impl Bench {
    async fn start(change: impl FnOnce(GatewayConfig) -> GatewayConfig) -> Self {
        Self(GatewayBench::start(change).await)
    }

    async fn visitor(&self) -> Visitor {
        visitor_at(self.0.authority()).await
    }

    /// A visitor who has been let in, to a scene with a plan.
    async fn welcomed(&self) -> Visitor {
        let mut visitor = self.visitor().await;
        visitor.tell(&json!({ "type": "open" })).await;
        assert_eq!(visitor.heard().await["scene"], "ball");
        while visitor.heard().await["type"] != "plan" {}
        visitor
    }

    /// The answer to a request: its status line and headers, and its body.
    async fn get(&self, path: &str, headers: &str) -> (String, Vec<u8>) {
        self.0.get(path, headers).await
    }

    /// The picture of a camera as the Rust client receives it.
    async fn reference(&self, eye: [f64; 3]) -> Vec<u8> {
        self.0.reference(&PageCamera { eye, target: TARGET, fov_y_deg: FOV_Y_DEG }, SIZE).await
    }
}

/// A visitor of the gateway at `host:port`.
async fn visitor_at(authority: &str) -> Visitor {
    let mut request = format!("ws://{authority}/api/v1/socket").into_client_request().unwrap();
    request.headers_mut().insert("Sec-WebSocket-Protocol", "myriorama.v1".parse().unwrap());
    let (socket, _) = connect_async(request).await.unwrap();
    Visitor { socket, number: 0 }
}

struct Visitor {
    socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
    number: u64,
}

/// A picture as it came.
struct Picture {
    header: Value,
    data: Vec<u8>,
}

impl Picture {
    fn number(&self) -> u64 {
        self.header["number"].as_u64().unwrap()
    }

    fn rgb(&self, codec: FrameCodec) -> Vec<u8> {
        let size: [u32; 2] = serde_json::from_value(self.header["size_px"].clone()).unwrap();
        decode_frame(codec, UVec2::from_array(size), &self.data, &DecodeLimits::default()).unwrap()
    }
}

impl Visitor {
    async fn tell(&mut self, message: &Value) {
        self.socket.send(Message::text(message.to_string())).await.unwrap();
    }

    async fn pose(&mut self, eye: [f64; 3], still: bool) -> u64 {
        self.number += 1;
        let camera = json!({ "eye": eye, "target": TARGET, "fov_y_deg": FOV_Y_DEG });
        let number = self.number;
        let canvas_px = SIZE;
        self.tell(
            &json!({ "type": "pose", "number": number, "camera": camera, "canvas_px": canvas_px, "still": still }),
        )
        .await;
        number
    }

    /// The stills of a pose up to the last, as samples a pixel, quality and whether they are drawn directly.
    async fn stills(&mut self, pose: Value) -> Vec<(u64, Value, bool)> {
        self.number += 1;
        let camera = json!({ "eye": EYE, "target": TARGET, "fov_y_deg": FOV_Y_DEG });
        let mut message =
            json!({ "type": "pose", "number": self.number, "camera": camera, "canvas_px": SIZE, "still": true });
        message.as_object_mut().unwrap().extend(pose.as_object().unwrap().clone());
        self.tell(&message).await;
        let mut stills = Vec::new();
        loop {
            let picture = self.picture().await;
            self.shown(&picture).await;
            let Value::Object(header) = &picture.header else { panic!("{}", picture.header) };
            let samples = header["samples"].as_u64().unwrap();
            stills.push((samples, header["quality"].clone(), header["direct"].as_bool().unwrap()));
            if !header["more"].as_bool().unwrap() {
                return stills;
            }
        }
    }

    async fn shown(&mut self, picture: &Picture) {
        self.tell(&json!({ "type": "shown", "number": picture.number(), "age_ms": 20.0 })).await;
    }

    async fn next(&mut self) -> Option<Message> {
        self.socket.next().await?.ok()
    }

    /// The next text.
    async fn heard(&mut self) -> Value {
        tokio::time::timeout(SOON, self.next_text()).await.expect("a text in time")
    }

    async fn next_text(&mut self) -> Value {
        loop {
            match self.next().await.expect("no end") {
                Message::Text(text) if text.contains("alive") => (),
                Message::Text(text) => return serde_json::from_str(&text).unwrap(),
                Message::Close(reason) => panic!("closed: {reason:?}"),
                _ => (),
            }
        }
    }

    async fn picture(&mut self) -> Picture {
        tokio::time::timeout(SOON, self.next_picture()).await.expect("a picture in time")
    }

    async fn next_picture(&mut self) -> Picture {
        let mut picture = Picture { header: Value::Null, data: Vec::new() };
        loop {
            if let Message::Binary(message) = self.next().await.expect("no end") {
                let (length, rest) = message.split_at(4);
                let (header, data) = rest.split_at(u32::from_le_bytes(length.try_into().unwrap()) as usize);
                if !header.is_empty() {
                    picture = Picture { header: serde_json::from_slice(header).unwrap(), data: Vec::new() };
                }
                picture.data.extend(data);
                if picture.data.len() as u64 == picture.header["bytes"].as_u64().unwrap() {
                    return picture;
                }
                self.tell(&json!({ "type": "received" })).await;
            }
        }
    }

    /// The pictures of a time.
    async fn pictures_within(&mut self, time: Duration) -> Vec<Picture> {
        let mut pictures = Vec::new();
        while let Ok(picture) = tokio::time::timeout(time, self.next_picture()).await {
            pictures.push(picture);
        }
        pictures
    }

    /// The stills that follow the first one of a pose, up to the one with all samples a pixel.
    async fn finished(&mut self, first: &Picture) -> Vec<Picture> {
        self.shown(first).await;
        let mut stills = Vec::new();
        while stills.last().is_none_or(|still: &Picture| still.header["samples"] != 16) {
            let still = self.picture().await;
            self.shown(&still).await;
            stills.push(still);
        }
        stills
    }

    /// The reason of a refusal, after which the connection ends.
    async fn refusal(&mut self) -> String {
        tokio::time::timeout(SOON, self.refused()).await.expect("a refusal in time")
    }

    async fn refused(&mut self) -> String {
        let mut reason = None;
        while let Some(message) = self.next().await {
            if let Message::Text(text) = &message {
                let message: Value = serde_json::from_str(text).unwrap();
                if message["type"] == "refused" {
                    reason = message["reason"].as_str().map(str::to_owned);
                }
            }
        }
        reason.expect("a refusal")
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_still_of_shared_light_becomes_finer_and_is_drawn_at_last() {
    let request = SessionRequest { method: format!("{LIGHT_CACHE}:balanced"), takes_light: true, ..session_request() };
    let bench = Bench(GatewayBench::start_with(request, |config| config).await);
    let mut visitor = bench.visitor().await;
    visitor.tell(&json!({ "type": "open" })).await;
    assert_eq!(visitor.heard().await["quality"], "fine");
    let plan = loop {
        let heard = visitor.heard().await;
        if heard["type"] == "plan" {
            break heard;
        }
    };
    assert_eq!(plan["shares_light"], true);
    let shared = |samples: u64, quality: &str| (samples, Value::from(quality), false);
    let drawn = (16, Value::Null, true);
    let early = [shared(1, "balanced"), shared(4, "balanced")];
    let fine = [&early[..], &[shared(16, "fine"), drawn.clone()]].concat();
    assert_eq!(visitor.stills(json!({})).await, fine);
    let balanced = [&early[..], &[shared(16, "balanced")]].concat();
    assert_eq!(visitor.stills(json!({ "quality": "balanced" })).await, balanced);
    assert_eq!(visitor.stills(json!({ "quality": "exact" })).await, [&early[..], &[drawn]].concat());
    let draft = [1, 4, 16].map(|samples| shared(samples, "draft"));
    assert_eq!(visitor.stills(json!({ "quality": "draft" })).await, draft);
    visitor.tell(&json!({ "type": "pose", "number": 99, "quality": "best" })).await;
    let refused = visitor.heard().await;
    assert!(refused["reason"].as_str().unwrap().contains("draft, fast, balanced, fine, exact"), "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_still_is_the_picture_of_the_rust_client_to_the_bit() {
    let bench = Bench::start(|config| config).await;
    let mut visitor = bench.welcomed().await;
    let number = visitor.pose(EYE, true).await;
    let still = visitor.picture().await;
    assert_eq!(
        (still.number(), &still.header["still"], &still.header["media_type"]),
        (number, &json!(true), &json!("image/png"))
    );
    assert_eq!(still.header["size_px"], json!(SIZE));
    let samples = visitor.finished(&still).await;
    assert_eq!(samples.iter().map(|still| still.header["samples"].as_u64().unwrap()).collect::<Vec<_>>(), [4, 16]);
    let still = &samples[1];
    let rgb = still.rgb(FrameCodec::Png);
    assert!(rgb == bench.reference(EYE).await);
    assert!(rgb != bench.reference([0.2, 1.2, 3.0]).await, "a shifted camera shows another picture");
    let (head, body) =
        bench.get("/api/v1/view.png?eye=0.1,1.2,3&target=0,0.5,0&fov=51&size=64x48", "Host: localhost\r\n").await;
    assert!(head.starts_with("HTTP/1.1 200") && body == still.data, "{head}");
}

#[tokio::test(flavor = "multi_thread")]
async fn pictures_of_a_drag_rise_and_end_with_its_last_pose() {
    let bench = Bench::start(|config| config).await;
    let mut visitor = bench.welcomed().await;
    let mut numbers = Vec::new();
    for step in 0..60 {
        visitor.pose([f64::from(step) * 0.01, 1.2, 3.0], false).await;
        if let Ok(picture) = tokio::time::timeout(Duration::from_millis(10), visitor.next_picture()).await {
            visitor.shown(&picture).await;
            numbers.push(picture.number());
        }
    }
    while numbers.last() != Some(&60) {
        let picture = visitor.picture().await;
        visitor.shown(&picture).await;
        assert_eq!(picture.header["media_type"], "image/jpeg");
        let times = picture.header["times_ms"].as_object().unwrap();
        let sum: f64 = times.iter().filter(|(name, _)| *name != "gateway").map(|(_, ms)| ms.as_f64().unwrap()).sum();
        assert!((sum - times["gateway"].as_f64().unwrap()).abs() < 1e-6, "{times:?}");
        numbers.push(picture.number());
    }
    assert!(numbers.is_sorted_by(|a, b| a < b), "{numbers:?}");
    let still = visitor.pose(EYE, true).await;
    assert_eq!(visitor.picture().await.number(), still);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_that_confirms_nothing_is_sent_two_pictures() {
    let bench = Bench::start(|config| config).await;
    let mut visitor = bench.welcomed().await;
    let mut pictures = Vec::new();
    for step in 0..20 {
        visitor.pose([f64::from(step) * 0.02, 1.2, 3.0], false).await;
        pictures.extend(visitor.pictures_within(Duration::from_millis(50)).await);
    }
    pictures.extend(visitor.pictures_within(Duration::from_millis(300)).await);
    assert_eq!(pictures.len(), 2);
    visitor.shown(&pictures[1]).await;
    assert_eq!(visitor.picture().await.number(), 20, "the newest pose comes next");
}

#[tokio::test(flavor = "multi_thread")]
async fn two_visitors_see_their_own_pictures_in_one_session() {
    let bench = Bench::start(|config| config).await;
    let mut one = bench.welcomed().await;
    let mut other = bench.welcomed().await;
    one.pose(EYE, true).await;
    other.pose([0.3, 1.0, 2.5], true).await;
    let of_one = one.picture().await;
    let of_other = other.picture().await;
    let of_one = one.finished(&of_one).await;
    let of_other = other.finished(&of_other).await;
    // A status is told again for half a second.
    tokio::time::sleep(Duration::from_millis(600)).await;
    let (_, body) = bench.get("/api/v1/status.json", "Host: 127.0.0.1\r\n").await;
    let status: Value = serde_json::from_slice(&body).unwrap();
    assert_eq!((&status["visitors"], &status["workloads"][0]["sessions"]), (&json!(2), &json!(1)));
    assert!(of_one[1].rgb(FrameCodec::Png) == bench.reference(EYE).await);
    assert!(of_other[1].rgb(FrameCodec::Png) == bench.reference([0.3, 1.0, 2.5]).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_that_moves_shows_the_moment_of_each_pose() {
    let bench = Bench::start(|config| config).await;
    let mut visitor = bench.visitor().await;
    visitor.tell(&json!({ "type": "open" })).await;
    let welcome = visitor.heard().await;
    assert_eq!((&welcome["moments"], welcome["moment_step_s"].as_f64()), (&json!(6), Some(0.5 / 6.0)));
    let camera = json!({ "eye": EYE, "target": TARGET, "fov_y_deg": FOV_Y_DEG });
    for (number, moment, still) in [(1, 3, false), (2, 5, true), (3, 0, false), (4, 0, true)] {
        let mut pose = json!({ "type": "pose", "number": number, "camera": camera, "canvas_px": SIZE });
        pose.as_object_mut()
            .unwrap()
            .extend([("moment".to_owned(), json!(moment)), ("still".to_owned(), json!(still))]);
        visitor.tell(&pose).await;
        let picture = visitor.picture().await;
        if still {
            visitor.finished(&picture).await;
        } else {
            visitor.shown(&picture).await;
        }
        let set = picture.header["set"].as_str().unwrap().to_owned();
        assert_eq!((picture.number(), set.ends_with(&format!(".{moment}"))), (number, true), "{set}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_that_breaks_the_protocol_is_refused_by_name_and_hurts_nobody() {
    let bench = Bench::start(|config| config).await;
    let mut watcher = bench.welcomed().await;
    let pose = |changes: Value| {
        let camera = json!({ "eye": EYE, "target": TARGET, "fov_y_deg": FOV_Y_DEG });
        let mut pose = json!({ "type": "pose", "number": 1, "camera": camera, "canvas_px": SIZE, "still": false });
        pose.as_object_mut().unwrap().extend(changes.as_object().unwrap().clone());
        Message::text(pose.to_string())
    };
    let bad: [(Message, &str); 9] = [
        (pose(json!({ "method": "mesh" })), "unknown field"),
        (pose(json!({ "number": 0 })), "number: 0 comes after 0"),
        (pose(json!({ "canvas_px": [0, 5] })), "size"),
        (pose(json!({ "camera": { "eye": [1e300, 0, 0], "target": TARGET, "fov_y_deg": 45 } })), "eye"),
        (pose(json!({ "camera": { "eye": EYE, "target": TARGET, "fov_y_deg": 0 } })), "fov_y_deg"),
        (pose(json!({ "moment": 6 })), "moment: 6 must be below 6"),
        (Message::binary(vec![0; 8]), "binary"),
        (Message::text(r#"{"type":"open"}"#), "open comes once"),
        (Message::text("{"), "message"),
    ];
    for (message, reason) in bad {
        let mut visitor = bench.welcomed().await;
        visitor.socket.send(message).await.unwrap();
        let refusal = visitor.refusal().await;
        assert!(refusal.contains(reason), "{refusal} for {reason}");
    }
    let mut large = bench.welcomed().await;
    let _ = large.socket.send(Message::text(" ".repeat(20_000))).await;
    tokio::time::timeout(SOON, async { while large.next().await.is_some() {} }).await.expect("an end");
    watcher.pose(EYE, true).await;
    assert_eq!(watcher.picture().await.number(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_that_sends_600_poses_at_once_gets_the_last() {
    let bench = Bench::start(|config| config).await;
    let mut hasty = bench.welcomed().await;
    for _ in 0..600 {
        hasty.pose(EYE, false).await;
    }
    let last = hasty.pose(EYE, true).await;
    let mut number = 0;
    while number < last {
        let picture = hasty.picture().await;
        hasty.shown(&picture).await;
        number = picture.number();
    }
    assert_eq!(number, last);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_that_floods_is_refused_and_hurts_nobody() {
    let bench = Bench::start(|config| config).await;
    let mut flood = bench.welcomed().await;
    let mut watcher = bench.welcomed().await;
    let message = Message::text(r#"{"type":"shown","number":0,"age_ms":1}"#);
    // Those of five seconds at once: the connection may end before the last.
    for _ in 0..1200 {
        let _ = flood.socket.feed(message.clone()).await;
    }
    let _ = flood.socket.flush().await;
    let refusal = flood.refusal().await;
    assert!(refusal.contains("more than 240 a second"), "{refusal}");
    watcher.pose(EYE, true).await;
    assert_eq!(watcher.picture().await.number(), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_that_vanishes_without_a_word_leaves_its_place() {
    let bench = Bench::start(|config| GatewayConfig { max_visitors: 1, ..config }).await;
    let proxy = Proxy::to(&format!("http://{}", bench.0.authority()), 1);
    let mut vanished = visitor_at(proxy.address.trim_start_matches("http://")).await;
    vanished.tell(&json!({ "type": "open" })).await;
    assert_eq!(vanished.heard().await["type"], "welcome");
    proxy.partition();
    let mut next = bench.visitor().await;
    next.tell(&json!({ "type": "open" })).await;
    assert_eq!(next.heard().await["stage"], "full");
    let let_in = tokio::time::timeout(SILENCE + SOON, next.next_text()).await.expect("a place in time");
    assert_eq!(let_in["type"], "welcome");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_visitor_beyond_the_most_waits_and_comes_in_by_itself() {
    let bench = Bench::start(|config| GatewayConfig { max_visitors: 1, ..config }).await;
    let first = bench.welcomed().await;
    let mut second = bench.visitor().await;
    second.tell(&json!({ "type": "open" })).await;
    assert_eq!(second.heard().await["stage"], "full");
    drop(first);
    assert_eq!(second.heard().await["type"], "welcome");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_page_is_served_to_its_own_names_alone() {
    let bench = Bench::start(|config| config).await;
    let (head, body) = bench.get("/", "Host: localhost\r\n").await;
    assert!(head.starts_with("HTTP/1.1 200") && head.contains("content-security-policy: default-src 'none'"), "{head}");
    assert!(String::from_utf8_lossy(&body).contains("<canvas"));
    for (path, headers, status) in [
        ("/", "Host: evil.example\r\n", 403),
        ("/api/v1/socket", "Host: localhost\r\nOrigin: http://evil.example\r\n", 403),
        ("/nothing.js", "Host: localhost\r\n", 404),
        ("/api/v1/view.gif", "Host: localhost\r\n", 404),
        ("/api/v1/view.png?eye=1,2", "Host: localhost\r\n", 400),
        ("/api/v1/view.png?size=9999x9999", "Host: localhost\r\n", 400),
        ("/api/v1/view.png?codec=lz4", "Host: localhost\r\n", 400),
        ("/api/v1/view.png?scene=none", "Host: localhost\r\n", 404),
    ] {
        let (head, body) = bench.get(path, headers).await;
        assert!(head.starts_with(&format!("HTTP/1.1 {status}")), "{path}: {head}");
        assert!(!body.is_empty() && body.len() < 300, "{path}: a sentence");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn pictures_go_on_while_the_coordinator_is_away() {
    let mut bench = Bench::start(|config| config).await;
    let mut visitor = bench.welcomed().await;
    let _ = visitor.pose(EYE, false).await;
    let picture = visitor.picture().await;
    visitor.shown(&picture).await;
    bench.0.cluster.kill_coordinator();
    let number = visitor.pose([0.3, 1.2, 3.0], false).await;
    assert_eq!(visitor.picture().await.number(), number);
}
