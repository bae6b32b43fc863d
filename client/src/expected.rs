//! Which frames are due: each once, and from its own sample set.

use std::collections::HashMap;

use depth_image::ViewPlanes;
use wire::FrameHeader;

use crate::{ClientError, ViewRequest};

/// What a frame must be.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Due {
    request: ViewRequest,
    came: bool,
}

/// The frames of one call.
#[derive(Debug)]
pub(crate) struct Expected {
    due: HashMap<u64, Due>,
    planes: ViewPlanes,
    left: usize,
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
            if due.insert(request.frame, Due { request, came: false }).is_some() {
                return Err(ClientError::Invalid {
                    field: "frame",
                    reason: format!("{} is asked for twice", request.frame),
                });
            }
        }
        let left = due.len();
        Ok(Self { due, planes, left })
    }

    /// Notes a frame that came; gives what had been asked.
    pub(crate) fn accept(&mut self, frame: u64, header: &FrameHeader) -> Result<ViewRequest, ClientError> {
        let unexpected = |reason: String| ClientError::Unexpected { frame, reason };
        let due = self.due.get_mut(&frame).ok_or_else(|| unexpected("was not asked for".to_owned()))?;
        if due.came {
            return Err(unexpected("came twice".to_owned()));
        }
        agrees(&due.request, self.planes, header).map_err(unexpected)?;
        due.came = true;
        self.left -= 1;
        Ok(due.request)
    }

    /// Once the streams have ended.
    pub(crate) fn finish(&self) -> Result<(), ClientError> {
        if self.left == 0 {
            return Ok(());
        }
        let mut missing: Vec<u64> = self.due.iter().filter(|(_, due)| !due.came).map(|(frame, _)| *frame).collect();
        missing.sort_unstable();
        let count = missing.len();
        missing.truncate(8);
        Err(ClientError::Missing { count, first: missing })
    }
}

/// Whether a frame shows what was asked for, of whichever plan. Else says what is wrong with it.
pub(crate) fn agrees(request: &ViewRequest, planes: ViewPlanes, header: &FrameHeader) -> Result<(), String> {
    if header.sample_set_id.index != u64::from(request.set_index) {
        return Err(format!("shows sample set {} in place of {}", header.sample_set_id, request.set_index));
    }
    let has = ViewPlanes { inverse_depth: header.inverse_depth_bytes > 0, provenance: header.provenance_bytes > 0 };
    if header.size_px != request.camera.size_px || has != planes {
        return Err("has another size or other planes than asked for".to_owned());
    }
    if header.camera != request.camera {
        return Err("shows another pose than asked for".to_owned());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use depth_image::PinholeCamera;
    use wire::{FrameCodec, SampleSetId, StageTimes};

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
    fn frames_come_once_and_from_their_own_set() {
        let mut expected = Expected::new([request(4), request(7)], ViewPlanes::default()).unwrap();
        expected.accept(4, &header(0)).unwrap();
        let mut elsewhere = header(0);
        elsewhere.camera.eye_in_world.x += 0.1;
        for (frame, header, reason) in [
            (4, header(0), "twice"),
            (5, header(0), "not asked"),
            (7, header(1), "sample set"),
            (7, elsewhere, "another pose"),
        ] {
            assert!(expected.accept(frame, &header).unwrap_err().to_string().contains(reason));
        }
        assert!(expected.finish().unwrap_err().to_string().contains("1 frames are missing: [7]"));
        expected.accept(7, &header(0)).unwrap();
        expected.finish().unwrap();
        assert!(Expected::new([request(4), request(4)], ViewPlanes::default()).is_err());
    }
}
