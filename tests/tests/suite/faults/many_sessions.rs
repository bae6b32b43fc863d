//! Clients that ask for too much, or for nothing. A concurrent client sees no effect.

use std::time::{Duration, Instant};

use client::{Client, ClientError};
use cluster::{PolicyChoice, SessionRequest, Timeline};
use cluster_tests::cluster::{OTHER_SCENE, offer, request, views};
use cluster_tests::watcher::{eventually, watched_request};
use tokio::task::JoinSet;
use tokio_stream::StreamExt as _;
use tonic::Code;
use wire::rpc::{CoordinatorClient, connect};

use super::CLOSED;
use super::bad_input::Beside;

/// Sessions that are opened and dropped, and the time for them.
const SESSIONS: usize = 10_000;
const WITHIN: Duration = Duration::from_secs(10);
/// Clients that open them.
const CLIENTS: usize = 16;
/// Fewer would be no test: a slow machine opens more.
const LEAST_SESSIONS: usize = 500;

async fn session_count(client: &Client) -> u64 {
    client.status().await.unwrap().session_count()
}

/// Opens sessions and drops them as soon as the coordinator has answered.
async fn open_and_drop(address: String, sessions: usize) -> usize {
    let coordinator = CoordinatorClient::new(connect(&address).await.unwrap());
    let start = Instant::now();
    for opened in 0..sessions {
        if start.elapsed() > WITHIN {
            return opened;
        }
        // Every other client waits for its number.
        match coordinator.open_session(watched_request()).await {
            Ok(mut events) if opened % 2 == 0 => drop(events.next().await),
            Ok(_) => (),
            Err(status) => assert_eq!(status.code(), Code::ResourceExhausted, "{status}"),
        }
    }
    sessions
}

#[tokio::test(flavor = "multi_thread")]
async fn thousands_of_sessions_come_and_go_unnoticed() {
    let beside = Beside::start(2).await;
    let address = &beside.cluster.coordinator.address;
    let mut clients = JoinSet::new();
    for _ in 0..CLIENTS {
        clients.spawn(open_and_drop(address.clone(), SESSIONS / CLIENTS));
    }
    let opened: usize = clients.join_all().await.into_iter().sum();
    println!("{opened} sessions");
    assert!(opened >= LEAST_SESSIONS, "{opened}");
    let end = Instant::now() + CLOSED;
    while session_count(&beside.cluster.client).await != 1 {
        assert!(Instant::now() < end, "{} sessions are left", session_count(&beside.cluster.client).await);
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    beside.finish("sessions that come and go").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_scene_that_is_not_offered_is_refused_with_the_names_of_those_that_are() {
    let beside = Beside::start(2).await;
    let elsewhere = SessionRequest { scene: Some("nowhere".to_owned()), ..watched_request() };
    let refused = beside.cluster.client.open_session(elsewhere, |_| ()).await.unwrap_err().to_string();
    for name in ["nowhere", &*offer().name, OTHER_SCENE] {
        assert!(refused.contains(name), "{name} in {refused}");
    }
    beside.finish("a scene that is not offered").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rate_that_no_cluster_keeps_is_refused() {
    let beside = Beside::start(2).await;
    for rate_hz in [1e6, 1e300] {
        let hasty = SessionRequest { frames_per_s: Some(rate_hz), ..watched_request() };
        let refused = beside.cluster.client.open_session(hasty, |_| ()).await.unwrap_err();
        assert!(refused.to_string().contains("frames_per_s"), "{refused}");
    }
    beside.finish("a rate of a million").await;
}

/// Seven workloads besides the concurrent client's: the most that a coordinator admits.
#[tokio::test(flavor = "multi_thread")]
async fn workloads_that_nobody_asks_anything_of_delay_nobody() {
    let beside = Beside::start(3).await;
    let client = &beside.cluster.client;
    let numbered = |number: u32| {
        let timeline = Timeline { start_s: 0.1 * f64::from(number), step_s: 0.0, set_count: 1 };
        request(PolicyChoice::Auto, timeline)
    };
    let mut idle = Vec::new();
    for number in 1..8 {
        idle.push(client.open_session(numbered(number), |_| ()).await.unwrap());
    }
    let refused = client.open_session(numbered(8), |_| ()).await.unwrap_err();
    assert!(matches!(&refused, ClientError::Exhausted { reason } if reason.contains("--max-workloads")), "{refused}");
    beside.watcher.calls_after(Instant::now(), 10, CLOSED).await;
    assert_eq!(idle[6].render_views(views(1, 2)).unwrap().all().await.unwrap().len(), 2, "one of them wakes up");
    beside.finish("eight workloads, seven of them idle").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn two_clients_that_force_the_same_k_share_a_plan_and_another_k_is_refused() {
    let beside = Beside::start(3).await;
    let forcing = |samplers: u32| SessionRequest {
        scene: Some(OTHER_SCENE.to_owned()),
        forced_sampler_count: Some(samplers),
        ..request(PolicyChoice::Pipeline, Timeline::still(0.5))
    };
    let client = &beside.cluster.client;
    let one = client.open_session(forcing(1), |_| ()).await.unwrap();
    let other = client.open_session(forcing(1), |_| ()).await.unwrap();
    let epoch = |session: &client::Session| session.plan().assignment.plan_epoch;
    eventually("one plan for both", CLOSED, || epoch(&one) == epoch(&other)).await;
    assert_eq!(one.plan().assignment.samplers.len(), 1);
    let refused = client.open_session(forcing(2), |_| ()).await.unwrap_err().to_string();
    assert!(refused.contains("forced_sampler_count") && refused.contains("K = 1"), "{refused}");
    for session in [&one, &other] {
        assert_eq!(session.render_views(views(1, 2)).unwrap().all().await.unwrap().len(), 2);
    }
    beside.finish("two clients that force K").await;
}
