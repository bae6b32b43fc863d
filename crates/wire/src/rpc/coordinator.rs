//! The coordinator's service.

use cluster::{
    ChangeSession, ClusterStatus, FetchScene, JoinCluster, SamplerReport, ScenePart, SessionEvent, SessionRequest,
    Welcome, WorkReport,
};
use tonic::transport::Channel;
use tonic::{Request, Response, Status, async_trait};

use super::{Messages, answer, answered, answers, capped, checked, outgoing};
use crate::proto;
use crate::proto::coordinator_service_client::CoordinatorServiceClient;
use crate::proto::coordinator_service_server::{CoordinatorService, CoordinatorServiceServer};

/// Knows the members, plans sessions and serves scenes.
#[async_trait]
pub trait Coordinator: Send + Sync + 'static {
    /// Membership lasts as long as the stream.
    async fn join_cluster(&self, request: JoinCluster) -> Result<Messages<Welcome>, Status>;
    /// The session's number, progress, every plan that comes into force, and the end of the session.
    async fn open_session(&self, request: SessionRequest) -> Result<Messages<SessionEvent>, Status>;
    /// Changes what a session asks for.
    async fn change_session(&self, request: ChangeSession) -> Result<(), Status>;
    /// Takes a member's report on its work.
    async fn report_work(&self, request: WorkReport) -> Result<(), Status>;
    /// A scene's package from an offset on.
    async fn fetch_scene(&self, request: FetchScene) -> Result<Messages<ScenePart>, Status>;
    /// The members.
    async fn status(&self) -> Result<ClusterStatus, Status>;
    /// Takes a compositor's report on a sampler whose images it cannot get.
    async fn report_sampler(&self, report: SamplerReport) -> Result<(), Status>;
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

    async fn change_session(
        &self,
        request: Request<proto::ChangeSessionRequest>,
    ) -> Result<Response<proto::ChangeSessionResponse>, Status> {
        self.0.change_session(checked(request)?).await?;
        Ok(Response::new(proto::ChangeSessionResponse {}))
    }

    async fn report_work(
        &self,
        request: Request<proto::ReportWorkRequest>,
    ) -> Result<Response<proto::ReportWorkResponse>, Status> {
        self.0.report_work(checked(request)?).await?;
        Ok(Response::new(proto::ReportWorkResponse {}))
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

    async fn report_sampler(
        &self,
        request: Request<proto::ReportSamplerRequest>,
    ) -> Result<Response<proto::ReportSamplerResponse>, Status> {
        self.0.report_sampler(checked(request)?).await?;
        Ok(answer(proto::ReportSamplerResponse {}))
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
        Ok(answers(self.0.clone().join_cluster(request).await?.into_inner()))
    }

    /// See [`Coordinator::open_session`].
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn open_session(&self, request: SessionRequest) -> Result<Messages<SessionEvent>, Status> {
        let request: proto::OpenSessionRequest = request.into();
        Ok(answers(self.0.clone().open_session(request).await?.into_inner()))
    }

    /// See [`Coordinator::change_session`].
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn change_session(&self, request: ChangeSession) -> Result<(), Status> {
        let request: proto::ChangeSessionRequest = request.into();
        self.0.clone().change_session(request).await.map(drop)
    }

    /// See [`Coordinator::report_work`].
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn report_work(&self, request: WorkReport) -> Result<(), Status> {
        let request: proto::ReportWorkRequest = request.into();
        self.0.clone().report_work(request).await.map(drop)
    }

    /// See [`Coordinator::fetch_scene`].
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn fetch_scene(&self, request: FetchScene) -> Result<Messages<ScenePart>, Status> {
        let request: proto::FetchSceneRequest = request.into();
        Ok(answers(self.0.clone().fetch_scene(request).await?.into_inner()))
    }

    /// See [`Coordinator::status`].
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn status(&self) -> Result<ClusterStatus, Status> {
        answered(self.0.clone().get_status(proto::GetStatusRequest {}).await?.into_inner())
    }

    /// See [`Coordinator::report_sampler`].
    ///
    /// # Errors
    /// The coordinator's; `FAILED_PRECONDITION` where the plan is not in force.
    pub async fn report_sampler(&self, report: SamplerReport) -> Result<(), Status> {
        let request: proto::ReportSamplerRequest = report.into();
        self.0.clone().report_sampler(request).await.map(drop)
    }
}
