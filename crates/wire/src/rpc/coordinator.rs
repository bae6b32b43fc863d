//! The coordinator's service.

use tonic::transport::Channel;
use tonic::{Request, Response, Status, async_trait};

use super::{Messages, answer, capped, checked, incoming, outgoing};
use crate::proto::coordinator_service_client::CoordinatorServiceClient;
use crate::proto::coordinator_service_server::{CoordinatorService, CoordinatorServiceServer};
use crate::{ClusterStatus, FetchScene, JoinCluster, ScenePart, SessionEvent, SessionRequest, Welcome, proto};

/// Knows the members, plans sessions and hands out scenes.
#[async_trait]
pub trait Coordinator: Send + Sync + 'static {
    /// Membership lasts as long as the stream.
    async fn join_cluster(&self, request: JoinCluster) -> Result<Messages<Welcome>, Status>;
    /// Progress, one plan, and word when it no longer holds.
    async fn open_session(&self, request: SessionRequest) -> Result<Messages<SessionEvent>, Status>;
    /// A scene's package from an offset on.
    async fn fetch_scene(&self, request: FetchScene) -> Result<Messages<ScenePart>, Status>;
    /// The members.
    async fn status(&self) -> Result<ClusterStatus, Status>;
}

/// Adapts a [`Coordinator`] to its messages.
#[derive(Debug)]
pub struct CoordinatorAdapter<C>(C);

#[async_trait]
impl<C: Coordinator> CoordinatorService for CoordinatorAdapter<C> {
    type JoinClusterStream = Messages<proto::JoinClusterResponse>;
    type OpenSessionStream = Messages<proto::OpenSessionResponse>;
    type FetchSceneStream = Messages<proto::FetchSceneResponse>;

    async fn join_cluster(
        &self,
        request: Request<proto::JoinClusterRequest>,
    ) -> Result<Response<Self::JoinClusterStream>, Status> {
        Ok(answer(outgoing(self.0.join_cluster(checked(request)?).await?)))
    }

    async fn open_session(
        &self,
        request: Request<proto::OpenSessionRequest>,
    ) -> Result<Response<Self::OpenSessionStream>, Status> {
        Ok(answer(outgoing(self.0.open_session(checked(request)?).await?)))
    }

    async fn fetch_scene(
        &self,
        request: Request<proto::FetchSceneRequest>,
    ) -> Result<Response<Self::FetchSceneStream>, Status> {
        Ok(answer(outgoing(self.0.fetch_scene(checked(request)?).await?)))
    }

    async fn get_status(
        &self,
        _request: Request<proto::GetStatusRequest>,
    ) -> Result<Response<proto::GetStatusResponse>, Status> {
        Ok(answer(self.0.status().await?))
    }
}

/// The service, ready to be added to a server.
pub fn coordinator_server<C: Coordinator>(coordinator: C) -> CoordinatorServiceServer<CoordinatorAdapter<C>> {
    capped!(CoordinatorServiceServer::new(CoordinatorAdapter(coordinator)))
}

/// Calls the coordinator.
#[derive(Debug, Clone)]
pub struct CoordinatorClient(CoordinatorServiceClient<Channel>);

impl CoordinatorClient {
    /// Over a connection.
    #[must_use]
    pub fn new(channel: Channel) -> Self {
        Self(capped!(CoordinatorServiceClient::new(channel)))
    }

    /// See [`Coordinator::join_cluster`].
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn join_cluster(&self, request: JoinCluster) -> Result<Messages<Welcome>, Status> {
        let request: proto::JoinClusterRequest = request.into();
        Ok(incoming(self.0.clone().join_cluster(request).await?.into_inner()))
    }

    /// See [`Coordinator::open_session`].
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn open_session(&self, request: SessionRequest) -> Result<Messages<SessionEvent>, Status> {
        let request: proto::OpenSessionRequest = request.into();
        Ok(incoming(self.0.clone().open_session(request).await?.into_inner()))
    }

    /// See [`Coordinator::fetch_scene`].
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn fetch_scene(&self, request: FetchScene) -> Result<Messages<ScenePart>, Status> {
        let request: proto::FetchSceneRequest = request.into();
        Ok(incoming(self.0.clone().fetch_scene(request).await?.into_inner()))
    }

    /// See [`Coordinator::status`].
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn status(&self) -> Result<ClusterStatus, Status> {
        Ok(self.0.clone().get_status(proto::GetStatusRequest {}).await?.into_inner().try_into()?)
    }
}
