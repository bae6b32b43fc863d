//! Thin client library: ask for views, receive frames. Links no wgpu.
//!
//! A [`Client`] knows the coordinator; a [`Session`] has a plan and talks to the compositors alone.
#![cfg_attr(test, allow(clippy::unwrap_used))]

mod error;
mod expected;
mod flow_control;
mod frames;
mod live;
mod live_stream;
mod live_view;
mod places;
mod plan_change;
mod poses;
mod request_pump;
mod session;
mod trouble;
mod work_stealing;

use std::time::Duration;

use cluster::{ClusterStatus, SessionEvent, SessionRequest};
use tokio::time::Instant;
use wire::rpc::{CoordinatorClient, connect};

pub use error::ClientError;
pub use flow_control::FlowControl;
pub use frames::{Frame, Frames};
pub use live_view::{LiveFrame, LiveTimes, LiveView};
pub use session::{Session, ViewRequest};
pub use work_stealing::WorkStealing;

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
        self.coordinator.status().await.map_err(ClientError::coordinator)
    }

    /// Waits until so many nodes have joined.
    ///
    /// # Errors
    /// The coordinator's; [`ClientError::FewNodes`] where they do not come in time.
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

    /// Opens a session; `progress` hears what the coordinator is doing meanwhile. Another session on the
    /// same cluster takes this one's place.
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
