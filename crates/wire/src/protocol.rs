//! Which programs understand each other.

use crate::error::WireError;

/// Rises whenever a message comes to mean something else: programs that join a cluster must have the coordinator's.
pub const PROTOCOL_VERSION: u32 = 1;

/// Refuses other versions, and programs of before there were any.
pub(crate) fn same_version(found: u32) -> Result<(), WireError> {
    if found == PROTOCOL_VERSION {
        return Ok(());
    }
    Err(WireError::Version { field: "protocol_version", found, expected: PROTOCOL_VERSION })
}
