//! Settings of a gateway.

use std::sync::Arc;

use cluster::{OfferStatus, SessionRequest};
use depth_image::{LightCacheQuality, PinholeCamera};
use glam::UVec2;
use tokio_rustls::rustls::ServerConfig;

use crate::token::Token;

/// The request of the session that all visitors of a scene share, for views like this one. The gateway knows no
/// method by its name.
pub type RequestOf = Arc<dyn Fn(&OfferStatus, PinholeCamera) -> SessionRequest + Send + Sync>;

/// The methods of shared light, between which a visitor's pictures change. Their samples are the same.
#[derive(Debug, Clone, Copy)]
pub struct SharedLightMethods {
    /// The method of a quality.
    pub of_quality: fn(LightCacheQuality) -> String,
    /// The quality of a method; `None` for one whose light is not shared.
    pub quality_of: fn(&str) -> Option<LightCacheQuality>,
}

/// Settings of a gateway.
#[derive(Clone)]
pub struct GatewayConfig {
    /// The coordinator's address, as `http://host:port`.
    pub coordinator: String,
    /// The request of a scene's session.
    pub request_of: RequestOf,
    /// The methods of shared light.
    pub methods: SharedLightMethods,
    /// The quality of shared light in stills; without one, that of the scene on offer, or fine.
    pub quality: Option<LightCacheQuality>,
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
    pub fn new(coordinator: &str, request_of: RequestOf, methods: SharedLightMethods) -> Self {
        Self {
            coordinator: coordinator.to_owned(),
            request_of,
            methods,
            quality: None,
            max_visitors: 64,
            max_still_px: UVec2::new(1920, 1080),
            hosts: Vec::new(),
            tls: None,
            token: None,
            origins: Vec::new(),
        }
    }
}
