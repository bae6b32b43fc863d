//! The frames of one request and their way to the caller, within a bound on the bytes that wait.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::available_parallelism;

use codec::FrameHeader;
use depth_image::View;
use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio::task::JoinSet;

use crate::error::ClientError;
use crate::view_request::Frame;
use crate::window::Window;

/// Most bytes of frames that are received, are decoded or wait for the caller, though always one frame.
const BYTES_AHEAD: usize = 96 << 20;
/// Most such frames.
const FRAMES_AHEAD: usize = 64;
/// The unit in which bytes are counted: a semaphore counts in 32 bits.
const UNIT_BYTES: usize = 1 << 10;
const UNITS_AHEAD: u32 = (BYTES_AHEAD / UNIT_BYTES) as u32;

/// The frames of one request, in the order they are ready. Until they are taken, they have 96 MiB at most, or are one frame.
#[derive(Debug)]
pub struct Frames {
    received: mpsc::Receiver<Received>,
    window: Arc<Mutex<Window>>,
    has_failed: bool,
    /// Dropped with the frames: the calls then end too.
    _delivery: JoinSet<()>,
}

impl Frames {
    /// The frames that `deliver` passes to the sink it is given.
    pub(crate) fn start<F: Future<Output = ()> + Send + 'static>(
        window: Window,
        deliver: impl FnOnce(FrameSink) -> F,
    ) -> Self {
        // Every frame has its room, and one place is for an error.
        let (send, received) = mpsc::channel(FRAMES_AHEAD + 1);
        let window = Arc::new(Mutex::new(window));
        let decoders = Arc::new(Semaphore::new(available_parallelism().map_or(1, usize::from)));
        let mut delivery = JoinSet::new();
        let room = Arc::new(Semaphore::new(UNITS_AHEAD as usize));
        let frame_units = Arc::default();
        delivery.spawn(deliver(FrameSink { received: send, window: window.clone(), decoders, room, frame_units }));
        Self { received, window, has_failed: false, _delivery: delivery }
    }

    /// The next frame; `None` when all have been received.
    ///
    /// # Errors
    /// The first failure of any compositor, a frame that was not requested, or, at the end, the frames that are missing or a
    /// request that cannot be met. Nothing follows an error.
    pub async fn next(&mut self) -> Option<Result<Frame, ClientError>> {
        if self.has_failed {
            return None;
        }
        let next = match self.received.recv().await {
            Some(received) => received.map(|(frame, _room)| Some(frame)),
            None => self.window.lock().finish().map(|()| None),
        };
        self.has_failed = next.is_err();
        next.transpose()
    }

    /// All frames.
    ///
    /// # Errors
    /// As [`Frames::next`].
    pub async fn all(mut self) -> Result<Vec<Frame>, ClientError> {
        let mut frames = Vec::new();
        while let Some(frame) = self.next().await {
            frames.push(frame?);
        }
        Ok(frames)
    }
}

/// The room of a frame, which is free again when it is dropped.
pub(crate) type FrameRoom = OwnedSemaphorePermit;

/// The room that a frame of these bytes takes: a share of all at least, and all at most.
fn units(bytes: usize) -> u32 {
    let units = u32::try_from(bytes.div_ceil(UNIT_BYTES)).unwrap_or(u32::MAX);
    units.clamp(UNITS_AHEAD / FRAMES_AHEAD as u32, UNITS_AHEAD)
}

/// A frame for the caller, or the error that ends its request.
type Received = Result<(Frame, Option<FrameRoom>), ClientError>;

/// Takes the frames of one request. Clones share them.
#[derive(Clone)]
pub(crate) struct FrameSink {
    received: mpsc::Sender<Received>,
    /// The views that are due.
    pub(crate) window: Arc<Mutex<Window>>,
    /// Room for frames that are being decoded.
    pub(crate) decoders: Arc<Semaphore>,
    room: Arc<Semaphore>,
    /// The room of the last frame.
    frame_units: Arc<AtomicU32>,
}

impl FrameSink {
    /// Waits for room for a frame, encoded and decoded, before any of it is kept. A slow caller thereby holds up its
    /// compositors.
    ///
    /// # Errors
    /// The fault of a frame that is not one of those due under a plan of this epoch.
    pub(crate) async fn admit(&self, frame: u64, header: &FrameHeader, plan_epoch: u64) -> Result<FrameRoom, String> {
        let set = header.sample_set_id;
        if set.plan_epoch != plan_epoch {
            return Err(format!("sent a frame of set {set}"));
        }
        let bytes = {
            let window = self.window.lock();
            if let Some(fault) = window.fault_of(frame, header) {
                return Err(format!("sent frame {frame}, which {fault}"));
            }
            window.decoded_bytes(frame).saturating_add(usize::try_from(header.total_bytes()).unwrap_or(usize::MAX))
        };
        self.frame_units.store(units(bytes), Ordering::Relaxed);
        let room = self.room.clone().acquire_many_owned(units(bytes)).await;
        room.map_err(|_| "sent a frame after the last".to_owned())
    }

    /// Passes a frame on; a frame that was received twice counts once.
    pub(crate) fn pass_on(&self, frame: u64, header: FrameHeader, view: View, room: Option<FrameRoom>) {
        let Some(request) = self.window.lock().take(frame) else { return };
        // The channel has a place for every frame that has room: an error means that the caller has left.
        let _ = self.received.try_send(Ok((Frame { request, view, header }, room)));
    }

    /// The frames that are missing, as an error; `None` where all have been received.
    pub(crate) fn missing(&self) -> Option<ClientError> {
        let mut window = self.window.lock();
        if window.is_complete() { None } else { window.finish().err() }
    }

    /// Whether there is no room for another frame: the caller takes none.
    pub(crate) fn is_full(&self) -> bool {
        self.room.available_permits() < self.frame_units.load(Ordering::Relaxed) as usize
    }

    /// Waits until the caller takes frames again; false if it has left.
    pub(crate) async fn wait_for_room(&self) -> bool {
        let units = self.frame_units.load(Ordering::Relaxed);
        tokio::select! {
            room = self.room.acquire_many(units) => room.is_ok(),
            () = self.received.closed() => false,
        }
    }

    /// Ends the request.
    pub(crate) async fn fail(&self, error: ClientError) {
        let _ = self.received.send(Err(error)).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_frames_wait_in_small_numbers() {
        let ahead = |bytes| UNITS_AHEAD / units(bytes);
        assert_eq!([1, 1 << 20, 4 << 20, 30 << 20, 65 << 20, usize::MAX].map(ahead), [64, 64, 24, 3, 1, 1]);
    }
}
