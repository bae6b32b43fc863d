//! No stream delays another, and requests beyond a quota are refused by its name.

use std::time::{Duration, Instant};

use client::{Client, ClientError, Session};
use cluster::{DIRECT, PolicyChoice, RenderViews, SessionRequest};
use cluster_tests::cluster::{Cluster, request, whole_frame};
use cluster_tests::scalar_engine::Pace;
use codec::FrameAssembly;
use coordinator::CoordinatorConfig;
use node::{Deadlines, NodeConfig, Quotas};
use tokio::sync::mpsc;
use tokio::time::timeout;
use tokio_stream::StreamExt as _;
use tokio_stream::wrappers::ReceiverStream;
use tonic::Code;
use wire::rpc::{CompositorClient, connect};

use super::raw::{HEALED, Raw, STILL, compositor_of, greedy, narrow, pipeline, seen};

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_takes_no_frames_delays_no_other_and_is_cut_off() {
    let hasty = |config: NodeConfig| NodeConfig {
        deadlines: Deadlines { stall: Duration::from_millis(700), ..config.deadlines },
        ..config
    };
    let cluster = Cluster::start_with(1, hasty).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let (address, _) = compositor_of(&session);
    let slow = narrow(&address).await;
    let request = greedy(&session, 512, 80);
    let mut unread = slow.render_views(tokio_stream::once(request).chain(tokio_stream::pending())).await.unwrap();
    let mut live = session.live();
    let start = Instant::now();
    // A busy machine takes seconds for as many frames as the connection holds.
    for i in 0.. {
        seen(&mut live, (i % 20) as f32 * 0.01, 0).await;
        if cluster.metrics[0].streams.get() == 1 {
            break;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "it was cut off");
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    let ended = loop {
        match timeout(HEALED, unread.next()).await.expect("it was cut off").unwrap() {
            Ok(_) => (),
            Err(status) => break status,
        }
    };
    assert_eq!(ended.code(), Code::DeadlineExceeded);
    assert!(ended.message().contains("none was taken"), "{ended}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_with_thousands_of_views_does_not_starve_others() {
    let cluster = Cluster::start(1).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let (address, _) = compositor_of(&session);
    let other = CompositorClient::new(connect(&address).await.unwrap());
    let request = greedy(&session, 96, 4000);
    let mut many = other.render_views(tokio_stream::once(request)).await.unwrap();
    let bulk = tokio::spawn(async move {
        let mut count = 0;
        while let Some(part) = many.next().await {
            part.unwrap();
            count += 1;
        }
        count
    });
    let mut live = session.live();
    let mut waited = Vec::new();
    for i in 0..20 {
        let received = seen(&mut live, i as f32 * 0.01, 0).await;
        waited.push(received.decoded - received.posed);
    }
    assert!(!bulk.is_finished(), "nothing was shared: {waited:?}");
    assert_eq!(bulk.await.unwrap(), 4000);
}

/// A stream that has been admitted and takes no more frames. It is refused while the frame before it is still being
/// sent.
async fn takes_all(session: &Session, address: &str) -> impl Sized + use<> {
    loop {
        let (asks, asked) = mpsc::channel(1);
        asks.send(greedy(session, 1024, 64)).await.unwrap();
        let mut stream = narrow(address).await.render_views(ReceiverStream::new(asked)).await.unwrap();
        match timeout(HEALED, stream.next()).await.unwrap().unwrap() {
            Ok(_) => return (asks, stream),
            Err(refused) => assert_eq!(refused.code(), Code::ResourceExhausted),
        }
    }
}

/// A client requests the rest of a batch when it has some of it: by then others may have used the quota.
#[tokio::test(flavor = "multi_thread")]
async fn an_admitted_stream_waits_for_room() {
    let small = |config: NodeConfig| NodeConfig { quotas: Quotas { view_bytes: 24 << 20, ..config.quotas }, ..config };
    let cluster = Cluster::start_with(1, small).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let (address, _) = compositor_of(&session);
    let (asks, asked) = mpsc::channel(2);
    asks.send(greedy(&session, 1024, 1)).await.unwrap();
    let client = CompositorClient::new(connect(&address).await.unwrap());
    let mut let_in = client.render_views(ReceiverStream::new(asked)).await.unwrap();
    whole_frame(&mut let_in).await;
    let full = takes_all(&session, &address).await;
    // The connection takes some frames before it is full; until then, there is room now and then.
    let mut assembly = FrameAssembly::default();
    asks.send(greedy(&session, 1024, 1)).await.unwrap();
    let start = Instant::now();
    loop {
        let Ok(part) = timeout(Duration::from_millis(300), let_in.next()).await else { break };
        assert!(start.elapsed() < 4 * HEALED, "there is always room");
        if assembly.push(part.unwrap().unwrap()).unwrap().is_some() {
            asks.send(greedy(&session, 1024, 1)).await.unwrap();
        }
    }
    drop(full);
    let frame = async { while assembly.push(let_in.next().await.unwrap().unwrap()).unwrap().is_none() {} };
    timeout(HEALED, frame).await.expect("there is room");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_request_beyond_a_quota_of_a_node_is_refused_by_name() {
    let small = |config: NodeConfig| NodeConfig {
        quotas: Quotas { streams: 3, view_bytes: 24 << 20, ..config.quotas },
        ..config
    };
    let cluster = Cluster::start_with(1, small).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let (address, _) = compositor_of(&session);
    let mut live = session.live();
    seen(&mut live, 0.0, 0).await;
    let ask = async |count: u64| {
        let request = greedy(&session, 1024, count);
        narrow(&address).await.render_views(tokio_stream::once(request).chain(tokio_stream::pending())).await
    };
    // This client takes no frames, and holds the node's memory.
    let _first = ask(64).await.unwrap();
    let start = Instant::now();
    let (second, refused) = loop {
        // The stream before it keeps its place for a moment.
        let Ok(mut second) = ask(1).await else {
            assert!(start.elapsed() < HEALED, "the stream before keeps its place");
            tokio::time::sleep(Duration::from_millis(10)).await;
            continue;
        };
        match timeout(HEALED, second.next()).await.unwrap().unwrap() {
            Ok(_) => assert!(start.elapsed() < HEALED, "nothing is held"),
            Err(refused) => break (second, refused),
        }
    };
    assert_eq!(refused.code(), Code::ResourceExhausted);
    assert!(refused.message().contains("quota view-memory: 25165824"), "{refused}");
    seen(&mut live, 0.1, 0).await;
    drop(second);
    let start = Instant::now();
    let third = loop {
        match Raw::open(&address, session.plan().assignment.plan_epoch).await {
            Ok(third) => break third,
            Err(refused) => assert!(start.elapsed() < HEALED, "the second stream keeps its place: {refused}"),
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    };
    third.say(None, 0).await;
    let refused = ask(1).await.err().expect("streams are used up");
    assert_eq!(refused.code(), Code::ResourceExhausted);
    assert!(refused.message().contains("quota streams: 3"), "{refused}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_live_view_goes_to_a_node_with_room_or_names_the_quota() {
    let one = |config: NodeConfig| NodeConfig { quotas: Quotas { streams: 1, ..config.quotas }, ..config };
    let cluster = Cluster::start_with(3, one).await;
    let session = cluster.session(SessionRequest { forced_sampler_count: Some(1), ..pipeline(STILL) }).await.unwrap();
    assert_eq!(session.plan().assignment.compositors.len(), 2);
    let mut lives = vec![session.live(), session.live()];
    for live in &mut lives {
        seen(live, 0.0, 0).await;
    }
    let mut third = session.live();
    let refused = timeout(HEALED, third.next()).await.unwrap().unwrap_err();
    assert!(matches!(&refused, ClientError::Exhausted { reason } if reason.contains("quota streams")), "{refused}");
    for live in &mut lives {
        seen(live, 0.1, 0).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_beyond_the_limit_are_refused() {
    let config = CoordinatorConfig { max_sessions: 2, ..CoordinatorConfig::default() };
    let cluster = Cluster::start_limited(config, 1, |config| config).await;
    let first = cluster.session(pipeline(STILL)).await.unwrap();
    let second = cluster.session(pipeline(STILL)).await.unwrap();
    let refused = cluster.session(pipeline(STILL)).await.unwrap_err();
    assert!(matches!(&refused, ClientError::Exhausted { reason } if reason.contains("max_sessions: 2")), "{refused}");
    drop(first);
    let start = Instant::now();
    while cluster.session(pipeline(STILL)).await.is_err() {
        assert!(start.elapsed() < HEALED, "a closed session leaves its place");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    seen(&mut second.live(), 0.0, 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn two_hundred_idle_streams_delay_no_frame() {
    let cluster = Cluster::start(2).await;
    let first = cluster.session(pipeline(STILL)).await.unwrap();
    let mut idle = Vec::new();
    for _ in 0..200 {
        let client = Client::connect(&cluster.coordinator.address).await.unwrap();
        let session = client.open_session(pipeline(STILL), |_| ()).await.unwrap();
        let live = session.live();
        idle.push((session, live));
    }
    let mut live = first.live();
    for i in 0..10 {
        seen(&mut live, i as f32 * 0.01, 0).await;
    }
    // No stream was ended.
    for (_, live) in &mut idle {
        seen(live, 0.3, 0).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_view_that_is_predicted_to_take_too_long_is_refused_by_name() {
    let hasty = |config: NodeConfig| NodeConfig { max_view_s: 0.1, ..config };
    let cluster = Cluster::start_with(1, hasty).await;
    let session = cluster.session(pipeline(STILL)).await.unwrap();
    let client = CompositorClient::new(connect(&compositor_of(&session).0).await.unwrap());
    let ask = async |side_px: u32, count: u64| {
        client.render_views(tokio_stream::once(greedy(&session, side_px, count))).await.unwrap()
    };
    cluster.engines[0].keep_pace(Pace { view: Duration::from_millis(20), ..Pace::default() });
    whole_frame(&mut ask(1024, 1).await).await;
    let mut live = session.live();
    for i in 0..8 {
        seen(&mut live, i as f32 * 0.01, 0).await;
    }
    let refused = timeout(HEALED, ask(1024, 1).await.next()).await.unwrap().unwrap().unwrap_err();
    assert_eq!(refused.code(), Code::ResourceExhausted, "{refused}");
    assert!(refused.message().starts_with("max-view-s: a view of 1024x1024 by splat"), "{refused}");
    let mut many = ask(48, 20).await;
    for _ in 0..20 {
        timeout(HEALED, whole_frame(&mut many)).await.expect("none of them is long");
    }
    seen(&mut live, 0.1, 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn views_that_the_plan_itself_draws_have_no_share_of_their_own() {
    for (policy, most_views) in [(PolicyChoice::Direct, 8), (PolicyChoice::Pipeline, 1)] {
        let cluster = Cluster::start(1).await;
        let session = cluster.session(request(policy, STILL)).await.unwrap();
        let client = CompositorClient::new(connect(&compositor_of(&session).0).await.unwrap());
        let eight = RenderViews { method: DIRECT.to_owned(), ..greedy(&session, 16, 8) };
        let mut frames = client.render_views(tokio_stream::once(eight)).await.unwrap();
        let mut together = Vec::new();
        for _ in 0..8 {
            together.push(whole_frame(&mut frames).await.header.stage_times.batch_count);
        }
        assert_eq!(together.iter().max(), Some(&most_views), "{policy:?}: {together:?}");
    }
}
