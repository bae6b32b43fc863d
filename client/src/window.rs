//! The views of one request that are due: a window of a stream of requests, which may be long.

use std::collections::BTreeMap;
use std::fmt;
use std::iter::Peekable;

use codec::FrameHeader;
use depth_image::ViewPlanes;

use crate::error::ClientError;
use crate::view_request::ViewRequest;

/// Most views that are drawn at a time; they are of one set.
const MAX_RUN_VIEWS: usize = 4096;
/// More views are drawn when fewer wait to be requested. Twice as many wait at most.
pub(crate) const LEAST_AHEAD_VIEWS: usize = 4096;

type Source = Peekable<Box<dyn Iterator<Item = ViewRequest> + Send>>;

/// Views that have been drawn from the caller's requests and not been received. The number of all requests does not matter.
pub(crate) struct Window {
    /// `None` after the last request.
    source: Option<Source>,
    /// The number of the last frame that was drawn.
    last: Option<u64>,
    due: BTreeMap<u64, ViewRequest>,
    /// Frames that were received so far.
    pub(crate) received: u64,
    /// The request that cannot be met; those before it are.
    fault: Option<ClientError>,
    /// Sets of the timeline.
    set_count: u32,
    /// The planes that all views have beside colour.
    pub(crate) planes: ViewPlanes,
    /// The reconstruction method of all views; `None`: the session's.
    pub(crate) method: Option<String>,
}

impl fmt::Debug for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Window").field("due", &self.due.len()).field("received", &self.received).finish_non_exhaustive()
    }
}

impl Window {
    /// Draws the first views.
    ///
    /// # Errors
    /// One of these views cannot be requested.
    pub(crate) fn open(
        requests: impl Iterator<Item = ViewRequest> + Send + 'static,
        set_count: u32,
        planes: ViewPlanes,
    ) -> Result<Self, ClientError> {
        let requests: Box<dyn Iterator<Item = ViewRequest> + Send> = Box::new(requests);
        let source = Some(requests.peekable());
        let due = BTreeMap::new();
        let mut window = Self { source, last: None, due, received: 0, fault: None, set_count, planes, method: None };
        while window.due.len() < LEAST_AHEAD_VIEWS && !window.draw().is_empty() {}
        match window.fault.take() {
            Some(error) => Err(error),
            None => Ok(window),
        }
    }

    /// The next views, all of one set. None after the last, and from a request on that cannot be met.
    pub(crate) fn draw(&mut self) -> Vec<ViewRequest> {
        let mut run: Vec<ViewRequest> = Vec::new();
        while let Some(source) = self.source.as_mut().filter(|_| run.len() < MAX_RUN_VIEWS) {
            let next = source.next_if(|next| run.first().is_none_or(|first| first.set_index == next.set_index));
            let Some(request) = next else { break };
            if let Err(error) = self.check(&request) {
                (self.source, self.fault) = (None, Some(error));
                break;
            }
            self.last = Some(request.frame);
            self.due.insert(request.frame, request);
            run.push(request);
        }
        run
    }

    /// Rising numbers show that no frame is requested twice, without a list of all.
    fn check(&self, request: &ViewRequest) -> Result<(), ClientError> {
        if let Some(last) = self.last.filter(|&last| request.frame <= last) {
            let reason = format!("{} follows {last}: numbers must rise", request.frame);
            return Err(ClientError::Invalid { field: "frame", reason });
        }
        request.check(self.set_count)
    }

    /// The views that are due, in the order of their numbers.
    pub(crate) fn due(&self) -> Vec<ViewRequest> {
        self.due.values().copied().collect()
    }

    /// Views of the largest set among those that are due, or else of the next one.
    pub(crate) fn most_views_of_a_set(&mut self) -> usize {
        if self.due.is_empty() {
            self.draw();
        }
        self.due().chunk_by(|a, b| a.set_index == b.set_index).map(<[ViewRequest]>::len).max().unwrap_or(0)
    }

    /// Whether all frames have been received.
    pub(crate) fn is_complete(&mut self) -> bool {
        self.due.is_empty() && self.source.as_mut().and_then(Peekable::peek).is_none()
    }

    /// The fault of a frame, of its compositor or of the network; `None` for a good frame.
    pub(crate) fn fault_of(&self, frame: u64, header: &FrameHeader) -> Option<String> {
        match self.due.get(&frame) {
            None => Some("was not requested or has been received".to_owned()),
            Some(request) => check_frame(request, self.planes, header).err(),
        }
    }

    /// The decoded bytes of a frame that is due.
    pub(crate) fn decoded_bytes(&self, frame: u64) -> usize {
        self.due.get(&frame).map_or(0, |request| request.camera.pixel_count() * self.planes.bytes_per_pixel())
    }

    /// Counts a frame as received and gives its request; `None` if it was received before.
    pub(crate) fn take(&mut self, frame: u64) -> Option<ViewRequest> {
        let request = self.due.remove(&frame)?;
        self.received += 1;
        Some(request)
    }

    /// Checks, at the end of all streams, that no frame is missing and every request could be met.
    pub(crate) fn finish(&mut self) -> Result<(), ClientError> {
        let next = self.source.as_mut().and_then(Peekable::peek).map(|next| next.frame);
        let first: Vec<u64> = self.due.keys().copied().chain(next).take(8).collect();
        match self.fault.clone() {
            _ if !first.is_empty() => Err(ClientError::Missing { count: self.due.len().max(1), first }),
            Some(fault) => Err(fault),
            None => Ok(()),
        }
    }
}

/// Checks that a frame shows what was requested, under whichever plan; else says what is wrong with it.
pub(crate) fn check_frame(request: &ViewRequest, planes: ViewPlanes, header: &FrameHeader) -> Result<(), String> {
    if header.sample_set_id.index != u64::from(request.set_index) {
        return Err(format!("shows sample set {} in place of {}", header.sample_set_id, request.set_index));
    }
    let has = ViewPlanes {
        inverse_depth: header.inverse_depth_bytes > 0,
        provenance: header.provenance_bytes > 0,
        antialias: header.antialias,
        tone: header.tone,
    };
    if header.size_px != request.camera.size_px || has != planes {
        return Err("has another size, other planes, other samples a pixel or another tone than requested".to_owned());
    }
    if header.camera != request.camera {
        return Err("shows another pose than requested".to_owned());
    }
    Ok(())
}

#[cfg(test)]
#[path = "window_tests.rs"]
mod tests;
