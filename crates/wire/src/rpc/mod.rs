//! The services in domain types: traits to serve, clients to call, and their settings.

mod backoff;
mod channel;
mod liveness;
mod services;

pub use backoff::Backoff;
pub use channel::{CALL_TIMEOUT, KEEPALIVE_INTERVAL, KEEPALIVE_TIMEOUT, connect, connect_later, is_serving};
pub use services::{
    Compositor, CompositorClient, Coordinator, CoordinatorClient, Messages, Node, NodeClient, Sampler, SamplerClient,
    compositor_server, coordinator_server, node_server, sampler_server,
};

/// Bytes of one decoded message: tonic's default of 4 MiB is reserved in full on a five-byte header.
pub const MAX_MESSAGE_BYTES: usize = 2 << 20;
