//! The frames that are due: each once, and from its own sample set.

use std::collections::HashMap;

use codec::FrameHeader;
use depth_image::ViewPlanes;

use crate::error::ClientError;
use crate::view_request::ViewRequest;

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

    pub(crate) fn is_due(&self, frame: u64) -> bool {
        self.due.contains_key(&frame)
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
        assert_eq!((expected.take(4), expected.is_due(4), expected.is_due(7)), (None, false, true));
        assert!(expected.finish().unwrap_err().to_string().contains("1 frames are missing: [7]"));
        expected.take(7).unwrap();
        expected.finish().unwrap();
        assert!(Expected::new([request(4), request(4)], ViewPlanes::default()).is_err());
    }
}
