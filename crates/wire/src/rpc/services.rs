//! The services: of each the trait that serves it, its server and its client.

use std::pin::Pin;

use cluster::{
    ApplyPlan, ChangeSession, ClusterStatus, FetchImages, FetchScene, JoinCluster, MeasureCosts, Measured, Ready,
    RenderViews, SamplerReport, ScenePart, SessionEvent, SessionRequest, Welcome, WorkReport,
};
use codec::{Chunk, FramePart};
use tokio_stream::{Stream, StreamExt as _};
use tonic::transport::Channel;
use tonic::{Request, Response, Status, Streaming, async_trait};

use super::MAX_MESSAGE_BYTES;
use super::liveness::{WatchedChannel, begun, with_signs, without_signs};
use crate::convert::Convert;
use crate::proto;
use crate::proto::compositor_service_client::CompositorServiceClient;
use crate::proto::compositor_service_server::{CompositorService, CompositorServiceServer};
use crate::proto::coordinator_service_client::CoordinatorServiceClient;
use crate::proto::coordinator_service_server::{CoordinatorService, CoordinatorServiceServer};
use crate::proto::node_service_client::NodeServiceClient;
use crate::proto::node_service_server::{NodeService, NodeServiceServer};
use crate::proto::sampler_service_client::SamplerServiceClient;
use crate::proto::sampler_service_server::{SamplerService, SamplerServiceServer};

/// A stream of messages, already checked.
pub type Messages<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

fn checked<P, D: Convert<P>>(message: P) -> Result<D, Status> {
    Ok(D::read(message, "request")?)
}

/// As [`checked`], for answers of a server: their faults are not the request's.
fn answered<P, D: Convert<P>>(message: P) -> Result<D, Status> {
    D::read(message, "response").map_err(|error| Status::data_loss(error.to_string()))
}

fn each<P: 'static, D: 'static>(
    stream: impl Stream<Item = Result<P, Status>> + Send + 'static,
    convert: fn(P) -> Result<D, Status>,
) -> Messages<D> {
    Box::pin(stream.map(move |message| message.and_then(convert)))
}

/// A server's stream as messages.
fn sent<P: Default + Send + 'static, D: Convert<P> + 'static>(items: Messages<D>) -> Messages<P> {
    Box::pin(with_signs(items.map(|item| item.map(D::write))))
}

/// A server's messages as what they say.
fn received<P: Default + PartialEq + Send + 'static, D: Convert<P> + 'static>(messages: Streaming<P>) -> Messages<D> {
    each(without_signs(messages), answered)
}

/// A service: its trait, the adapter of the trait to messages, its server, and its client.
macro_rules! service {
    (
        $(#[$about:meta])*
        $trait:ident: $service:ident($generated_server:ident, $generated_client:ident)
            as $server:ident, $adapter:ident, $client:ident;
        calls { $($(#[$of_call:meta])* $call:ident($request:ident as $asked:ty) -> $response:ident as $answer:ty;)* }
        streams {
            $($(#[$of_stream:meta])*
            $stream:ident($opening:ident as $wanted:ty) -> $stream_type:ident($part:ident as $item:ty);)*
        }
        $(duplex {
            $(#[$of_duplex:meta])*
            $duplex:ident($sent:ident as $given:ty) -> $duplex_type:ident($received:ident as $taken:ty);
        })?
    ) => {
        $(#[$about])*
        #[async_trait]
        pub trait $trait: Send + Sync + 'static {
            $($(#[$of_call])* async fn $call(&self, request: $asked) -> Result<$answer, Status>;)*
            $($(#[$of_stream])* async fn $stream(&self, request: $wanted) -> Result<Messages<$item>, Status>;)*
            $($(#[$of_duplex])*
            async fn $duplex(&self, requests: Messages<$given>) -> Result<Messages<$taken>, Status>;)?
        }

        #[doc = concat!("Adapts a [`", stringify!($trait), "`] to its messages.")]
        #[derive(Debug)]
        pub struct $adapter<S>(S);

        #[async_trait]
        impl<S: $trait> $service for $adapter<S> {
            $(type $stream_type = Messages<proto::$part>;)*

            $(async fn $call(&self, request: Request<proto::$request>) -> Result<Response<proto::$response>, Status> {
                let answer = self.0.$call(checked(request.into_inner())?).await?;
                Ok(Response::new(answer.write()))
            })*

            $(async fn $stream(
                &self,
                request: Request<proto::$opening>,
            ) -> Result<Response<Self::$stream_type>, Status> {
                let items = self.0.$stream(checked(request.into_inner())?).await?;
                Ok(Response::new(sent(items)))
            })*

            $(type $duplex_type = Messages<proto::$received>;

            async fn $duplex(
                &self,
                requests: Request<Streaming<proto::$sent>>,
            ) -> Result<Response<Self::$duplex_type>, Status> {
                let items = self.0.$duplex(each(requests.into_inner(), checked)).await?;
                Ok(Response::new(sent(items)))
            })?
        }

        /// The service, ready to be added to a server.
        pub fn $server<S: $trait>(service: S) -> $generated_server<$adapter<S>> {
            capped!($generated_server::new($adapter(service)))
        }

        #[doc = concat!("Calls a [`", stringify!($trait), "`].")]
        #[derive(Debug, Clone)]
        pub struct $client($generated_client<WatchedChannel>);

        impl $client {
            /// Over a connection.
            #[must_use]
            pub fn new(channel: Channel) -> Self {
                Self(capped!($generated_client::new(WatchedChannel(channel))))
            }

            $($(#[$of_call])*
            ///
            /// # Errors
            /// The service's.
            pub async fn $call(&self, request: $asked) -> Result<$answer, Status> {
                let message: proto::$request = request.write();
                answered(self.0.clone().$call(message).await?.into_inner())
            })*

            $($(#[$of_stream])*
            ///
            /// # Errors
            /// The service's.
            pub async fn $stream(&self, request: $wanted) -> Result<Messages<$item>, Status> {
                let message: proto::$opening = request.write();
                Ok(received(begun(self.0.clone().$stream(message)).await?.into_inner()))
            })*

            $($(#[$of_duplex])*
            ///
            /// # Errors
            /// The service's.
            pub async fn $duplex(
                &self,
                requests: impl Stream<Item = $given> + Send + 'static,
            ) -> Result<Messages<$taken>, Status> {
                let requests = requests.map(Convert::<proto::$sent>::write);
                Ok(received(begun(self.0.clone().$duplex(requests)).await?.into_inner()))
            })?
        }
    };
}

/// A generated server or client, with this crate's caps.
macro_rules! capped {
    ($generated:expr) => {
        $generated.max_decoding_message_size(MAX_MESSAGE_BYTES).max_encoding_message_size(MAX_MESSAGE_BYTES)
    };
}

service! {
    /// Knows the members, plans sessions and serves scenes.
    Coordinator: CoordinatorService(CoordinatorServiceServer, CoordinatorServiceClient)
        as coordinator_server, CoordinatorAdapter, CoordinatorClient;
    calls {
        /// Changes what a session asks for.
        change_session(ChangeSessionRequest as ChangeSession) -> ChangeSessionResponse as ();
        /// Takes a member's report on its work.
        report_work(ReportWorkRequest as WorkReport) -> ReportWorkResponse as ();
        /// The members.
        get_status(GetStatusRequest as ()) -> GetStatusResponse as ClusterStatus;
        /// Takes a compositor's report on a sampler whose images it cannot get; `FAILED_PRECONDITION` where the plan is
        /// not in force.
        report_sampler(ReportSamplerRequest as SamplerReport) -> ReportSamplerResponse as ();
    }
    streams {
        /// Membership lasts as long as the stream.
        join_cluster(JoinClusterRequest as JoinCluster) -> JoinClusterStream(JoinClusterResponse as Welcome);
        /// The session's number, progress, and every plan that comes into force.
        open_session(OpenSessionRequest as SessionRequest) -> OpenSessionStream(OpenSessionResponse as SessionEvent);
        /// A scene's package from an offset on.
        fetch_scene(FetchSceneRequest as FetchScene) -> FetchSceneStream(FetchSceneResponse as ScenePart);
    }
}

service! {
    /// Measures its costs and takes plans.
    Node: NodeService(NodeServiceServer, NodeServiceClient) as node_server, NodeAdapter, NodeClient;
    calls {
        /// Measures each cost alone and warm, and, for a budget, the errors of views.
        measure_costs(MeasureCostsRequest as MeasureCosts) -> MeasureCostsResponse as Measured;
        /// Takes a plan; answers when ready for it. `FAILED_PRECONDITION` for an epoch below the one it has.
        apply_assignment(ApplyAssignmentRequest as ApplyPlan) -> ApplyAssignmentResponse as Ready;
    }
    streams {}
}

service! {
    /// Serves encoded depth images.
    Sampler: SamplerService(SamplerServiceServer, SamplerServiceClient)
        as sampler_server, SamplerAdapter, SamplerClient;
    calls {}
    streams {
        /// The chunks of some images of one set.
        fetch_sample_images(FetchSampleImagesRequest as FetchImages)
            -> FetchSampleImagesStream(FetchSampleImagesResponse as Chunk);
    }
}

service! {
    /// Makes views.
    Compositor: CompositorService(CompositorServiceServer, CompositorServiceClient)
        as compositor_server, CompositorAdapter, CompositorClient;
    calls {}
    streams {}
    duplex {
        /// Poses in, frames out, in the order they are ready.
        render_views(RenderViewsRequest as RenderViews) -> RenderViewsStream(RenderViewsResponse as FramePart);
    }
}
