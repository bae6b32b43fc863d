//! Answers to requests of HTTP that several of them share: refusals, and JSON.

use std::convert::Infallible;

use axum::body::{Body, Bytes};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use serde_json::Value;
use tokio::sync::OwnedSemaphorePermit;

const CHUNK_BYTES: usize = 64 << 10;

/// The refusal of a request: a status and a sentence.
#[derive(Debug)]
pub(crate) struct Refusal(pub(crate) StatusCode, pub(crate) String);

impl Refusal {
    pub(crate) fn bad(reason: impl ToString) -> Self {
        Self(StatusCode::BAD_REQUEST, reason.to_string())
    }

    /// The cluster does not serve what is asked for.
    pub(crate) fn unserved(error: impl ToString) -> Self {
        Self(StatusCode::BAD_GATEWAY, error.to_string())
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

/// A body that keeps its place until it has been read: unread ones take memory.
pub(crate) fn held(media_type: &'static str, bytes: Bytes, place: OwnedSemaphorePermit) -> Response {
    let length = bytes.len();
    let chunks = stream::unfold((bytes, place), async |(mut rest, place)| {
        let chunk = rest.split_to(rest.len().min(CHUNK_BYTES));
        (!chunk.is_empty()).then_some((Ok::<_, Infallible>(chunk), (rest, place)))
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
