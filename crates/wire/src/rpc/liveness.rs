//! Streams that stay open show that they are alive. Keepalive notices a lost connection; a flipped bit of a stream's number or
//! of a message's length leaves the connection good, and one stream of it silent for ever.

use std::future::Future as _;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::time::{Instant, Sleep, interval_at, sleep};
use tokio_stream::{Stream, StreamExt as _};
use tonic::Status;
use tonic::body::Body;
use tonic::codegen::http::{Request, Response};
use tonic::codegen::{BoxFuture, Bytes, Service};
use tonic::transport::{Channel, Error};

use super::{KEEPALIVE_INTERVAL, KEEPALIVE_TIMEOUT};

/// A server's stream without another message sends an empty one after this time, again and again.
const SIGN_INTERVAL: Duration = Duration::from_secs(3);
/// An answer that is silent for this long has failed: the time after which keepalive gives up a connection.
pub(super) const SILENCE: Duration = KEEPALIVE_INTERVAL.saturating_add(KEEPALIVE_TIMEOUT);
/// Bytes that a message must grow by within [`SILENCE`]: far less than the slowest link carries, more than the empty messages
/// that a corrupt length swallows.
const GROWTH_BYTES: usize = 256;
/// Bytes before each message: whether it is compressed, and its length.
const PREFIX_BYTES: usize = 5;

/// A server's stream, with empty messages where it is silent otherwise.
pub(super) fn with_signs<P: Default + Send + 'static>(
    stream: impl Stream<Item = Result<P, Status>> + Send + 'static,
) -> impl Stream<Item = Result<P, Status>> + Send + 'static {
    let signs = interval_at(Instant::now() + SIGN_INTERVAL, SIGN_INTERVAL);
    stream.timeout_repeating(signs).map(|next| next.unwrap_or_else(|_| Ok(P::default())))
}

/// A client's stream, without the empty messages. No other message of a stream is empty: each names its scenes, its event or its
/// bytes.
pub(super) fn without_signs<P: Default + PartialEq + Send + 'static>(
    stream: impl Stream<Item = Result<P, Status>> + Send + 'static,
) -> impl Stream<Item = Result<P, Status>> + Send + 'static {
    stream.filter(|message| !matches!(message, Ok(message) if *message == P::default()))
}

fn silent() -> Status {
    Status::unavailable(format!("nothing was received for {} s", SILENCE.as_secs()))
}

/// The answer of a call that a server begins at once; `UNAVAILABLE` where it does not.
pub(super) async fn begun<T>(call: impl Future<Output = Result<T, Status>>) -> Result<T, Status> {
    tokio::time::timeout(SILENCE, call).await.unwrap_or_else(|_| Err(silent()))
}

/// A connection whose answers fail with `UNAVAILABLE` once they are silent.
#[derive(Debug, Clone)]
pub struct WatchedChannel(pub(super) Channel);

impl Service<Request<Body>> for WatchedChannel {
    type Response = Response<WatchedBody>;
    type Error = Error;
    type Future = BoxFuture<Self::Response, Error>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Error>> {
        self.0.poll_ready(context)
    }

    fn call(&mut self, request: Request<Body>) -> Self::Future {
        let answer = self.0.call(request);
        Box::pin(async move { Ok(answer.await?.map(WatchedBody::new)) })
    }
}

/// The messages of an answer.
#[derive(Debug)]
pub struct WatchedBody {
    body: Body,
    progress: Progress,
    silence: Pin<Box<Sleep>>,
}

impl WatchedBody {
    fn new(body: Body) -> Self {
        Self { body, progress: Progress::default(), silence: Box::pin(sleep(SILENCE)) }
    }
}

impl http_body::Body for WatchedBody {
    type Data = Bytes;
    type Error = Status;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<http_body::Frame<Bytes>, Status>>> {
        let next = Pin::new(&mut self.body).poll_frame(context);
        if let Poll::Ready(Some(Ok(frame))) = &next
            && frame.data_ref().is_some_and(|bytes| self.progress.add(bytes))
        {
            self.silence.as_mut().reset(Instant::now() + SILENCE);
        }
        match next {
            Poll::Pending => self.silence.as_mut().poll(context).map(|()| Some(Err(silent()))),
            ready => ready,
        }
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }
}

/// How far the present message has been received.
#[derive(Debug, Default)]
struct Progress {
    prefix: [u8; PREFIX_BYTES],
    /// Bytes of the prefix that have been received.
    prefixed: usize,
    /// Bytes of the message that are missing, once its prefix is whole.
    missing: usize,
    /// Bytes since the last progress.
    grown: usize,
}

impl Progress {
    /// Counts received bytes; whether a message has ended or grown by enough.
    fn add(&mut self, mut bytes: &[u8]) -> bool {
        self.grown += bytes.len();
        let mut advances = self.grown >= GROWTH_BYTES;
        while !bytes.is_empty() {
            bytes = self.add_to_prefix(bytes);
            let taken = bytes.len().min(self.missing);
            bytes = &bytes[taken..];
            self.missing -= taken;
            if self.prefixed == PREFIX_BYTES && self.missing == 0 {
                self.prefixed = 0;
                advances = true;
            }
        }
        if advances {
            self.grown = 0;
        }
        advances
    }

    /// Gives the bytes that are of the message.
    fn add_to_prefix<'b>(&mut self, bytes: &'b [u8]) -> &'b [u8] {
        let taken = bytes.len().min(PREFIX_BYTES - self.prefixed);
        if taken == 0 {
            return bytes;
        }
        self.prefix[self.prefixed..][..taken].copy_from_slice(&bytes[..taken]);
        self.prefixed += taken;
        if self.prefixed == PREFIX_BYTES {
            let [_, a, b, c, d] = self.prefix;
            self.missing = u32::from_be_bytes([a, b, c, d]) as usize;
        }
        &bytes[taken..]
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use http_body::{Body as _, Frame};
    use tokio::sync::mpsc;
    use tokio_stream::wrappers::ReceiverStream;

    use super::*;

    /// Receives an answer in pieces. Each piece comes with the delay before it, in ms. `None`: the answer ends well.
    async fn failure_of(pieces: &'static [(u64, &'static [u8])]) -> Option<Status> {
        struct Pieces(ReceiverStream<Bytes>);
        impl http_body::Body for Pieces {
            type Data = Bytes;
            type Error = Infallible;

            fn poll_frame(
                mut self: Pin<&mut Self>,
                context: &mut Context<'_>,
            ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
                Pin::new(&mut self.0).poll_next(context).map(|next| next.map(|bytes| Ok(Frame::data(bytes))))
            }
        }
        let (send, receive) = mpsc::channel(1);
        tokio::spawn(async move {
            for &(after_ms, bytes) in pieces {
                sleep(Duration::from_millis(after_ms)).await;
                let _ = send.send(Bytes::from_static(bytes)).await;
            }
        });
        let mut body = WatchedBody::new(Body::new(Pieces(ReceiverStream::new(receive))));
        while let Some(next) = std::future::poll_fn(|context| Pin::new(&mut body).poll_frame(context)).await {
            if let Err(status) = next {
                return Some(status);
            }
        }
        None
    }

    const EMPTY: &[u8] = &[0; PREFIX_BYTES];

    #[tokio::test(start_paused = true)]
    async fn an_answer_without_a_message_fails_after_10_s() {
        assert_eq!(failure_of(&[(9_000, EMPTY), (9_000, EMPTY), (9_000, &[])]).await.map(|status| status.code()), None);
        let start = Instant::now();
        let silent = failure_of(&[(9_000, EMPTY), (11_000, EMPTY)]).await.expect("silent for 11 s");
        assert_eq!((silent.code(), start.elapsed().as_secs()), (tonic::Code::Unavailable, 19), "{silent}");
    }

    /// A corrupt length swallows the signs of life; they must not keep the answer waiting.
    #[tokio::test(start_paused = true)]
    async fn a_message_that_stops_fails_although_signs_of_life_are_received() {
        const BEGUN: &[u8] = &[0, 0, 1, 0, 0, 7, 7];
        let failed = failure_of(&[(0, BEGUN), (3_000, EMPTY), (3_000, EMPTY), (3_000, EMPTY), (3_000, EMPTY)]).await;
        assert!(failed.is_some());
    }

    /// A link of a few hundred bytes per second is slow, not silent.
    #[tokio::test(start_paused = true)]
    async fn a_message_that_grows_does_not_fail() {
        const PIECE: &[u8] = &[7; 400];
        assert!(failure_of(&[(0, &[0, 0, 0, 8, 0]), (8_000, PIECE), (8_000, PIECE), (8_000, PIECE)]).await.is_none());
    }

    #[tokio::test(start_paused = true)]
    async fn signs_are_sent_while_nothing_else_is_and_removed_again() {
        let (send, receive) = mpsc::channel(1);
        tokio::spawn(async move {
            sleep(Duration::from_secs(7)).await;
            let _ = send.send(Ok(String::from("late"))).await;
        });
        let sent: Vec<_> = with_signs(ReceiverStream::new(receive)).map(Result::unwrap).collect().await;
        assert_eq!(sent, ["", "", "late"]);
        let received: Vec<_> = without_signs(tokio_stream::iter(sent.into_iter().map(Ok))).collect().await;
        assert_eq!(received.len(), 1);
    }

    #[test]
    fn messages_end_wherever_pieces_do() {
        let messages = [&[0, 0, 0, 0, 3, 1, 2, 3][..], &[0, 0, 0, 0, 0], &[0, 0, 0, 0, 1, 9]].concat();
        for size in 1..=messages.len() {
            let mut progress = Progress::default();
            let ends = messages.chunks(size).filter(|piece| progress.add(piece)).count();
            assert_eq!((progress.prefixed, progress.missing), (0, 0), "pieces of {size} bytes");
            assert!((1..=3).contains(&ends), "{ends}");
        }
    }
}
