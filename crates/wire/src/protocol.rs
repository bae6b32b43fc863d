//! Versions of the protocol.

use crate::error::WireError;

/// Rises whenever the meaning of a message changes: programs that join a cluster must have the coordinator's.
pub const PROTOCOL_VERSION: u32 = 1;

/// Refuses other versions, and programs from before versions were stated.
pub(crate) fn check_version(found: u32) -> Result<(), WireError> {
    if found == PROTOCOL_VERSION {
        return Ok(());
    }
    Err(WireError::Version { field: "protocol_version", found, expected: PROTOCOL_VERSION })
}
