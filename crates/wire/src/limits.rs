//! What any peer may ask for. Checked before anything is allocated.

use depth_image::SpecularPlanes;

use crate::error::{WireError, at_most};

/// Sample cameras of one view cell; provenance has room for 24.
pub const MAX_SAMPLE_CAMERAS: usize = 16;
/// View cells of one workload.
pub const MAX_CELLS: usize = 64;
/// Viewpoints of one session.
pub const MAX_VIEWPOINTS: usize = 256;
/// Tiles of one sample image.
pub const MAX_TILES: u32 = 16;
/// Fallbacks of one session.
pub const MAX_FALLBACKS: usize = 16;
/// Lights of one scene.
pub const MAX_LIGHTS: usize = 255;
/// Planes of visibility of one sample image: one byte for the environment and each light.
pub const MAX_VISIBILITY_PLANES: usize = SpecularPlanes::visibility_planes(MAX_LIGHTS);
/// Steps in which a still picture's light is refined.
pub const MAX_REFINEMENT_STEPS: u32 = 64;
/// Views of one request.
pub const MAX_VIEWS_PER_REQUEST: usize = 4096;
/// Views of one request of a live stream.
pub const MAX_LIVE_VIEWS_PER_REQUEST: usize = 1;
/// Views of one sample set in a session.
pub const MAX_VIEWS_PER_SET: u32 = 1 << 16;
/// Pictures a second of one session.
pub const MAX_FRAMES_PER_S: f64 = 1000.0;
/// Sample sets of one timeline.
pub const MAX_SETS: u32 = 1 << 20;
/// Nodes of one plan.
pub const MAX_NODES: usize = 1024;
/// Scenes on offer.
pub const MAX_SCENES: usize = 64;
/// Views measured in one call.
pub const MAX_BATCH: u32 = 64;
/// Bytes of a name, an address or a method.
pub const MAX_TEXT_BYTES: usize = 256;
/// Bytes of a reason or a progress line.
pub const MAX_REASON_BYTES: usize = 4096;
/// Bytes of one scene package.
pub const MAX_SCENE_BYTES: u64 = 8 << 30;
/// Bytes of one encoded frame, all planes.
pub const MAX_FRAME_BYTES: u64 = 512 << 20;
/// Data bytes of one message of a stream.
pub const PART_BYTES: usize = 512 * 1024;
/// Bytes of one decoded message: tonic's default of 4 MiB is reserved in full on a five-byte header.
pub const MAX_MESSAGE_BYTES: usize = 2 << 20;

/// A short text.
pub(crate) fn text(value: String, field: &'static str) -> Result<String, WireError> {
    at_most(value.len(), MAX_TEXT_BYTES, field)?;
    Ok(value)
}

/// A short text that says something.
pub(crate) fn nonempty(value: String, field: &'static str) -> Result<String, WireError> {
    if value.is_empty() { Err(WireError::Missing { field }) } else { text(value, field) }
}

/// A text that a person reads.
pub(crate) fn reason(value: String, field: &'static str) -> Result<String, WireError> {
    at_most(value.len(), MAX_REASON_BYTES, field)?;
    Ok(value)
}

/// A finite number, not negative.
pub(crate) fn seconds(value: f64, field: &'static str) -> Result<f64, WireError> {
    let ok = value.is_finite() && value >= 0.0;
    if ok { Ok(value) } else { Err(WireError::out_of_range(field, value, "finite and not negative")) }
}
