//! Faulty requests are refused by name, and the cluster survives them.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use client::{ClientError, Session};
use cluster::{Assignment, FetchImages, PolicyChoice, RenderViews, RequestedView, Timeline};
use cluster_tests::cluster::{Cluster, plan_alone, request, rig, views};
use cluster_tests::scalar_engine::ScalarEngine;
use codec::FrameCodec;
use node::{Deadlines, EngineError, NodeConfig, NodeMetrics, OpenEngine, ServeError};
use tokio_stream::StreamExt as _;
use tokio_util::sync::CancellationToken;
use tonic::Code;
use wire::rpc::{CompositorClient, NodeClient, SamplerClient, connect};

const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 1.0, set_count: 3 };

/// Sends one request on its own stream; returns how it ends.
async fn ask(address: &str, request: RenderViews) -> Result<usize, tonic::Status> {
    let client = CompositorClient::new(connect(address).await?);
    let mut parts = client.render_views(tokio_stream::iter([request])).await?;
    let mut count = 0;
    while let Some(part) = parts.next().await {
        part?;
        count += 1;
    }
    Ok(count)
}

fn raw_request(session: &Session) -> RenderViews {
    let camera = *rig()[0].reference();
    RenderViews {
        plan_epoch: session.plan().assignment.plan_epoch,
        workload_number: session.plan().assignment.workload_number,
        set_index: 0,
        method: "splat".to_owned(),
        codec: FrameCodec::Lz4,
        planes: depth_image::ViewPlanes::default(),
        views: vec![RequestedView { frame: 1, camera }],
        live: None,
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn replaced_plans_are_refused_by_every_service() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    let old = session.plan().assignment;
    let new = Assignment { plan_epoch: old.plan_epoch + 10, ..old.clone() };
    let compositor = &old.compositors[0].address;
    let node = NodeClient::new(connect(compositor).await.unwrap());
    let good = raw_request(&session);
    assert_eq!(ask(compositor, good.clone()).await.unwrap(), 1);
    node.apply_assignment(plan_alone(new.clone())).await.unwrap();
    let refused = ask(compositor, good.clone()).await.unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition, "{refused}");
    let replaced = format!("plan_epoch {} of workload {} is not in force", old.plan_epoch, old.workload_number);
    assert!(refused.message().contains(&replaced), "{refused}");
    assert_eq!(wire::plan_in_force(&refused), Some(new.clone()), "the refusal names the plan in force");
    let followed = RenderViews { plan_epoch: new.plan_epoch, ..good };
    assert_eq!(ask(compositor, followed).await.unwrap(), 1);
    let refused = node.apply_assignment(plan_alone(old.clone())).await.unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition, "{refused}");
    assert_eq!(
        node.apply_assignment(plan_alone(new.clone())).await.unwrap().plan_epoch,
        new.plan_epoch,
        "the same again is no change"
    );
    let share = &old.samplers[0];
    let sampler = SamplerClient::new(connect(&share.address).await.unwrap());
    let unknown = FetchImages {
        plan_epoch: new.plan_epoch + 10,
        workload_number: old.workload_number,
        set_index: 0,
        cell: 0,
        image_indices: share.image_indices.clone(),
    };
    assert_eq!(sampler.fetch_sample_images(unknown).await.err().unwrap().code(), Code::FailedPrecondition);
}

#[tokio::test(flavor = "multi_thread")]
async fn bad_requests_are_refused_by_field() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    let compositor = session.plan().assignment.compositors[0].address.clone();
    let good = raw_request(&session);
    let bad = [
        (RenderViews { method: "nonsense".to_owned(), ..good.clone() }, "nonsense is unknown"),
        (RenderViews { set_index: 3, ..good.clone() }, "set_index 3"),
        (RenderViews { views: vec![good.views[0]; 4097], ..good.clone() }, "views has 4097"),
        (RenderViews { views: Vec::new(), ..good.clone() }, "views is missing"),
        (with_camera(&good, |camera| camera.eye_in_world.x = f32::NAN), "eye_in_world"),
        (with_camera(&good, |camera| camera.size_px = glam::UVec2::splat(65_535)), "size_px"),
    ];
    for (request, reason) in bad {
        let refused = ask(&compositor, request).await.unwrap_err();
        assert_eq!(refused.code(), Code::InvalidArgument, "{refused}");
        assert!(refused.message().contains(reason), "{refused}");
    }
    let too_long = RenderViews { views: vec![good.views[0]; 100_000], ..good.clone() };
    assert!(ask(&compositor, too_long).await.is_err(), "more than a message may hold");
    assert_eq!(ask(&compositor, good.clone()).await.unwrap(), 1, "the node goes on");
}

#[tokio::test(flavor = "multi_thread")]
async fn bad_sessions_are_refused_by_field() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    let share = &session.plan().assignment.samplers[0];
    let sampler = SamplerClient::new(connect(&share.address).await.unwrap());
    let fetch = FetchImages {
        plan_epoch: session.plan().assignment.plan_epoch,
        workload_number: session.plan().assignment.workload_number,
        set_index: 0,
        cell: 0,
        image_indices: vec![77],
    };
    assert!(sampler.fetch_sample_images(fetch).await.err().unwrap().message().contains("image_indices: 77"));
    assert!(matches!(session.render_views(views(4, 1)), Err(ClientError::Invalid { field: "set_index", .. })));
    let unknown = cluster::SessionRequest { lighting: "moonlight".to_owned(), ..request(PolicyChoice::Auto, MOVING) };
    let error = cluster.session(unknown).await.unwrap_err().to_string();
    assert!(error.contains("lighting: moonlight is unknown"), "{error}");
    let patient = cluster::SessionRequest { refinement_steps: 65, ..request(PolicyChoice::Auto, MOVING) };
    let error = cluster.session(patient).await.unwrap_err().to_string();
    assert!(error.contains("refinement_step_count is 65"), "{error}");
    let elsewhere = cluster::SessionRequest { scene: Some("other".to_owned()), ..request(PolicyChoice::Auto, MOVING) };
    assert!(
        cluster.session(elsewhere).await.unwrap_err().to_string().contains("scene: other is not on offer; ball are")
    );
}

fn with_camera(good: &RenderViews, change: impl Fn(&mut depth_image::PinholeCamera)) -> RenderViews {
    let mut request = good.clone();
    change(&mut request.views[0].camera);
    request
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drain_ends_open_streams_in_time() {
    let mut cluster = Cluster::start(2).await;
    let session = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    let compositor = session.plan().assignment.compositors[0].address.clone();
    let client = CompositorClient::new(connect(&compositor).await.unwrap());
    let requests = tokio_stream::once(raw_request(&session)).chain(tokio_stream::pending());
    let mut parts = client.render_views(requests).await.unwrap();
    parts.next().await.unwrap().unwrap();
    let mut node = cluster.nodes.pop().unwrap();
    let (took, end) = tokio::join!(node.drain(), parts.next());
    assert!(took < Duration::from_secs(10), "{took:?}");
    assert_eq!(end.unwrap().unwrap_err().code(), Code::Unavailable);
    let took = cluster.coordinator.drain().await;
    assert!(took < Duration::from_secs(10), "{took:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_idle_stream_ends_at_its_deadline() {
    let hasty = |config: NodeConfig| NodeConfig {
        deadlines: Deadlines { idle: Duration::from_millis(200), ..config.deadlines },
        ..config
    };
    let cluster = Cluster::start_with(1, hasty).await;
    let session = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    let client = CompositorClient::new(connect(&session.plan().assignment.compositors[0].address).await.unwrap());
    let mut parts =
        client.render_views(tokio_stream::once(raw_request(&session)).chain(tokio_stream::pending())).await.unwrap();
    parts.next().await.unwrap().unwrap();
    assert_eq!(parts.next().await.unwrap().unwrap_err().code(), Code::DeadlineExceeded);
}

async fn served_at(address: &str, open: OpenEngine) -> Result<(), ServeError> {
    let listener = tokio::net::TcpListener::bind(address).await.unwrap();
    let deadlines = Deadlines { away: Duration::from_millis(1), ..Deadlines::default() };
    let config = NodeConfig { deadlines, ..NodeConfig::new("n", "http://127.0.0.1:1") };
    node_host::serve(listener, config, open, NodeMetrics::default(), CancellationToken::new()).await
}

#[tokio::test]
async fn another_address_than_loopback_needs_a_flag() {
    let refused = served_at("0.0.0.0:0", Arc::new(|| Ok(Arc::new(ScalarEngine::default())))).await;
    assert!(matches!(refused, Err(ServeError::NotLoopback { .. })));
}

#[tokio::test]
async fn a_node_without_a_device_ends_after_three_attempts() {
    let attempts = Arc::new(AtomicUsize::new(0));
    let counted = attempts.clone();
    let none = move || {
        counted.fetch_add(1, Ordering::Relaxed);
        Err(EngineError::Device("none".to_owned()))
    };
    let ended = served_at("127.0.0.1:0", Arc::new(none)).await;
    assert!(matches!(ended, Err(ServeError::Device(_))), "{ended:?}");
    assert_eq!(attempts.load(Ordering::Relaxed), 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_without_nodes_is_refused() {
    let cluster = Cluster::start(0).await;
    let error = cluster.session(request(PolicyChoice::Auto, MOVING)).await.unwrap_err().to_string();
    assert!(error.contains("no node has joined"), "{error}");
}
