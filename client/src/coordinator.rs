//! The way to a coordinator.

use std::time::Duration;

use cluster::{ClusterStatus, SessionEvent, SessionRequest};
use tokio::time::Instant;
use wire::rpc::{CoordinatorClient, connect};

use crate::error::ClientError;
use crate::session::Session;

/// A connection to a coordinator.
#[derive(Debug, Clone)]
pub struct Client {
    coordinator: CoordinatorClient,
}

impl Client {
    /// Connects to `http://host:port`.
    ///
    /// # Errors
    /// Where nobody answers.
    pub async fn connect(coordinator: &str) -> Result<Self, ClientError> {
        let channel = connect(coordinator).await.map_err(ClientError::coordinator)?;
        Ok(Self { coordinator: CoordinatorClient::new(channel) })
    }

    /// The cluster's members.
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn status(&self) -> Result<ClusterStatus, ClientError> {
        self.coordinator.get_status(()).await.map_err(ClientError::coordinator)
    }

    /// Waits until `wanted` nodes have joined.
    ///
    /// # Errors
    /// The coordinator's; [`ClientError::FewNodes`] where they do not join in time.
    pub async fn wait_for_nodes(&self, wanted: usize, deadline: Duration) -> Result<ClusterStatus, ClientError> {
        let end = Instant::now() + deadline;
        loop {
            let status = self.status().await?;
            if status.nodes.len() >= wanted {
                return Ok(status);
            }
            if Instant::now() >= end {
                return Err(ClientError::FewNodes { joined: status.nodes.len(), wanted });
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }

    /// Opens a session; `progress` is called with what the coordinator does meanwhile.
    ///
    /// # Errors
    /// The coordinator's, with its reason.
    pub async fn open_session(
        &self,
        request: SessionRequest,
        progress: impl FnMut(&SessionEvent),
    ) -> Result<Session, ClientError> {
        Session::open(&self.coordinator, request, progress).await
    }
}
