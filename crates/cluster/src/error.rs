//! Values that a domain type does not allow.

use depth_image::{CameraError, LightError};

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
