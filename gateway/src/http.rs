//! Requests of HTTP: the page, the WebSocket of a visitor, and views, cameras and status for programs without our code.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, Query, Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use client::Session;
use cluster::{ClusterStatus, WorkloadStatus};
use codec::{FrameCodec, encode_frame};
use depth_image::{Camera, PinholeCamera};
use glam::{DVec3, UVec2};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::assets;
use crate::camera::PageCamera;
use crate::gateway::Gateway;
use crate::origin;
use crate::protocol::{MAX_MESSAGE_BYTES, SUBPROTOCOL};
use crate::scenes::{SceneError, SceneSession, SessionState};
use crate::stills::StillError;
use crate::visitor::visit;

/// The longest wait for a session.
const SESSION_WITHIN: Duration = Duration::from_secs(60);
/// The size of a view that names none.
const SIZE_PX: UVec2 = UVec2::new(640, 360);
/// The JPEG quality of views.
const QUALITY: u8 = 90;

/// The refusal of a request: a status and a sentence.
struct Refusal(StatusCode, String);

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        let fields = [(header::CONTENT_TYPE, "text/plain; charset=utf-8"), (header::CACHE_CONTROL, "no-store")];
        (self.0, fields, self.1 + "\n").into_response()
    }
}

impl From<SceneError> for Refusal {
    fn from(error: SceneError) -> Self {
        let status = match error {
            SceneError::Unknown { .. } => StatusCode::NOT_FOUND,
            SceneError::Away(_) => StatusCode::BAD_GATEWAY,
        };
        Self(status, error.to_string())
    }
}

impl From<client::ClientError> for Refusal {
    fn from(error: client::ClientError) -> Self {
        Self(StatusCode::BAD_GATEWAY, error.to_string())
    }
}

impl From<StillError> for Refusal {
    fn from(error: StillError) -> Self {
        match error {
            StillError::Full => Self(StatusCode::TOO_MANY_REQUESTS, error.to_string()),
            StillError::Client(error @ client::ClientError::Invalid { .. }) => bad(error),
            StillError::Client(error) => error.into(),
        }
    }
}

fn bad(reason: impl ToString) -> Refusal {
    Refusal(StatusCode::BAD_REQUEST, reason.to_string())
}

/// All requests that are answered.
pub(crate) fn router(gateway: Arc<Gateway>) -> Router {
    Router::new()
        .route("/", get(|headers: HeaderMap| async move { assets::answer("index.html", &headers) }))
        .route("/{file}", get(file))
        .route("/api/v1/socket", get(socket))
        .route("/api/v1/{picture}", get(picture))
        .route("/api/v1/cameras.json", get(cameras))
        .route("/api/v1/status.json", get(status))
        .layer(from_fn_with_state(gateway.clone(), known_origin))
        .with_state(gateway)
}

async fn known_origin(State(gateway): State<Arc<Gateway>>, request: Request, next: Next) -> Response {
    match origin::check(request.headers(), &gateway.config.hosts, &gateway.config.origins) {
        Ok(()) => next.run(request).await,
        Err(stranger) => Refusal(StatusCode::FORBIDDEN, stranger.to_string()).into_response(),
    }
}

async fn file(Path(name): Path<String>, headers: HeaderMap) -> Response {
    assets::answer(&name, &headers)
}

async fn socket(State(gateway): State<Arc<Gateway>>, upgrade: WebSocketUpgrade) -> Response {
    let Ok(place) = gateway.pages.clone().try_acquire_owned() else {
        return Refusal(StatusCode::SERVICE_UNAVAILABLE, "too many pages wait already".to_owned()).into_response();
    };
    let upgrade =
        upgrade.protocols([SUBPROTOCOL]).max_message_size(MAX_MESSAGE_BYTES).max_frame_size(MAX_MESSAGE_BYTES);
    upgrade.on_upgrade(|socket| async move {
        visit(socket, gateway).await;
        drop(place);
    })
}

/// One view.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ViewQuery {
    scene: Option<String>,
    eye: Option<String>,
    target: Option<String>,
    fov: Option<f64>,
    size: Option<String>,
}

impl ViewQuery {
    fn camera(&self, scene: &SceneSession, max_px: UVec2) -> Result<PinholeCamera, Refusal> {
        let point = |field: &str, text: &Option<String>, home: [f64; 3]| match text {
            None => Ok(home),
            Some(text) => three_numbers(text).ok_or_else(|| bad(format!("{field}: {text:?}, must be X,Y,Z"))),
        };
        let page = PageCamera {
            eye: point("eye", &self.eye, scene.home.eye)?,
            target: point("target", &self.target, scene.home.target)?,
            fov_y_deg: self.fov.unwrap_or(scene.home.fov_y_deg),
        };
        let size_px = match &self.size {
            None => SIZE_PX,
            Some(text) => size(text).ok_or_else(|| bad(format!("size: {text:?}, must be WIDTHxHEIGHT")))?,
        };
        if size_px.cmpgt(max_px).any() {
            return Err(bad(format!("size: {}x{} is above {}x{}", size_px.x, size_px.y, max_px.x, max_px.y)));
        }
        scene.space.camera(&page, size_px).map_err(bad)
    }
}

fn three_numbers(text: &str) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|number| number.trim().parse().ok()).collect();
    numbers?.try_into().ok()
}

fn size(text: &str) -> Option<UVec2> {
    let (width, height) = text.split_once('x')?;
    Some(UVec2::new(width.parse().ok()?, height.parse().ok()?))
}

/// The session of a scene, once it is open.
async fn session_of(scene: &SceneSession) -> Result<Arc<Session>, Refusal> {
    let mut states = scene.states();
    let open = async {
        loop {
            if let SessionState::Open(session) = &*states.borrow_and_update() {
                return Some(session.clone());
            }
            states.changed().await.ok()?;
        }
    };
    let late = || Refusal(StatusCode::SERVICE_UNAVAILABLE, "the scene's session is not open yet".to_owned());
    tokio::time::timeout(SESSION_WITHIN, open).await.ok().flatten().ok_or_else(late)
}

async fn picture(
    State(gateway): State<Arc<Gateway>>,
    Path(name): Path<String>,
    Query(query): Query<ViewQuery>,
) -> Result<Response, Refusal> {
    let (codec, media_type) = match name.as_str() {
        "view.png" => (FrameCodec::Png, "image/png"),
        "view.jpg" => (FrameCodec::Jpeg { quality: QUALITY }, "image/jpeg"),
        _ => return Err(Refusal(StatusCode::NOT_FOUND, "the pictures are view.png and view.jpg".to_owned())),
    };
    let scene = gateway.scenes.visit(query.scene.as_deref()).await?;
    let camera = query.camera(&scene, gateway.config.max_still_px)?;
    let session = session_of(&scene).await?;
    let view = gateway.stills.view(&session, camera).await?;
    let encode = move || encode_frame(codec, view.size_px, &view.srgb8);
    let internal = |error: &dyn ToString| Refusal(StatusCode::INTERNAL_SERVER_ERROR, error.to_string());
    let encoded = tokio::task::spawn_blocking(encode).await.map_err(|error| internal(&error))?;
    let encoded = encoded.map_err(|error| internal(&error))?;
    Ok(([(header::CONTENT_TYPE, media_type), (header::CACHE_CONTROL, "no-store")], encoded).into_response())
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneQuery {
    scene: Option<String>,
}

/// The sample cameras of a scene's plan, as a `transforms.json` has them.
async fn cameras(State(gateway): State<Arc<Gateway>>, Query(query): Query<SceneQuery>) -> Result<Response, Refusal> {
    let scene = gateway.scenes.visit(query.scene.as_deref()).await?;
    let session = session_of(&scene).await?;
    let origin = scene.offer.origin_in_source;
    let cameras = session.plan().assignment.workload.sample_cameras;
    let frames: Vec<Value> = cameras.iter().map(|Camera::Pinhole(camera)| frame(camera, origin)).collect();
    Ok(as_json(&json!({ "camera_model": "PINHOLE", "frames": frames })))
}

fn frame(camera: &PinholeCamera, origin_in_source: DVec3) -> Value {
    let axes = glam::DMat3::from_quat(camera.world_from_camera.as_dquat().normalize());
    let eye = camera.eye_in_world.as_dvec3() + origin_in_source;
    let row = |i: usize| json!([axes.x_axis[i], axes.y_axis[i], axes.z_axis[i], eye[i]]);
    json!({
        "w": camera.size_px.x, "h": camera.size_px.y,
        "fl_x": camera.focal_px.x, "fl_y": camera.focal_px.y,
        "cx": camera.principal_px.x, "cy": camera.principal_px.y,
        "transform_matrix": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]],
    })
}

async fn status(State(gateway): State<Arc<Gateway>>) -> Result<Response, Refusal> {
    let status = gateway.scenes.client().await?.status().await?;
    let visitors = gateway.config.max_visitors - gateway.visitors.available_permits();
    Ok(as_json(&described(&status, visitors)))
}

fn as_json(value: &Value) -> Response {
    let fields = [(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")];
    (fields, format!("{value:#}\n")).into_response()
}

fn described(status: &ClusterStatus, visitors: usize) -> Value {
    let nodes: Vec<Value> =
        status.nodes.iter().map(|node| json!({ "name": node.node_name, "device": node.device_name })).collect();
    let scenes: Vec<&str> = status.offers.iter().map(|offer| offer.name.as_str()).collect();
    let workloads: Vec<Value> = status.workloads.iter().map(workload).collect();
    json!({
        "version": assets::VERSION, "visitors": visitors, "plan_epoch": status.plan_epoch,
        "nodes": nodes, "scenes": scenes, "workloads": workloads,
    })
}

fn workload(workload: &WorkloadStatus) -> Value {
    let plan = workload.plan.as_ref().map(|plan| {
        let assignment = &plan.assignment;
        let samplers: Vec<&str> = assignment.samplers.iter().map(|share| share.node_name.as_str()).collect();
        let compositors: Vec<&str> = assignment.compositors.iter().map(|share| share.node_name.as_str()).collect();
        json!({
            "epoch": assignment.plan_epoch, "policy": assignment.policy.to_string(), "reason": plan.reason,
            "samplers": samplers, "compositors": compositors, "cells": assignment.workload.cell_count(),
        })
    });
    json!({
        "number": workload.number, "sessions": workload.session_count, "viewers": workload.viewer_count,
        "views_per_set": workload.views_per_set, "utilisation": workload.utilisation, "plan": plan,
    })
}
