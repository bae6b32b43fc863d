//! The frames of one request: those that are due, each once and from its own sample set, and their way to the caller.

use std::collections::HashMap;
use std::sync::Arc;
use std::thread::available_parallelism;

use codec::{FrameHeader, WholeFrame};
use depth_image::{View, ViewPlanes};
use parking_lot::Mutex;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio::task::JoinSet;

use crate::error::ClientError;
use crate::view_request::{Frame, ViewRequest};

/// Most decoded frames that the caller has not taken yet: in number, and in bytes, though always one.
const FRAMES_AHEAD: usize = 32;
const BYTES_AHEAD: usize = 64 << 20;

/// The frames of one request, in the order they are ready.
#[derive(Debug)]
pub struct Frames {
    received: mpsc::Receiver<Received>,
    expected: Arc<Mutex<Expected>>,
    has_failed: bool,
    /// Dropped with the frames: the calls then end too.
    _delivery: JoinSet<()>,
}

impl Frames {
    /// The frames that `deliver` passes to the sink it is given.
    pub(crate) fn start<F: Future<Output = ()> + Send + 'static>(
        expected: Expected,
        deliver: impl FnOnce(FrameSink) -> F,
    ) -> Self {
        let (send, received) = mpsc::channel(frames_ahead(expected.largest_frame_bytes()));
        let expected = Arc::new(Mutex::new(expected));
        let decoders = Arc::new(Semaphore::new(available_parallelism().map_or(1, usize::from)));
        let mut delivery = JoinSet::new();
        delivery.spawn(deliver(FrameSink { received: send, expected: expected.clone(), decoders }));
        Self { received, expected, has_failed: false, _delivery: delivery }
    }

    /// The next frame; `None` when all have been received.
    ///
    /// # Errors
    /// The first failure of any compositor, a frame that was not requested, or, at the end, the frames that are missing.
    /// Nothing follows an error.
    pub async fn next(&mut self) -> Option<Result<Frame, ClientError>> {
        if self.has_failed {
            return None;
        }
        let next = match self.received.recv().await {
            Some(received) => received.map(Some),
            None => self.expected.lock().finish().map(|()| None),
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

fn frames_ahead(frame_bytes: usize) -> usize {
    (BYTES_AHEAD / frame_bytes.max(1)).clamp(1, FRAMES_AHEAD)
}

/// A frame for the caller, or the error that ends its request.
type Received = Result<Frame, ClientError>;

/// Takes the frames of one request. Clones share them.
#[derive(Clone)]
pub(crate) struct FrameSink {
    received: mpsc::Sender<Received>,
    expected: Arc<Mutex<Expected>>,
    decoders: Arc<Semaphore>,
}

impl FrameSink {
    /// The fault of a frame under a plan of this epoch; `None` for a good frame.
    pub(crate) fn fault_of(&self, frame: &WholeFrame, plan_epoch: u64) -> Option<String> {
        let (number, set) = (frame.frame, frame.header.sample_set_id);
        if set.plan_epoch != plan_epoch {
            return Some(format!("sent a frame of set {set}"));
        }
        let fault = self.expected.lock().fault_of(number, &frame.header);
        fault.map(|fault| format!("sent frame {number}, which {fault}"))
    }

    /// The requests whose frames are still missing.
    pub(crate) fn missing(&self, requests: &[ViewRequest]) -> Vec<ViewRequest> {
        let expected = self.expected.lock();
        requests.iter().filter(|request| expected.due.contains_key(&request.frame)).copied().collect()
    }

    /// Room for one more frame that is decoded; `None` when the request has ended.
    pub(crate) async fn decoder(&self) -> Option<OwnedSemaphorePermit> {
        self.decoders.clone().acquire_owned().await.ok()
    }

    /// Passes a frame on once there is room; a frame that was received twice counts once. A slow caller thereby holds up
    /// the decoding.
    pub(crate) async fn pass_on(&self, frame: u64, header: FrameHeader, view: View) {
        // An error means that the caller has left. Room comes first: nothing can end the call between the next two lines.
        let Ok(room) = self.received.reserve().await else { return };
        let Some(request) = self.expected.lock().take(frame) else { return };
        room.send(Ok(Frame { request, view, header }));
    }

    /// Whether all room for frames is taken: the caller takes none.
    pub(crate) fn is_full(&self) -> bool {
        self.received.capacity() == 0
    }

    /// Waits until the caller takes frames again; false if it has left.
    pub(crate) async fn wait_for_room(&self) -> bool {
        self.received.reserve().await.is_ok()
    }

    /// Ends the request.
    pub(crate) async fn fail(&self, error: ClientError) {
        let _ = self.received.send(Err(error)).await;
    }
}

/// The frames of one request that have not been received.
#[derive(Debug)]
pub(crate) struct Expected {
    due: HashMap<u64, ViewRequest>,
    planes: ViewPlanes,
}

impl Expected {
    /// # Errors
    /// For a frame number that is given twice.
    pub(crate) fn new(
        requests: impl IntoIterator<Item = ViewRequest>,
        planes: ViewPlanes,
    ) -> Result<Self, ClientError> {
        let mut due = HashMap::new();
        for request in requests {
            if due.insert(request.frame, request).is_some() {
                return Err(ClientError::Invalid {
                    field: "frame",
                    reason: format!("{} is requested twice", request.frame),
                });
            }
        }
        Ok(Self { due, planes })
    }

    /// The decoded bytes of the largest frame.
    fn largest_frame_bytes(&self) -> usize {
        let pixels = self.due.values().map(|request| request.camera.pixel_count()).max().unwrap_or(0);
        pixels * self.planes.bytes_per_pixel()
    }

    /// The fault of a frame, of its compositor or of the network; `None` for a good frame.
    pub(crate) fn fault_of(&self, frame: u64, header: &FrameHeader) -> Option<String> {
        match self.due.get(&frame) {
            None => Some("was not requested or has been received".to_owned()),
            Some(request) => check_frame(request, self.planes, header).err(),
        }
    }

    /// Counts a frame as received and gives its request; `None` if it was received before.
    pub(crate) fn take(&mut self, frame: u64) -> Option<ViewRequest> {
        self.due.remove(&frame)
    }

    /// Checks, at the end of all streams, that no frame is missing.
    pub(crate) fn finish(&self) -> Result<(), ClientError> {
        if self.due.is_empty() {
            return Ok(());
        }
        let mut missing: Vec<u64> = self.due.keys().copied().collect();
        missing.sort_unstable();
        let count = missing.len();
        missing.truncate(8);
        Err(ClientError::Missing { count, first: missing })
    }
}

/// Checks that a frame shows what was requested, under whichever plan; else says what is wrong with it.
pub(crate) fn check_frame(request: &ViewRequest, planes: ViewPlanes, header: &FrameHeader) -> Result<(), String> {
    if header.sample_set_id.index != u64::from(request.set_index) {
        return Err(format!("shows sample set {} in place of {}", header.sample_set_id, request.set_index));
    }
    let has = ViewPlanes { inverse_depth: header.inverse_depth_bytes > 0, provenance: header.provenance_bytes > 0 };
    if header.size_px != request.camera.size_px || has != planes {
        return Err("has another size or other planes than requested".to_owned());
    }
    if header.camera != request.camera {
        return Err("shows another pose than requested".to_owned());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use codec::{FrameCodec, SampleSetId, StageTimes};
    use depth_image::PinholeCamera;

    fn request(frame: u64) -> ViewRequest {
        let camera = PinholeCamera::looking_at(
            [0.0, 0.0, 1.0].into(),
            [0.0; 3].into(),
            [0.0, 1.0, 0.0].into(),
            1.0,
            [8, 8].into(),
        );
        ViewRequest { frame, set_index: 0, camera }
    }

    fn header(index: u64) -> FrameHeader {
        FrameHeader {
            sample_set_id: SampleSetId { plan_epoch: 1, index },
            cell: 0,
            is_neighbour_cell: false,
            camera: request(0).camera,
            size_px: [8, 8].into(),
            codec: FrameCodec::Lz4,
            color_bytes: 1,
            inverse_depth_bytes: 0,
            provenance_bytes: 0,
            crc32: 0,
            stage_times: StageTimes::default(),
        }
    }

    #[test]
    fn large_frames_wait_in_small_numbers() {
        assert_eq!([1, 2 << 20, 4 << 20, 22 << 20, 65 << 20].map(frames_ahead), [32, 32, 16, 2, 1]);
        let planes = ViewPlanes { inverse_depth: true, provenance: true };
        assert_eq!(Expected::new([request(4)], planes).unwrap().largest_frame_bytes(), 64 * (3 + 4 + 4));
    }

    #[test]
    fn a_frame_is_accepted_once_and_from_its_own_set() {
        let mut expected = Expected::new([request(4), request(7)], ViewPlanes::default()).unwrap();
        assert_eq!(expected.fault_of(4, &header(0)), None);
        assert_eq!(expected.take(4), Some(request(4)));
        let mut elsewhere = header(0);
        elsewhere.camera.eye_in_world.x += 0.1;
        for (frame, header, reason) in [
            (4, header(0), "has been received"),
            (5, header(0), "not requested"),
            (7, header(1), "sample set"),
            (7, elsewhere, "another pose"),
        ] {
            assert!(expected.fault_of(frame, &header).unwrap().contains(reason));
        }
        assert_eq!(
            (expected.take(4), expected.due.contains_key(&4), expected.due.contains_key(&7)),
            (None, false, true)
        );
        assert!(expected.finish().unwrap_err().to_string().contains("1 frames are missing: [7]"));
        expected.take(7).unwrap();
        expected.finish().unwrap();
        assert!(Expected::new([request(4), request(4)], ViewPlanes::default()).is_err());
    }
}
