//! The sampler's service.

use cluster::FetchImages;
use codec::Chunk;
use tonic::transport::Channel;
use tonic::{Request, Response, Status, async_trait};

use super::{Messages, answer, answers, capped, checked, outgoing};
use crate::proto;
use crate::proto::sampler_service_client::SamplerServiceClient;
use crate::proto::sampler_service_server::{SamplerService, SamplerServiceServer};

/// Serves encoded depth images.
#[async_trait]
pub trait Sampler: Send + Sync + 'static {
    /// The chunks of some images of one set.
    async fn fetch_sample_images(&self, request: FetchImages) -> Result<Messages<Chunk>, Status>;
}

/// Adapts a [`Sampler`] to its messages.
#[derive(Debug)]
pub struct SamplerAdapter<S>(S);

#[async_trait]
impl<S: Sampler> SamplerService for SamplerAdapter<S> {
    type FetchSampleImagesStream = Messages<proto::FetchSampleImagesResponse>;

    async fn fetch_sample_images(
        &self,
        request: Request<proto::FetchSampleImagesRequest>,
    ) -> Result<Response<Self::FetchSampleImagesStream>, Status> {
        let chunks = self.0.fetch_sample_images(checked(request)?).await?;
        Ok(answer(outgoing(chunks)))
    }
}

/// The service, ready to be added to a server.
pub fn sampler_server<S: Sampler>(sampler: S) -> SamplerServiceServer<SamplerAdapter<S>> {
    capped!(SamplerServiceServer::new(SamplerAdapter(sampler)))
}

/// Calls a sampler.
#[derive(Debug, Clone)]
pub struct SamplerClient(SamplerServiceClient<Channel>);

impl SamplerClient {
    /// Over a connection.
    #[must_use]
    pub fn new(channel: Channel) -> Self {
        Self(capped!(SamplerServiceClient::new(channel)))
    }

    /// See [`Sampler::fetch_sample_images`].
    ///
    /// # Errors
    /// The sampler's.
    pub async fn fetch_sample_images(&self, request: FetchImages) -> Result<Messages<Chunk>, Status> {
        let request: proto::FetchSampleImagesRequest = request.into();
        Ok(answers(self.0.clone().fetch_sample_images(request).await?.into_inner()))
    }
}
