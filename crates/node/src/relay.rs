//! Images that a node relays from other nodes to others.

use codec::EncodedDepthImage;
use tonic::{Status, async_trait};
use wire::rpc::Messages;

use crate::cell_plan::CellPlan;

/// Relays images as they arrive: a compositor does.
#[async_trait]
pub trait Relay: Send + Sync + 'static {
    /// All images of a cell's set with their indices, in the order they arrive.
    ///
    /// # Errors
    /// Where they are no longer buffered; in the stream, where their fetch fails.
    async fn images(&self, plan: &CellPlan, set_index: u32) -> Result<Messages<(u32, EncodedDepthImage)>, Status>;
}
