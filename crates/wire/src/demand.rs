//! How much a session asks for, and what it makes do with.

use depth_image::PinholeCamera;

use crate::error::{WireError, at_most};
use crate::geometry::{pinhole_to, viewpoints_from};
use crate::limits::{MAX_FALLBACKS, MAX_FRAMES_PER_S, MAX_VIEWS_PER_SET, nonempty};
use crate::proto;

/// Less than what was asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    /// How samples are lit.
    pub lighting: String,
    /// How views are reconstructed.
    pub method: String,
    /// Sides of sample images, of those asked for: above 0, at most 1.
    pub sample_side_ratio: f64,
    /// Pictures a second, of those asked for: above 0, at most 1.
    pub frame_rate_ratio: f64,
}

impl TryFrom<proto::Quality> for Quality {
    type Error = WireError;

    fn try_from(q: proto::Quality) -> Result<Self, WireError> {
        Ok(Self {
            lighting: nonempty(q.lighting, "fallbacks.lighting")?,
            method: nonempty(q.reconstruction_method, "fallbacks.reconstruction_method")?,
            sample_side_ratio: ratio_from(q.sample_side_ratio, "fallbacks.sample_side_ratio")?,
            frame_rate_ratio: ratio_from(q.frame_rate_ratio, "fallbacks.frame_rate_ratio")?,
        })
    }
}

impl From<Quality> for proto::Quality {
    fn from(q: Quality) -> Self {
        Self {
            lighting: q.lighting,
            reconstruction_method: q.method,
            sample_side_ratio: q.sample_side_ratio,
            frame_rate_ratio: q.frame_rate_ratio,
        }
    }
}

pub(crate) fn fallbacks_from(fallbacks: Vec<proto::Quality>) -> Result<Vec<Quality>, WireError> {
    at_most(fallbacks.len(), MAX_FALLBACKS, "fallbacks")?;
    fallbacks.into_iter().map(TryInto::try_into).collect()
}

pub(crate) fn ratio_from(value: f64, field: &'static str) -> Result<f64, WireError> {
    let ok = value > 0.0 && value <= 1.0;
    if ok { Ok(value) } else { Err(WireError::out_of_range(field, value, "above 0 and at most 1")) }
}

pub(crate) fn rate_from(frames_per_s: f64) -> Result<f64, WireError> {
    let ok = (0.0..=MAX_FRAMES_PER_S).contains(&frames_per_s);
    if ok { Ok(frames_per_s) } else { Err(WireError::out_of_range("frames_per_s", frames_per_s, "from 0 to 1000")) }
}

/// A session wants more, or less.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangeSession {
    /// Which.
    pub session: u64,
    /// V: views that are asked of each sample set.
    pub views_per_set: u32,
    /// Pictures a second; 0: as fast as they come.
    pub frames_per_s: f64,
    /// From where it looks from now on; empty: as before.
    pub viewpoints: Vec<PinholeCamera>,
}

impl TryFrom<proto::ChangeSessionRequest> for ChangeSession {
    type Error = WireError;

    fn try_from(c: proto::ChangeSessionRequest) -> Result<Self, WireError> {
        if c.views_per_set_count > MAX_VIEWS_PER_SET {
            return Err(WireError::out_of_range("views_per_set_count", c.views_per_set_count, "from 0 to 65536"));
        }
        Ok(Self {
            session: c.session_number,
            views_per_set: c.views_per_set_count,
            frames_per_s: rate_from(c.frames_per_s)?,
            viewpoints: viewpoints_from(c.viewpoints)?,
        })
    }
}

impl From<ChangeSession> for proto::ChangeSessionRequest {
    fn from(c: ChangeSession) -> Self {
        Self {
            session_number: c.session,
            views_per_set_count: c.views_per_set,
            frames_per_s: c.frames_per_s,
            viewpoints: c.viewpoints.iter().map(pinhole_to).collect(),
        }
    }
}
