//! Why a message is refused. Every kind names the field.

use depth_image::{CameraError, LightError};
use tonic::Status;

use crate::codec::ChunkError;
use crate::view::ViewCodecError;

/// A message that does not say what it must.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WireError {
    /// A message or a oneof that must be there is not.
    #[error("{field} is missing")]
    Missing {
        /// Which.
        field: &'static str,
    },
    /// A camera that cannot be used.
    #[error("{field}: {source}")]
    Camera {
        /// Which.
        field: &'static str,
        /// Why.
        source: CameraError,
    },
    /// A light that cannot be.
    #[error("{field}: {source}")]
    Light {
        /// Which.
        field: &'static str,
        /// Why.
        source: LightError,
    },
    /// More entries or bytes than any peer needs.
    #[error("{field} has {count}, at most {limit} are allowed")]
    TooMany {
        /// Which.
        field: &'static str,
        /// Given.
        count: u64,
        /// Allowed.
        limit: u64,
    },
    /// A value outside what the field allows.
    #[error("{field} is {value}, must be {allowed}")]
    OutOfRange {
        /// Which.
        field: &'static str,
        /// What was given.
        value: String,
        /// What would be right.
        allowed: &'static str,
    },
    /// An enum value that this version does not know, or none.
    #[error("{field} has the unknown value {value}")]
    UnknownEnum {
        /// Which.
        field: &'static str,
        /// As it came.
        value: i32,
    },
    /// A program whose messages mean something else.
    #[error("{field} is {found}, must be {expected}: this program is of another version")]
    Version {
        /// Which.
        field: &'static str,
        /// The sender's; 0 where it says none.
        found: u32,
        /// Ours.
        expected: u32,
    },
    /// Data that contradicts its header: corrupt, truncated, reordered or repeated.
    #[error("{field} is corrupt: {reason}")]
    Corrupt {
        /// Which.
        field: &'static str,
        /// What does not fit.
        reason: String,
    },
}

impl WireError {
    pub(crate) fn out_of_range(field: &'static str, value: impl ToString, allowed: &'static str) -> Self {
        Self::OutOfRange { field, value: value.to_string(), allowed }
    }

    pub(crate) fn corrupt(field: &'static str, reason: impl ToString) -> Self {
        Self::Corrupt { field, reason: reason.to_string() }
    }
}

impl From<WireError> for Status {
    fn from(error: WireError) -> Self {
        match error {
            WireError::Corrupt { .. } => Self::data_loss(error.to_string()),
            WireError::Version { .. } => Self::failed_precondition(error.to_string()),
            _ => Self::invalid_argument(error.to_string()),
        }
    }
}

impl From<ChunkError> for WireError {
    fn from(error: ChunkError) -> Self {
        Self::corrupt("chunk", error)
    }
}

impl From<ViewCodecError> for WireError {
    fn from(error: ViewCodecError) -> Self {
        Self::corrupt("frame", error)
    }
}

/// The message in an optional field.
pub(crate) fn required<T>(value: Option<T>, field: &'static str) -> Result<T, WireError> {
    value.ok_or(WireError::Missing { field })
}

/// Refuses more than `limit` before anything is allocated for them.
pub(crate) fn at_most(count: usize, limit: usize, field: &'static str) -> Result<(), WireError> {
    if count <= limit { Ok(()) } else { Err(WireError::TooMany { field, count: count as u64, limit: limit as u64 }) }
}
