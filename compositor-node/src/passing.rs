//! Encoded images of one set as they come, for compositors that ask this one for them.

use codec::EncodedDepthImage;
use tokio::sync::watch;
use tokio_stream::StreamExt as _;
use tokio_stream::wrappers::WatchStream;
use tonic::Status;
use wire::rpc::Messages;

/// What has come so far.
#[derive(Debug, Clone, Default)]
struct Come {
    images: Vec<(u32, EncodedDepthImage)>,
    ended: Option<Result<(), Status>>,
}

/// Images are passed on in the order they come. Clones share them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Passing(watch::Sender<Come>);

impl Passing {
    /// An image has come; one that was asked for again after a fault counts once.
    pub(crate) fn add(&self, index: u32, image: EncodedDepthImage) {
        self.0.send_if_modified(|come| {
            let is_new = come.images.iter().all(|(other, _)| *other != index);
            if is_new {
                come.images.push((index, image));
            }
            is_new
        });
    }

    /// All have come, or no more will.
    pub(crate) fn end(&self, result: Result<(), Status>) {
        self.0.send_modify(|come| come.ended = Some(result));
    }

    /// Whether nothing more will come, though something is missing.
    pub(crate) fn has_failed(&self) -> bool {
        matches!(self.0.borrow().ended, Some(Err(_)))
    }

    /// Whether no image has come.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.borrow().images.is_empty()
    }

    /// What has come, and what comes.
    pub(crate) fn images(&self) -> Messages<(u32, EncodedDepthImage)> {
        let mut seen = 0;
        let changes = WatchStream::new(self.0.subscribe()).map(move |come| {
            let fresh: Vec<_> = come.images[seen..].iter().cloned().map(Ok).collect();
            seen = come.images.len();
            (fresh, come.ended)
        });
        Box::pin(Flattened { changes: Box::pin(changes), ready: Vec::new().into_iter(), ended: None })
    }
}

type Change = (Vec<Result<(u32, EncodedDepthImage), Status>>, Option<Result<(), Status>>);

struct Flattened {
    changes: std::pin::Pin<Box<dyn tokio_stream::Stream<Item = Change> + Send>>,
    ready: std::vec::IntoIter<Result<(u32, EncodedDepthImage), Status>>,
    ended: Option<Result<(), Status>>,
}

impl tokio_stream::Stream for Flattened {
    type Item = Result<(u32, EncodedDepthImage), Status>;

    fn poll_next(
        mut self: std::pin::Pin<&mut Self>,
        cx: &mut std::task::Context<'_>,
    ) -> std::task::Poll<Option<Self::Item>> {
        use std::task::Poll;
        loop {
            if let Some(image) = self.ready.next() {
                return Poll::Ready(Some(image));
            }
            if let Some(ended) = &mut self.ended {
                return Poll::Ready(std::mem::replace(ended, Ok(())).err().map(Err));
            }
            let Some((fresh, ended)) = std::task::ready!(self.changes.as_mut().poll_next(cx)) else {
                self.ended = Some(Err(Status::aborted("the set was dropped before it had come")));
                continue;
            };
            (self.ready, self.ended) = (fresh.into_iter(), ended);
        }
    }
}

#[cfg(test)]
mod tests {
    use codec::{EncodedDepthImage, ImageHeader, InverseDepthRange};

    use super::*;

    fn image(byte: u8) -> EncodedDepthImage {
        let inverse_depth_range = InverseDepthRange { least_per_m: 0.0, greatest_per_m: 1.0 };
        let header = ImageHeader { width: 1, height: 1, inverse_depth_range, planes: Vec::new() };
        EncodedDepthImage { header, payload: vec![byte].into() }
    }

    #[tokio::test]
    async fn who_comes_late_gets_all_and_who_waits_gets_them_as_they_come() {
        let passing = Passing::default();
        passing.add(2, image(2));
        let mut early = passing.images();
        assert_eq!(early.next().await.unwrap().unwrap().0, 2);
        let waiting = tokio::spawn(async move {
            let next = early.next().await.unwrap().unwrap().0;
            (next, early.next().await.is_none())
        });
        tokio::task::yield_now().await;
        passing.add(0, image(0));
        passing.end(Ok(()));
        assert_eq!(waiting.await.unwrap(), (0, true));
        let late: Vec<_> = passing.images().map(|image| image.unwrap().0).collect().await;
        assert_eq!(late, [2, 0]);
        assert!(!passing.has_failed() && !passing.is_empty());
    }

    #[tokio::test]
    async fn a_failure_is_passed_on_too() {
        let passing = Passing::default();
        passing.add(1, image(1));
        passing.end(Err(Status::unavailable("the sampler is gone")));
        let mut images = passing.images();
        assert!(images.next().await.unwrap().is_ok());
        assert_eq!(images.next().await.unwrap().unwrap_err().message(), "the sampler is gone");
        assert!(images.next().await.is_none() && passing.has_failed());
        let dropped = Passing::default();
        let mut images = dropped.images();
        drop(dropped);
        assert!(images.next().await.unwrap().is_err());
    }
}
