//! Finished frames of one stream on their way out.
//!
//! Frames wait here, not in the transport, until the client takes them. A client that takes none delays nobody but itself,
//! and its frames can be dropped.

use std::collections::VecDeque;
use std::iter::Peekable;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

use bytes::Bytes;
use codec::{FrameHeader, FramePart};
use node::NodeMetrics;
use parking_lot::Mutex;
use tokio::sync::OwnedSemaphorePermit;
use tokio_stream::Stream;
use tokio_util::sync::CancellationToken;
use tonic::Status;

use crate::quota::Credit;

/// An encoded frame.
pub(crate) struct Output {
    pub(crate) frame: u64,
    pub(crate) header: FrameHeader,
    pub(crate) data: Bytes,
    /// The arrival of its request.
    pub(crate) arrived: Instant,
    pub(crate) credit: Credit,
}

/// The frame that is being sent.
struct Current {
    frame: u64,
    parts: Peekable<Box<dyn Iterator<Item = FramePart> + Send>>,
    credit: Credit,
}

#[derive(Default)]
struct State {
    ready: VecDeque<Output>,
    current: Option<Current>,
    /// Frames of a live stream that were sent and not acknowledged.
    unacknowledged: VecDeque<(u64, OwnedSemaphorePermit)>,
    /// Whether numbers must rise and frames are acknowledged.
    is_live: bool,
    /// The last frame that was begun.
    last: u64,
    /// The time since which frames wait for the client.
    untaken_since: Option<Instant>,
    /// The end of the stream, once all has been sent.
    end: Option<Result<(), Status>>,
    waker: Option<Waker>,
}

/// The outbox of one stream, shared by the makers of frames and the response that sends them.
pub(crate) struct Outbox {
    /// The number of the stream in logs.
    pub(crate) stream: u64,
    metrics: NodeMetrics,
    state: Mutex<State>,
    /// Cancelled when the client leaves.
    pub(crate) gone: CancellationToken,
}

impl Outbox {
    pub(crate) fn new(stream: u64, metrics: NodeMetrics) -> Arc<Self> {
        Arc::new(Self { stream, metrics, state: Mutex::default(), gone: CancellationToken::new() })
    }

    /// From here on numbers must rise and frames are acknowledged.
    pub(crate) fn set_live(&self) {
        self.state.lock().is_live = true;
    }

    /// Resolves when frames have waited for the client for `deadline`.
    pub(crate) async fn stalled(&self, deadline: Duration) {
        loop {
            let since = self.state.lock().untaken_since;
            let left = deadline.saturating_sub(since.map_or(Duration::ZERO, |since| since.elapsed()));
            if left.is_zero() {
                return;
            }
            tokio::time::sleep(left).await;
        }
    }

    /// Gives back the credit of all frames up to this one.
    pub(crate) fn acknowledge(&self, frame: u64) {
        let unacknowledged = &mut self.state.lock().unacknowledged;
        while unacknowledged.front().is_some_and(|(sent, _)| *sent <= frame) {
            unacknowledged.pop_front();
        }
    }

    /// Ends the stream, after the frames that are ready.
    pub(crate) fn end(&self, end: Result<(), Status>) {
        let mut state = self.state.lock();
        state.end.get_or_insert(end);
        state.wake();
    }

    /// Ends the stream at once, before the frames that are ready.
    pub(crate) fn cut(&self, status: Status) {
        let mut state = self.state.lock();
        self.drop_ready(&mut state, "client stalled");
        (state.current, state.end) = (None, Some(Err(status)));
        state.wake();
    }

    fn put(&self, output: Output) {
        let mut state = self.state.lock();
        if self.gone.is_cancelled() || state.end.as_ref().is_some_and(Result::is_err) {
            return self.metrics.drop_view("client gone");
        }
        state.untaken_since.get_or_insert_with(Instant::now);
        state.ready.push_back(output);
        state.wake();
    }

    fn drop_ready(&self, state: &mut State, reason: &'static str) {
        state.ready.drain(..).for_each(|_| self.metrics.drop_view(reason));
    }

    fn next_part(&self, state: &mut State) -> Option<FramePart> {
        while state.current.is_none() {
            let output = state.ready.pop_front()?;
            if state.is_live && output.frame <= state.last {
                self.metrics.drop_view("overtaken");
                continue;
            }
            state.last = output.frame;
            state.current = Some(self.begin(output));
        }
        let current = state.current.as_mut()?;
        let part = current.parts.next();
        if current.parts.peek().is_none() {
            let sent = state.current.take()?;
            if state.is_live {
                state.unacknowledged.push_back((sent.frame, sent.credit.stream));
            }
        }
        part
    }

    /// Hands the frame to the transport.
    fn begin(&self, output: Output) -> Current {
        let Output { frame, mut header, data, arrived, credit } = output;
        header.stage_times = header.stage_times.leaving_after(arrived.elapsed().as_secs_f64());
        tracing::debug!(
            stream = self.stream,
            frame,
            set = %header.sample_set_id,
            compositor_s = header.stage_times.compositor_s,
            "sent"
        );
        let parts: Box<dyn Iterator<Item = FramePart> + Send> = Box::new(FramePart::cut(frame, header, data));
        Current { frame, parts: parts.peekable(), credit }
    }
}

impl State {
    fn wake(&mut self) {
        if let Some(waker) = self.waker.take() {
            waker.wake();
        }
    }
}

/// The way to an outbox. The stream ends when the last clone is dropped.
#[derive(Clone)]
pub(crate) struct Reply(Arc<Closing>);

struct Closing(Arc<Outbox>);

impl Drop for Closing {
    fn drop(&mut self) {
        self.0.end(Ok(()));
    }
}

impl Reply {
    pub(crate) fn new(outbox: Arc<Outbox>) -> Self {
        Self(Arc::new(Closing(outbox)))
    }

    pub(crate) fn outbox(&self) -> &Outbox {
        &self.0.0
    }

    /// Never blocks: every frame has a credit.
    pub(crate) fn send(&self, output: Result<Output, Status>) {
        match output {
            Ok(output) => self.outbox().put(output),
            Err(status) => self.outbox().end(Err(status)),
        }
    }
}

/// A client's frames as messages.
pub(crate) struct Outgoing(pub(crate) Arc<Outbox>);

impl Stream for Outgoing {
    type Item = Result<FramePart, Status>;

    fn poll_next(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        let mut state = self.0.state.lock();
        let part = self.0.next_part(&mut state);
        let is_left = state.current.is_some() || !state.ready.is_empty();
        state.untaken_since = is_left.then(Instant::now);
        if let Some(part) = part {
            return Poll::Ready(Some(Ok(part)));
        }
        match &mut state.end {
            None => {
                state.waker = Some(cx.waker().clone());
                Poll::Pending
            }
            Some(end) => Poll::Ready(std::mem::replace(end, Ok(())).err().map(Err)),
        }
    }
}

impl Drop for Outgoing {
    fn drop(&mut self) {
        self.0.gone.cancel();
        let mut state = self.0.state.lock();
        self.0.drop_ready(&mut state, "client gone");
        (state.current, state.unacknowledged) = (None, VecDeque::new());
    }
}

#[cfg(test)]
#[path = "outbox_tests.rs"]
mod tests;
