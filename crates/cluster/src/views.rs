//! Views that a client asks a compositor for, and the images that a compositor asks a sampler or a relay for.

use codec::{DecodeLimits, FrameCodec};
use depth_image::{PinholeCamera, ViewPlanes};
use glam::UVec2;

use crate::check::{InvalidField, at_most, nonempty};
use crate::limits::{MAX_LIVE_VIEWS_PER_REQUEST, MAX_SAMPLE_CAMERAS, MAX_TILES, MAX_VIEWS_PER_REQUEST};

/// The method of a request whose views are drawn from the scene, whatever the plan.
pub const DIRECT: &str = "direct";

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
    /// Whether the view waits for its set, as a still does. Views in motion take what is there meanwhile.
    pub waits_for_set: bool,
}

impl RenderViews {
    /// # Errors
    /// For values that no peer may send.
    pub fn validate(&self) -> Result<(), InvalidField> {
        check_view_count(self.views.len(), self.live.is_some())?;
        self.views.iter().try_for_each(|view| check_view_size(view.camera.size_px, "views.camera.size_px"))?;
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

/// Checks the size of a view, or of a frame with it.
///
/// # Errors
/// More pixels than [`DecodeLimits::VIEWS`] has.
pub fn check_view_size(size_px: UVec2, field: &'static str) -> Result<(), InvalidField> {
    if size_px.as_u64vec2().element_product() <= DecodeLimits::VIEWS.max_texels as u64 {
        return Ok(());
    }
    let size = format!("{}×{}", size_px.x, size_px.y);
    Err(InvalidField::out_of_range(field, size, "67108864 pixels at most, as of 8192×8192"))
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
    /// Index into the workload's cells.
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
    fn views_have_67_million_pixels_at_most() {
        for (size_px, is_right) in [([8192, 8192], true), ([16384, 4096], true), ([8192, 8200], false)] {
            assert_eq!(check_view_size(size_px.into(), "size_px").is_ok(), is_right, "{size_px:?}");
        }
        let error = check_view_size(UVec2::splat(u32::MAX), "views.camera.size_px").unwrap_err().to_string();
        assert!(error.starts_with("views.camera.size_px is 4294967295×4294967295, must be 67108864"), "{error}");
    }

    #[test]
    fn only_live_streams_may_request_no_view() {
        assert!(check_view_count(0, true).is_ok() && check_view_count(1, true).is_ok());
        assert!(check_view_count(9, false).is_ok() && check_view_count(0, false).is_err());
        assert!(check_view_count(2, true).unwrap_err().to_string().contains("views of a live stream has 2"));
    }
}
