//! The service of every node.

use cluster::{Assignment, Costs, MeasureCosts, Ready};
use tonic::transport::Channel;
use tonic::{Request, Response, Status, async_trait};

use super::{answer, answered, capped, checked};
use crate::proto;
use crate::proto::node_service_client::NodeServiceClient;
use crate::proto::node_service_server::{NodeService, NodeServiceServer};

/// Measures its costs and takes plans.
#[async_trait]
pub trait Node: Send + Sync + 'static {
    /// Measures each cost alone and warm.
    async fn measure_costs(&self, request: MeasureCosts) -> Result<Costs, Status>;
    /// Takes a plan; answers when ready for it.
    async fn apply_assignment(&self, assignment: Assignment) -> Result<Ready, Status>;
}

/// Adapts a [`Node`] to its messages.
#[derive(Debug)]
pub struct NodeAdapter<N>(N);

#[async_trait]
impl<N: Node> NodeService for NodeAdapter<N> {
    async fn measure_costs(
        &self,
        request: Request<proto::MeasureCostsRequest>,
    ) -> Result<Response<proto::MeasureCostsResponse>, Status> {
        Ok(answer(self.0.measure_costs(checked(request)?).await?))
    }

    async fn apply_assignment(
        &self,
        request: Request<proto::ApplyAssignmentRequest>,
    ) -> Result<Response<proto::ApplyAssignmentResponse>, Status> {
        Ok(answer(self.0.apply_assignment(checked(request)?).await?))
    }
}

/// The service, ready to be added to a server.
pub fn node_server<N: Node>(node: N) -> NodeServiceServer<NodeAdapter<N>> {
    capped!(NodeServiceServer::new(NodeAdapter(node)))
}

/// Calls a node.
#[derive(Debug, Clone)]
pub struct NodeClient(NodeServiceClient<Channel>);

impl NodeClient {
    /// Over a connection.
    #[must_use]
    pub fn new(channel: Channel) -> Self {
        Self(capped!(NodeServiceClient::new(channel)))
    }

    /// See [`Node::measure_costs`].
    ///
    /// # Errors
    /// The node's.
    pub async fn measure_costs(&self, request: MeasureCosts) -> Result<Costs, Status> {
        let request: proto::MeasureCostsRequest = request.into();
        answered(self.0.clone().measure_costs(request).await?.into_inner())
    }

    /// See [`Node::apply_assignment`].
    ///
    /// # Errors
    /// The node's; `FAILED_PRECONDITION` for an epoch below the one it has.
    pub async fn apply_assignment(&self, assignment: Assignment) -> Result<Ready, Status> {
        let request: proto::ApplyAssignmentRequest = assignment.into();
        answered(self.0.clone().apply_assignment(request).await?.into_inner())
    }
}
