//! Faulty requests are refused by name, and the cluster survives them.
#![allow(clippy::unwrap_used)]

use std::time::Duration;

use client::{ClientError, Session};
use cluster::{FetchImages, PolicyChoice, RenderViews, RequestedView, Timeline};
use cluster_tests::cluster::{Cluster, request, rig, views};
use codec::FrameCodec;
use depth_image::Camera;
use node::{Deadlines, NodeConfig};
use tokio_stream::StreamExt as _;
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
    let Camera::Pinhole(camera) = rig()[0];
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
async fn replaced_and_unknown_plans_are_refused_by_every_service() {
    let cluster = Cluster::start(2).await;
    let session = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    let old_plan = session.plan().assignment;
    let new_plan = cluster::Assignment { plan_epoch: old_plan.plan_epoch + 1, ..old_plan.clone() };
    let (compositor, sampler) = (&old_plan.compositors[0].address, &old_plan.samplers[0]);
    let node = NodeClient::new(connect(compositor).await.unwrap());
    node.apply_assignment(new_plan.clone()).await.unwrap();
    let old_request = raw_request(&session);
    let new_request = RenderViews { plan_epoch: new_plan.plan_epoch, ..old_request.clone() };
    assert_eq!(ask(compositor, new_request).await.unwrap(), 1);
    let refused = ask(compositor, old_request).await.unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition, "{refused}");
    assert!(refused.message().contains("plan_epoch 1 is not in force"), "{refused}");
    let refused = node.apply_assignment(old_plan.clone()).await.unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition);
    let again = node.apply_assignment(new_plan.clone()).await.unwrap().plan_epoch;
    assert_eq!(again, new_plan.plan_epoch, "the same again is no change");
    let sampling = SamplerClient::new(connect(&sampler.address).await.unwrap());
    let fetch = FetchImages {
        plan_epoch: new_plan.plan_epoch + 100,
        workload_number: old_plan.workload_number,
        set_index: 0,
        cell: 0,
        image_indices: sampler.image_indices.clone(),
    };
    assert_eq!(sampling.fetch_sample_images(fetch).await.err().unwrap().code(), Code::FailedPrecondition);
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_of_two_workloads_are_served_side_by_side() {
    let cluster = Cluster::start(3).await;
    let first = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    // The steps of refinement are part of a workload.
    let other = cluster::SessionRequest { refinement_steps: 2, ..request(PolicyChoice::Auto, MOVING) };
    let second = cluster.session(other).await.unwrap();
    let number = |session: &Session| session.plan().assignment.workload_number;
    assert_ne!(number(&first), number(&second));
    for session in [&first, &second, &first] {
        assert_eq!(frames(session, 8).await, 8);
    }
    assert_eq!((first.ended(), second.ended()), (None, None));
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_that_differ_in_codec_or_method_share_a_workload() {
    let cluster = Cluster::start(3).await;
    let first = cluster.session(request(PolicyChoice::Pipeline, MOVING)).await.unwrap();
    let jpeg = cluster::SessionRequest { codec: "jpeg:85".to_owned(), ..request(PolicyChoice::Pipeline, MOVING) };
    let direct = cluster::SessionRequest { method: cluster::DIRECT.to_owned(), ..request(PolicyChoice::Auto, MOVING) };
    for asked in [jpeg, direct] {
        let other = cluster.session(asked).await.unwrap();
        let numbers = [&first, &other].map(|session| session.plan().assignment.workload_number);
        assert_eq!(numbers[0], numbers[1]);
        assert_eq!(frames(&other, 8).await, 8);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_workload_beyond_the_limit_is_refused_by_the_limits_name() {
    let cluster = Cluster::start(2).await;
    let mut open = Vec::new();
    for refinement_steps in 1..=8 {
        let asked = cluster::SessionRequest { refinement_steps, ..request(PolicyChoice::Auto, MOVING) };
        open.push(cluster.session(asked).await.unwrap());
    }
    let ninth = cluster::SessionRequest { refinement_steps: 9, ..request(PolicyChoice::Auto, MOVING) };
    let refused = cluster.session(ninth).await.unwrap_err();
    assert!(matches!(&refused, ClientError::Exhausted { .. }), "{refused}");
    assert!(refused.to_string().contains("--max-workloads"), "{refused}");
    for session in &open {
        assert_eq!(frames(session, 2).await, 2);
    }
}

/// The number of frames that come of `per_set` views of one set.
async fn frames(session: &Session, per_set: u32) -> usize {
    let mut incoming = session.render_views(views(1, per_set)).unwrap();
    let mut count = 0;
    while let Some(frame) = incoming.next().await {
        frame.unwrap();
        count += 1;
    }
    count
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

#[tokio::test]
async fn another_address_than_loopback_needs_a_flag() {
    let listener = tokio::net::TcpListener::bind("0.0.0.0:0").await.unwrap();
    let engine = std::sync::Arc::new(cluster_tests::scalar_engine::ScalarEngine::default());
    let refused = node_host::serve(
        listener,
        NodeConfig::new("n", "http://127.0.0.1:1"),
        engine,
        node::NodeMetrics::default(),
        tokio_util::sync::CancellationToken::new(),
    )
    .await;
    assert!(matches!(refused, Err(node::ServeError::NotLoopback { .. })));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_without_nodes_is_refused() {
    let cluster = Cluster::start(0).await;
    let error = cluster.session(request(PolicyChoice::Auto, MOVING)).await.unwrap_err().to_string();
    assert!(error.contains("no node has joined"), "{error}");
}
