//! Views that a client asks a compositor for, and the images that a compositor asks a sampler or a relay for.

use codec::FrameCodec;
use depth_image::{PinholeCamera, ViewPlanes};

use crate::check::{InvalidField, at_most, nonempty};
use crate::limits::{MAX_LIVE_VIEWS_PER_REQUEST, MAX_SAMPLE_CAMERAS, MAX_TILES, MAX_VIEWS_PER_REQUEST};

/// Views of one sample set, all made alike.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderViews {
    /// The epoch of the session's plan.
    pub plan_epoch: u64,
    /// The workload of that plan.
    pub workload_number: u64,
    /// Index into the timeline.
    pub set_index: u32,
    /// How views are reconstructed.
    pub method: String,
    /// How frames are encoded.
    pub codec: FrameCodec,
    /// Planes beside colour.
    pub planes: ViewPlanes,
    /// Frame numbers and cameras; one at most for a live stream.
    pub views: Vec<RequestedView>,
    /// `Some` where the stream is live.
    pub live: Option<LiveRequest>,
}

/// One view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RequestedView {
    /// The client's own number.
    pub frame: u64,
    /// The camera of the view.
    pub camera: PinholeCamera,
}

/// The part of a live stream's request beside its view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LiveRequest {
    /// All frames up to this number have been received.
    pub acknowledged_frame: u64,
    /// The client's own choice: names it in logs.
    pub client_id: u64,
}

impl RenderViews {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        check_view_count(self.views.len(), self.live.is_some())?;
        nonempty(&self.method, "reconstruction_method")
    }
}

/// Checks the number of views of one request. A live stream may open, and acknowledge, without a view; any other request
/// asks for one at least.
///
/// # Errors
/// No view, or too many.
pub fn check_view_count(count: usize, is_live: bool) -> Result<(), InvalidField> {
    match (is_live, count) {
        (true, _) => at_most(count, MAX_LIVE_VIEWS_PER_REQUEST, "views of a live stream"),
        (false, 0) => Err(InvalidField::Missing { field: "views" }),
        (false, _) => at_most(count, MAX_VIEWS_PER_REQUEST, "views"),
    }
}

/// Asks for encoded images of one set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FetchImages {
    /// The epoch of the asker's plan.
    pub plan_epoch: u64,
    /// The workload of that plan.
    pub workload_number: u64,
    /// Index into the timeline.
    pub set_index: u32,
    /// Index into the workload's view cells.
    pub cell: u32,
    /// Indices into [`Assignment::sampled_cameras`](crate::Assignment::sampled_cameras) of the cell: images that the
    /// sampler samples, or that a relay relays.
    pub image_indices: Vec<u32>,
}

impl FetchImages {
    /// # Errors
    /// For no images, and for more than a set may have.
    pub fn validate(&self) -> Result<(), InvalidField> {
        at_most(self.image_indices.len(), MAX_SAMPLE_CAMERAS * MAX_TILES as usize, "image_indices")?;
        if self.image_indices.is_empty() { Err(InvalidField::Missing { field: "image_indices" }) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_live_streams_may_request_no_view() {
        assert!(check_view_count(0, true).is_ok() && check_view_count(1, true).is_ok());
        assert!(check_view_count(9, false).is_ok() && check_view_count(0, false).is_err());
        assert!(check_view_count(2, true).unwrap_err().to_string().contains("views of a live stream has 2"));
    }
}
