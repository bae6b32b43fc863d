//! The views of all streams that wait for the device.

use std::collections::VecDeque;
use std::sync::Arc;

use parking_lot::Mutex;
use tokio::sync::Notify;

use crate::batch::{BatchKey, Waiting};
use crate::queue::{FairQueue, Keyed};

impl Keyed for Waiting {
    fn key(&self) -> &BatchKey {
        &self.key
    }
}

/// Bounded: each view that waits holds a credit.
#[derive(Default)]
pub(crate) struct Arrivals {
    queue: Mutex<FairQueue<Waiting>>,
    added: Notify,
}

impl Arrivals {
    pub(crate) fn push(&self, stream: u64, views: impl IntoIterator<Item = Waiting>) {
        self.queue.lock().push(stream, views);
        self.added.notify_one();
    }

    /// Counts a live stream as open: batches are small until the guard is dropped.
    pub(crate) fn viewer(self: &Arc<Self>) -> Viewer {
        self.queue.lock().add_viewer();
        Viewer(self.clone())
    }

    /// Takes back a stream's views.
    pub(crate) fn withdraw(&self, stream: u64) -> VecDeque<Waiting> {
        self.queue.lock().withdraw(stream)
    }

    /// Waits for the next batch.
    pub(crate) async fn next_batch(&self) -> Vec<Waiting> {
        loop {
            let batch = self.queue.lock().take_batch();
            if !batch.is_empty() {
                return batch;
            }
            self.added.notified().await;
        }
    }
}

/// A live stream that is open.
pub(crate) struct Viewer(Arc<Arrivals>);

impl Drop for Viewer {
    fn drop(&mut self) {
        self.0.queue.lock().remove_viewer();
    }
}
