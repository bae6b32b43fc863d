//! Requests of HTTP: the page, the WebSocket of a visitor, and views, cameras and status for programs without our code.

use std::sync::Arc;

use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{Path, Request, State};
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;

use crate::assets;
use crate::compare::compare;
use crate::gateway::Gateway;
use crate::origin;
use crate::page::with_page;
use crate::protocol::{MAX_MESSAGE_BYTES, SUBPROTOCOL};
use crate::responses::Refusal;
use crate::status::{cameras, status};
use crate::views::{depth, picture, point};
use crate::visitor::serve;

/// All requests that are answered.
pub(crate) fn router(gateway: Arc<Gateway>) -> Router {
    Router::new()
        .route("/", get(async |headers: HeaderMap| assets::answer("index.html", &headers)))
        .route("/{file}", get(file))
        .route("/api/v1/socket", get(socket))
        .route("/api/v1/{picture}", get(picture))
        .route("/api/v1/depth.npy", get(depth))
        .route("/api/v1/point.json", get(point))
        .route("/api/v1/compare.json", get(compare))
        .route("/api/v1/cameras.json", get(cameras))
        .route("/api/v1/status.json", get(status))
        .layer(from_fn_with_state(gateway.clone(), admitted))
        .with_state(gateway)
}

/// Answers requests of this server's own pages and of programs, with the token where one is needed.
async fn admitted(State(gateway): State<Arc<Gateway>>, request: Request, next: Next) -> Response {
    let config = &gateway.config;
    if let Err(stranger) = origin::check(request.headers(), &config.hosts, &config.origins) {
        return Refusal(StatusCode::FORBIDDEN, stranger).into_response();
    }
    let token = config.token.as_ref();
    match token.and_then(|token| token.intercept(request.uri(), request.headers(), config.tls.is_some())) {
        Some(answer) => answer,
        None => next.run(request).await,
    }
}

async fn file(Path(name): Path<String>, headers: HeaderMap) -> Response {
    assets::answer(if name == "status" { "status.html" } else { &name }, &headers)
}

async fn socket(State(gateway): State<Arc<Gateway>>, upgrade: WebSocketUpgrade) -> Response {
    let Ok(place) = gateway.pages.clone().try_acquire_owned() else {
        return Refusal(StatusCode::SERVICE_UNAVAILABLE, "too many pages wait already".to_owned()).into_response();
    };
    let upgrade =
        upgrade.protocols([SUBPROTOCOL]).max_message_size(MAX_MESSAGE_BYTES).max_frame_size(MAX_MESSAGE_BYTES);
    upgrade.on_upgrade(|socket| async move {
        with_page(socket, &gateway, async |page| serve(page, &gateway).await).await;
        drop(place);
    })
}
