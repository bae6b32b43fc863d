//! Why a message is refused. Every kind names the field.

use cluster::InvalidField;
use tonic::Status;

/// Rises whenever the meaning of a message changes: programs that join a cluster must have the coordinator's.
pub const PROTOCOL_VERSION: u32 = 11;

/// A message that cannot be converted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "self-naming fields")]
pub enum WireError {
    #[error(transparent)]
    Field(#[from] InvalidField),
    /// An enum value that this version does not know, or none.
    #[error("{field} has the unknown value {value}")]
    UnknownEnum { field: &'static str, value: i32 },
    /// A program whose messages have another meaning; `found` is 0 where it states no version.
    #[error("{field} is {found}, must be {expected}: this program is of another version")]
    Version { field: &'static str, found: u32, expected: u32 },
}

impl From<WireError> for Status {
    fn from(error: WireError) -> Self {
        match error {
            WireError::Version { .. } => Self::failed_precondition(error.to_string()),
            WireError::Field(_) | WireError::UnknownEnum { .. } => Self::invalid_argument(error.to_string()),
        }
    }
}

/// Refuses other versions, and programs from before versions were stated.
pub(crate) fn check_version(found: u32) -> Result<(), WireError> {
    if found == PROTOCOL_VERSION {
        return Ok(());
    }
    Err(WireError::Version { field: "protocol_version", found, expected: PROTOCOL_VERSION })
}
