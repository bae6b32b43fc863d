//! The compositor's service.

use cluster::RenderViews;
use codec::FramePart;
use tokio_stream::StreamExt as _;
use tonic::transport::Channel;
use tonic::{Request, Response, Status, Streaming, async_trait};

use super::{Messages, answer, answers, capped, incoming, outgoing};
use crate::proto;
use crate::proto::compositor_service_client::CompositorServiceClient;
use crate::proto::compositor_service_server::{CompositorService, CompositorServiceServer};

/// Makes views.
#[async_trait]
pub trait Compositor: Send + Sync + 'static {
    /// Poses in, frames out, in the order they are ready.
    async fn render_views(&self, requests: Messages<RenderViews>) -> Result<Messages<FramePart>, Status>;
}

/// Adapts a [`Compositor`] to its messages.
#[derive(Debug)]
pub struct CompositorAdapter<C>(C);

#[async_trait]
impl<C: Compositor> CompositorService for CompositorAdapter<C> {
    type RenderViewsStream = Messages<proto::RenderViewsResponse>;

    async fn render_views(
        &self,
        request: Request<Streaming<proto::RenderViewsRequest>>,
    ) -> Result<Response<Self::RenderViewsStream>, Status> {
        let frames = self.0.render_views(incoming(request.into_inner())).await?;
        Ok(answer(outgoing(frames)))
    }
}

/// The service, ready to be added to a server.
pub fn compositor_server<C: Compositor>(compositor: C) -> CompositorServiceServer<CompositorAdapter<C>> {
    capped!(CompositorServiceServer::new(CompositorAdapter(compositor)))
}

/// Calls a compositor.
#[derive(Debug, Clone)]
pub struct CompositorClient(CompositorServiceClient<Channel>);

impl CompositorClient {
    /// Over a connection.
    #[must_use]
    pub fn new(channel: Channel) -> Self {
        Self(capped!(CompositorServiceClient::new(channel)))
    }

    /// See [`Compositor::render_views`].
    ///
    /// # Errors
    /// The compositor's.
    pub async fn render_views(
        &self,
        requests: impl tokio_stream::Stream<Item = RenderViews> + Send + 'static,
    ) -> Result<Messages<FramePart>, Status> {
        let requests = requests.map(proto::RenderViewsRequest::from);
        Ok(answers(self.0.clone().render_views(requests).await?.into_inner()))
    }
}
