//! Settings of a gateway.

use std::sync::Arc;

use cluster::{OfferStatus, SessionRequest};
use depth_image::PinholeCamera;
use glam::UVec2;
use tokio_rustls::rustls::ServerConfig;

use crate::token::Token;

/// The request of the session that all visitors of a scene share, for views like this one. The page names no method, and the
/// gateway knows none.
pub type RequestOf = Arc<dyn Fn(&OfferStatus, PinholeCamera) -> SessionRequest + Send + Sync>;

/// Settings of a gateway.
#[derive(Clone)]
pub struct GatewayConfig {
    /// The coordinator's address, as `http://host:port`.
    pub coordinator: String,
    /// The request of a scene's session.
    pub request_of: RequestOf,
    /// Visitors at a time; further ones wait. Each has two streams of the 256 that a connection to a compositor may have.
    pub max_visitors: usize,
    /// Columns and rows of the largest still.
    pub max_still_px: UVec2,
    /// Names of this server, beside `localhost` and addresses.
    pub hosts: Vec<String>,
    /// The certificate and key of TLS; plain HTTP without.
    pub tls: Option<Arc<ServerConfig>>,
    /// The token that visitors must bring; anybody may visit without.
    pub token: Option<Token>,
    /// Origins of other pages that may use this server, as `https://host`.
    pub origins: Vec<String>,
}

impl GatewayConfig {
    /// The gateway of a coordinator, for 64 visitors and stills of up to 1920×1080.
    #[must_use]
    pub fn new(coordinator: &str, request_of: RequestOf) -> Self {
        Self {
            coordinator: coordinator.to_owned(),
            request_of,
            max_visitors: 64,
            max_still_px: UVec2::new(1920, 1080),
            hosts: Vec::new(),
            tls: None,
            token: None,
            origins: Vec::new(),
        }
    }
}
