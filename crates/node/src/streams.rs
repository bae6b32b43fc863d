//! Ends of streams: on drain, by deadline, and with the guards that they hold.

use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio_stream::{Stream, StreamExt as _};
use tokio_util::sync::{CancellationToken, WaitForCancellationFutureOwned};
use tonic::Status;
use wire::rpc::Messages;

struct UntilDrained<T> {
    /// `None` after the end.
    inner: Option<Messages<T>>,
    shutdown: Pin<Box<WaitForCancellationFutureOwned>>,
}

impl<T> Stream for UntilDrained<T> {
    type Item = Result<T, Status>;

    fn poll_next(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        let Some(inner) = self.inner.as_mut() else {
            return Poll::Ready(None);
        };
        if let Poll::Ready(item) = inner.as_mut().poll_next(cx) {
            return Poll::Ready(item);
        }
        if self.shutdown.as_mut().poll(cx).is_pending() {
            return Poll::Pending;
        }
        self.inner = None;
        Poll::Ready(Some(Err(Status::unavailable("shutting down"))))
    }
}

/// Ends a stream with `UNAVAILABLE` once the process shuts down, after the messages that are ready.
pub fn until_drained<T: Send + 'static>(stream: Messages<T>, shutdown: CancellationToken) -> Messages<T> {
    Box::pin(UntilDrained { inner: Some(stream), shutdown: Box::pin(shutdown.cancelled_owned()) })
}

/// A stream that drops `guard` when the peer goes away or the stream ends.
pub fn with_guard<T: Send + 'static, G: Send + 'static>(inner: Messages<T>, guard: G) -> Messages<T> {
    Box::pin(inner.map(move |message| {
        let _held = &guard;
        message
    }))
}

/// The next message; `None` at the end.
///
/// # Errors
/// The stream's own; `DEADLINE_EXCEEDED` where no message arrives in time.
pub async fn next_within<T>(stream: &mut Messages<T>, deadline: Duration, what: &str) -> Result<Option<T>, Status> {
    match tokio::time::timeout(deadline, stream.next()).await {
        Ok(next) => next.transpose(),
        Err(_) => {
            Err(Status::deadline_exceeded(format!("{what}: nothing was received for {:.1} s", deadline.as_secs_f64())))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn silent() -> Messages<u32> {
        Box::pin(tokio_stream::once(Ok(1)).chain(tokio_stream::pending()))
    }

    #[tokio::test]
    async fn a_silent_stream_ends_at_the_deadline() {
        let mut stream = silent();
        let deadline = Duration::from_millis(20);
        assert_eq!(next_within(&mut stream, deadline, "chunks").await.unwrap(), Some(1));
        let status = next_within(&mut stream, deadline, "chunks").await.unwrap_err();
        assert_eq!(status.code(), tonic::Code::DeadlineExceeded);
        assert!(status.message().contains("chunks"));
    }

    #[tokio::test]
    async fn a_drain_ends_a_stream_after_the_messages_that_are_ready() {
        let shutdown = CancellationToken::new();
        let mut stream = until_drained(silent(), shutdown.clone());
        shutdown.cancel();
        assert_eq!(stream.next().await.unwrap().unwrap(), 1);
        assert_eq!(stream.next().await.unwrap().unwrap_err().code(), tonic::Code::Unavailable);
        assert!(stream.next().await.is_none());
    }
}
