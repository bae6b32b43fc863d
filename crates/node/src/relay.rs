//! Images that a node has from others and passes on to others.

use codec::EncodedDepthImage;
use tonic::{Status, async_trait};
use wire::rpc::Messages;

use crate::CellPlan;

/// Who passes images on: a compositor, as they come.
#[async_trait]
pub trait Relay: Send + Sync + 'static {
    /// All images of a cell's set with their indices, in the order they come.
    ///
    /// # Errors
    /// Where they are not kept any more; in the stream, where they do not come.
    async fn images(&self, plan: &CellPlan, set_index: u32) -> Result<Messages<(u32, EncodedDepthImage)>, Status>;
}
