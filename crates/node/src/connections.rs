//! Channels to peers.

use std::collections::HashMap;

use cluster::limits::MAX_NODES;
use tokio::sync::Mutex;
use tonic::Status;
use tonic::transport::Channel;
use wire::rpc::connect;

/// Channels by address. A channel reconnects by itself.
#[derive(Debug, Default)]
pub struct Connections(Mutex<HashMap<String, Channel>>);

impl Connections {
    /// The channel to an address, connected on first use.
    ///
    /// # Errors
    /// Where the address does not answer.
    pub async fn to(&self, address: &str) -> Result<Channel, Status> {
        if let Some(channel) = self.0.lock().await.get(address) {
            return Ok(channel.clone());
        }
        // Not under the lock: one dead peer would hold up all others.
        let channel = connect(address).await?;
        let mut channels = self.0.lock().await;
        if channels.len() >= MAX_NODES {
            channels.clear();
        }
        channels.insert(address.to_owned(), channel.clone());
        Ok(channel)
    }
}
