//! Values that a type does not allow, and checks that several types share.

use std::ops::RangeInclusive;

use depth_image::{Camera, CameraError, LightError, PinholeCamera};

use crate::limits::{MAX_FRAMES_PER_S, MAX_REASON_BYTES, MAX_TEXT_BYTES, MAX_TILES, MAX_VIEWPOINTS};

/// A value that its field does not allow.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum InvalidField {
    #[error("{field} is missing")]
    Missing { field: &'static str },
    #[error("{field}: {source}")]
    Camera { field: &'static str, source: CameraError },
    #[error("{field}: {source}")]
    Light { field: &'static str, source: LightError },
    /// More entries or bytes than any peer needs.
    #[error("{field} has {count}, at most {limit} are allowed")]
    TooMany { field: &'static str, count: u64, limit: u64 },
    #[error("{field} is {value}, must be {allowed}")]
    OutOfRange { field: &'static str, value: String, allowed: &'static str },
}

impl InvalidField {
    /// A value outside the range that a field allows.
    #[must_use]
    pub fn out_of_range(field: &'static str, value: impl ToString, allowed: &'static str) -> Self {
        Self::OutOfRange { field, value: value.to_string(), allowed }
    }
}

/// At most `limit` entries or bytes.
///
/// # Errors
/// For more.
pub fn at_most(count: usize, limit: usize, field: &'static str) -> Result<(), InvalidField> {
    if count <= limit { Ok(()) } else { Err(InvalidField::TooMany { field, count: count as u64, limit: limit as u64 }) }
}

/// A text of at most [`MAX_TEXT_BYTES`].
///
/// # Errors
/// For a longer one.
pub fn text(value: &str, field: &'static str) -> Result<(), InvalidField> {
    at_most(value.len(), MAX_TEXT_BYTES, field)
}

/// A text of 1 to [`MAX_TEXT_BYTES`].
///
/// # Errors
/// For an empty or a longer one.
pub fn nonempty(value: &str, field: &'static str) -> Result<(), InvalidField> {
    if value.is_empty() { Err(InvalidField::Missing { field }) } else { text(value, field) }
}

/// A text for a person, of at most [`MAX_REASON_BYTES`].
///
/// # Errors
/// For a longer one.
pub fn reason(value: &str, field: &'static str) -> Result<(), InvalidField> {
    at_most(value.len(), MAX_REASON_BYTES, field)
}

/// A finite number that is not negative, or none.
///
/// # Errors
/// For any other.
pub fn finite_seconds(value: impl Into<Option<f64>>, field: &'static str) -> Result<(), InvalidField> {
    match value.into() {
        Some(value) if !(value.is_finite() && value >= 0.0) => {
            Err(InvalidField::out_of_range(field, value, "finite and not negative"))
        }
        _ => Ok(()),
    }
}

/// Checks fields by their names, as [`finite_seconds`] does.
#[macro_export]
macro_rules! check_seconds {
    ($of:expr; $($field:ident),+) => {
        $($crate::finite_seconds($of.$field, stringify!($field))?;)+
    };
}

/// A number above 0 and at most 1.
///
/// # Errors
/// For any other.
pub fn ratio(value: f64, field: &'static str) -> Result<(), InvalidField> {
    let is_valid = value > 0.0 && value <= 1.0;
    if is_valid { Ok(()) } else { Err(InvalidField::out_of_range(field, value, "above 0 and at most 1")) }
}

/// A value of a range, which `allowed` says in words.
///
/// # Errors
/// For any other, NaN too.
pub(crate) fn within<T: PartialOrd + ToString>(
    value: T,
    range: RangeInclusive<T>,
    field: &'static str,
    allowed: &'static str,
) -> Result<(), InvalidField> {
    if range.contains(&value) { Ok(()) } else { Err(InvalidField::out_of_range(field, value, allowed)) }
}

/// Pictures a second: above 0, at most [`MAX_FRAMES_PER_S`]; `None`: as fast as they come.
///
/// # Errors
/// For any other rate.
pub fn frame_rate(frames_per_s: Option<f64>) -> Result<(), InvalidField> {
    match frames_per_s {
        Some(rate) if !(rate > 0.0 && rate <= MAX_FRAMES_PER_S) => {
            Err(InvalidField::out_of_range("frames_per_s", rate, "above 0 and at most 1000"))
        }
        _ => Ok(()),
    }
}

/// Tiles of an image: from 1 to [`MAX_TILES`].
///
/// # Errors
/// For any other count.
pub fn tile_count(count: u32) -> Result<(), InvalidField> {
    within(count, 1..=MAX_TILES, "tile_count", "from 1 to 16")
}

/// The viewpoints of a session: at most [`MAX_VIEWPOINTS`] valid cameras.
///
/// # Errors
/// For more, and for a camera that cannot be used.
pub fn viewpoints(viewpoints: &[PinholeCamera]) -> Result<(), InvalidField> {
    at_most(viewpoints.len(), MAX_VIEWPOINTS, "viewpoints")?;
    let mut checked = viewpoints.iter().map(PinholeCamera::validate);
    checked.try_for_each(|camera| camera.map_err(|source| InvalidField::Camera { field: "viewpoints", source }))
}

/// Views are made from pinholes.
pub(crate) fn pinholes<'a>(mut cameras: impl Iterator<Item = &'a Camera>) -> Result<(), InvalidField> {
    let bent = cameras.find(|camera| camera.pinhole().is_none());
    bent.map_or(Ok(()), |camera| {
        Err(InvalidField::out_of_range("sample_cameras.model", camera.model_name(), "pinhole in view cells"))
    })
}
