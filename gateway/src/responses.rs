//! Answers to requests of HTTP that several of them share: refusals, and JSON.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use client::Session;
use futures_util::stream;
use serde_json::Value;
use tokio::sync::OwnedSemaphorePermit;

use crate::kept_session::KeptSession;
use crate::scenes::SceneError;
use crate::stills::StillError;

/// The time that a client may take to read a body.
const BODY_WITHIN: Duration = Duration::from_secs(60);
const CHUNK_BYTES: usize = 64 << 10;
/// The longest wait for a session.
const SESSION_WITHIN: Duration = Duration::from_secs(60);

/// The refusal of a request: a status and a sentence.
#[derive(Debug)]
pub(crate) struct Refusal(pub(crate) StatusCode, pub(crate) String);

impl Refusal {
    pub(crate) fn bad(reason: impl ToString) -> Self {
        Self(StatusCode::BAD_REQUEST, reason.to_string())
    }

    pub(crate) fn internal(error: impl ToString) -> Self {
        Self(StatusCode::INTERNAL_SERVER_ERROR, error.to_string())
    }
}

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
            SceneError::Away(_) | SceneError::Invalid(_) => StatusCode::BAD_GATEWAY,
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
            StillError::Client(error @ client::ClientError::Invalid { .. }) => Self::bad(error),
            StillError::Client(error) => error.into(),
        }
    }
}

/// A session, once it is open.
pub(crate) async fn opened(kept: &KeptSession) -> Result<Arc<Session>, Refusal> {
    let late = || Refusal(StatusCode::SERVICE_UNAVAILABLE, "the scene's session is not open yet".to_owned());
    tokio::time::timeout(SESSION_WITHIN, kept.open()).await.ok().flatten().ok_or_else(late)
}

/// A body that keeps its place until it has been read: unread ones take memory. It is cut after a minute.
pub(crate) fn held(media_type: &'static str, bytes: Bytes, place: OwnedSemaphorePermit) -> Response {
    let (length, end) = (bytes.len(), Instant::now() + BODY_WITHIN);
    let chunks = stream::unfold((bytes, place), move |(mut rest, place)| async move {
        let chunk = rest.split_to(rest.len().min(CHUNK_BYTES));
        let in_time = if Instant::now() < end { Ok(chunk) } else { Err(io::Error::from(io::ErrorKind::TimedOut)) };
        let is_over = matches!(&in_time, Ok(chunk) if chunk.is_empty());
        (!is_over).then_some((in_time, (rest, place)))
    });
    let fields = [
        (header::CONTENT_TYPE, HeaderValue::from_static(media_type)),
        (header::CONTENT_LENGTH, HeaderValue::from(length)),
        (header::CACHE_CONTROL, HeaderValue::from_static("no-store")),
    ];
    (fields, Body::from_stream(chunks)).into_response()
}

pub(crate) fn as_json(value: &Value) -> Response {
    let fields = [(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")];
    (fields, format!("{value:#}\n")).into_response()
}
