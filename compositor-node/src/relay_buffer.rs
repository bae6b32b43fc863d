//! Encoded images of one set as they arrive, for compositors that this one relays them to.

use std::collections::HashMap;
use std::sync::{Arc, Weak};

use cluster::SetContent;
use codec::EncodedImage;
use parking_lot::Mutex;
use tokio::sync::watch;
use tokio_stream::StreamExt as _;
use tonic::Status;
use wire::rpc::Messages;

/// The images that have arrived so far.
#[derive(Debug, Clone, Default)]
struct RelayState {
    images: Vec<(u32, EncodedImage)>,
    ended: Option<Result<(), Status>>,
}

/// Images are relayed in the order they arrive. Clones share them.
#[derive(Debug, Clone, Default)]
pub(crate) struct RelayBuffer(Arc<watch::Sender<RelayState>>);

/// The buffers of sets that are loaded or being loaded, which hold them.
#[derive(Debug, Default)]
pub(crate) struct RelayBuffers(Mutex<HashMap<SetContent, Weak<watch::Sender<RelayState>>>>);

impl RelayBuffers {
    /// The buffer of a set, the same for all as long as one of them holds it.
    pub(crate) fn of(&self, content: SetContent) -> RelayBuffer {
        let mut buffers = self.0.lock();
        buffers.retain(|_, buffer| buffer.strong_count() > 0);
        if let Some(buffer) = buffers.get(&content).and_then(Weak::upgrade) {
            return RelayBuffer(buffer);
        }
        let buffer = RelayBuffer::default();
        buffers.insert(content, Arc::downgrade(&buffer.0));
        buffer
    }
}

impl RelayBuffer {
    /// Adds an image that has arrived; one that was fetched again after a fault counts once.
    pub(crate) fn add(&self, index: u32, image: EncodedImage) {
        self.0.send_if_modified(|state| {
            let is_new = state.images.iter().all(|(other, _)| *other != index);
            if is_new {
                state.images.push((index, image));
            }
            is_new
        });
    }

    /// All images have arrived, or no more will.
    pub(crate) fn end(&self, result: Result<(), Status>) {
        self.0.send_modify(|state| state.ended = Some(result));
    }

    /// Whether images are missing and will not arrive.
    pub(crate) fn has_failed(&self) -> bool {
        matches!(self.0.borrow().ended, Some(Err(_)))
    }

    /// Bytes of the images that have arrived.
    pub(crate) fn bytes(&self) -> usize {
        self.0.borrow().images.iter().map(|(_, image)| image.payload.len()).sum()
    }

    /// Resolves when no stream of its images is left.
    pub(crate) async fn unwanted(&self) {
        self.0.closed().await;
    }

    /// The images that have arrived, then those that arrive.
    pub(crate) fn images(&self) -> Messages<(u32, EncodedImage)> {
        let state = self.0.subscribe();
        Box::pin(tokio_stream::iter(0..).then(move |place| at(state.clone(), place)).map_while(|image| image))
    }
}

/// The image at a place, or, at the place after the last one, the error that the images end with. Waits for it.
async fn at(mut state: watch::Receiver<RelayState>, place: usize) -> Option<Result<(u32, EncodedImage), Status>> {
    let known = state.wait_for(|state| state.images.len() > place || state.ended.is_some());
    let is_evicted = known.await.is_err();
    let state = state.borrow();
    if let Some(image) = state.images.get(place) {
        return Some(Ok(image.clone()));
    }
    let evicted = is_evicted.then(|| Status::aborted("the set was evicted before it was complete"));
    let error = evicted.or_else(|| state.ended.clone()?.err());
    error.filter(|_| place == state.images.len()).map(Err)
}

#[cfg(test)]
mod tests {
    use codec::{EncodedImage, ImageHeader, InverseDepthRange};

    use super::*;

    fn image(byte: u8) -> EncodedImage {
        let inverse_depth_range = InverseDepthRange { least_per_m: 0.0, greatest_per_m: 1.0 };
        let header = ImageHeader { width: 1, height: 1, inverse_depth_range, layered: None, planes: Vec::new() };
        EncodedImage { header, payload: vec![byte].into() }
    }

    #[tokio::test]
    async fn a_late_reader_gets_all_images_and_a_waiting_one_gets_them_as_they_arrive() {
        let buffer = RelayBuffer::default();
        buffer.add(2, image(2));
        let mut early = buffer.images();
        assert_eq!(early.next().await.unwrap().unwrap().0, 2);
        let waiting = tokio::spawn(async move {
            let next = early.next().await.unwrap().unwrap().0;
            (next, early.next().await.is_none())
        });
        tokio::task::yield_now().await;
        buffer.add(0, image(0));
        buffer.end(Ok(()));
        assert_eq!(waiting.await.unwrap(), (0, true));
        let late: Vec<_> = buffer.images().map(|image| image.unwrap().0).collect().await;
        assert_eq!(late, [2, 0]);
        assert!(!buffer.has_failed());
        assert_eq!(buffer.bytes(), 2);
    }

    #[tokio::test]
    async fn a_failure_and_an_eviction_end_the_stream() {
        let buffer = RelayBuffer::default();
        buffer.add(1, image(1));
        buffer.end(Err(Status::unavailable("the sampler is gone")));
        let mut images = buffer.images();
        assert!(images.next().await.unwrap().is_ok());
        assert_eq!(images.next().await.unwrap().unwrap_err().message(), "the sampler is gone");
        assert!(images.next().await.is_none() && buffer.has_failed());
        let dropped = RelayBuffer::default();
        let mut images = dropped.images();
        drop(dropped);
        assert!(images.next().await.unwrap().is_err());
    }
}
