//! Where streams leave views for the device.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

use crate::batch::{BatchKey, Waiting};
use crate::queue::{FairQueue, Keyed};

impl Keyed for Waiting {
    fn key(&self) -> &BatchKey {
        &self.key
    }
}

/// All views that wait. Bounded: each holds a credit.
#[derive(Default)]
pub(crate) struct Arrivals {
    queue: Mutex<FairQueue<Waiting>>,
    added: Notify,
}

impl Arrivals {
    fn locked(&self) -> MutexGuard<'_, FairQueue<Waiting>> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn push(&self, stream: u64, views: impl IntoIterator<Item = Waiting>) {
        self.locked().push(stream, views);
        self.added.notify_one();
    }

    /// Batches are kept small as long as the viewer is there.
    pub(crate) fn viewer(self: &Arc<Self>) -> Viewer {
        self.locked().add_viewer();
        Viewer(self.clone())
    }

    /// Takes back what a stream has here.
    pub(crate) fn withdraw(&self, stream: u64) -> VecDeque<Waiting> {
        self.locked().withdraw(stream)
    }

    /// The next batch, as soon as there is one.
    pub(crate) async fn next_batch(&self) -> Vec<Waiting> {
        loop {
            let batch = self.locked().take_batch();
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
        self.0.locked().remove_viewer();
    }
}
