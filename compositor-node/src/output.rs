//! Finished frames on their way out.

use std::pin::Pin;
use std::task::{Context, Poll};

use tokio::sync::{OwnedSemaphorePermit, mpsc};
use tokio_stream::Stream;
use tonic::Status;
use wire::FramePart;

/// An encoded frame in parts. Its credit is given back when the last part has gone out, so that a slow
/// client holds up nobody but itself.
pub(crate) struct Output {
    pub(crate) parts: Box<dyn Iterator<Item = FramePart> + Send>,
    pub(crate) _credit: OwnedSemaphorePermit,
}

/// A client's frames as messages.
pub(crate) struct Outgoing {
    frames: mpsc::Receiver<Result<Output, Status>>,
    current: Option<Output>,
}

impl Outgoing {
    pub(crate) fn new(frames: mpsc::Receiver<Result<Output, Status>>) -> Self {
        Self { frames, current: None }
    }
}

impl Stream for Outgoing {
    type Item = Result<FramePart, Status>;

    fn poll_next(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        loop {
            if let Some(part) = self.current.as_mut().and_then(|output| output.parts.next()) {
                return Poll::Ready(Some(Ok(part)));
            }
            self.current = None;
            match std::task::ready!(self.frames.poll_recv(cx)) {
                Some(Ok(output)) => self.current = Some(output),
                Some(Err(status)) => {
                    self.frames.close();
                    return Poll::Ready(Some(Err(status)));
                }
                None => return Poll::Ready(None),
            }
        }
    }
}
