//! Live streams: the newest view counts.

use crate::error::{WireError, at_most};
use crate::limits::MAX_LIVE_VIEWS_PER_REQUEST;
use crate::proto;

/// What a live stream's request says beside its view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LiveRequest {
    /// All frames up to this number have come.
    pub acknowledged_frame: u64,
    /// The client's own choice: names it in logs.
    pub client_id: u64,
}

impl From<proto::LiveRequest> for LiveRequest {
    fn from(r: proto::LiveRequest) -> Self {
        Self { acknowledged_frame: r.acknowledged_frame_number, client_id: r.client_id }
    }
}

impl From<LiveRequest> for proto::LiveRequest {
    fn from(r: LiveRequest) -> Self {
        Self { acknowledged_frame_number: r.acknowledged_frame, client_id: r.client_id }
    }
}

/// A live stream may open, and acknowledge, without a view; all others ask for one at least.
pub(crate) fn view_counts(count: usize, is_live: bool) -> Result<(), WireError> {
    match (is_live, count) {
        (true, _) => at_most(count, MAX_LIVE_VIEWS_PER_REQUEST, "views of a live stream"),
        (false, 0) => Err(WireError::Missing { field: "views" }),
        (false, _) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_live_streams_ask_for_nothing() {
        assert!(view_counts(0, true).is_ok() && view_counts(1, true).is_ok() && view_counts(9, false).is_ok());
        assert!(view_counts(0, false).is_err());
        assert!(view_counts(2, true).unwrap_err().to_string().contains("views of a live stream has 2"));
    }
}
