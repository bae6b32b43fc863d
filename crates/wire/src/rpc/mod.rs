//! The services in domain types: traits to serve, clients to call, and their settings.

mod backoff;
mod channel;
mod compositor;
mod coordinator;
mod health;
mod node;
mod reflection;
mod sampler;

use std::pin::Pin;

use tokio_stream::{Stream, StreamExt as _};
use tonic::{Request, Response, Status, Streaming};

pub use backoff::Backoff;
pub use channel::{CALL_TIMEOUT, KEEPALIVE_INTERVAL, KEEPALIVE_TIMEOUT, connect, connect_later};
pub use compositor::{Compositor, CompositorClient, compositor_server};
pub use coordinator::{Coordinator, CoordinatorClient, coordinator_server};
pub use health::is_serving;
pub use node::{Node, NodeClient, node_server};
pub use reflection::reflection_server;
pub use sampler::{Sampler, SamplerClient, sampler_server};

use crate::error::WireError;

/// Bytes of one decoded message: tonic's default of 4 MiB is reserved in full on a five-byte header.
pub const MAX_MESSAGE_BYTES: usize = 2 << 20;

/// A stream of messages, already checked.
pub type Messages<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

fn incoming<P, D>(stream: Streaming<P>) -> Messages<D>
where
    P: Send + 'static,
    D: TryFrom<P, Error = WireError> + 'static,
{
    Box::pin(stream.map(|message| message.and_then(|message| D::try_from(message).map_err(Status::from))))
}

/// As [`incoming`], for answers of a server: their faults are not the request's.
fn answers<P, D>(stream: Streaming<P>) -> Messages<D>
where
    P: Send + 'static,
    D: TryFrom<P, Error = WireError> + 'static,
{
    Box::pin(stream.map(|message| message.and_then(answered)))
}

fn answered<P, D>(message: P) -> Result<D, Status>
where
    D: TryFrom<P, Error = WireError>,
{
    D::try_from(message).map_err(|error| Status::data_loss(error.to_string()))
}

fn outgoing<D, P>(stream: Messages<D>) -> Messages<P>
where
    D: 'static,
    P: From<D> + 'static,
{
    Box::pin(stream.map(|message| message.map(P::from)))
}

fn checked<P, D>(request: Request<P>) -> Result<D, Status>
where
    D: TryFrom<P, Error = WireError>,
{
    Ok(D::try_from(request.into_inner())?)
}

fn answer<D, P: From<D>>(value: D) -> Response<P> {
    Response::new(value.into())
}

/// The type of a generated server around one of this module's adapters, with this crate's caps.
macro_rules! capped {
    ($server:expr) => {
        $server
            .max_decoding_message_size(crate::rpc::MAX_MESSAGE_BYTES)
            .max_encoding_message_size(crate::rpc::MAX_MESSAGE_BYTES)
    };
}
use capped;
