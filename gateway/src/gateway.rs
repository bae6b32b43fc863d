//! State that all requests share.

use std::sync::Arc;

use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;

use crate::config::GatewayConfig;
use crate::scenes::Scenes;

/// Views over HTTP that are made, wait, or are read.
pub(crate) const VIEW_PLACES: usize = 68;
/// Pages that wait for a place.
const MAX_WAITING: usize = 64;

/// State that all requests share.
pub(crate) struct Gateway {
    pub(crate) config: GatewayConfig,
    pub(crate) scenes: Scenes,
    /// Places of visitors.
    pub(crate) visitors: Semaphore,
    pub(crate) shutdown: CancellationToken,
    /// Places of all pages, those that wait included.
    pub(crate) pages: Arc<Semaphore>,
    /// Places of views over HTTP.
    pub(crate) single_views: Arc<Semaphore>,
    /// The place of a view that is compared.
    pub(crate) comparison: Semaphore,
}

impl Gateway {
    pub(crate) fn new(config: GatewayConfig, shutdown: CancellationToken) -> Self {
        Self {
            scenes: Scenes::new(config.clone()),
            visitors: Semaphore::new(config.max_visitors),
            pages: Arc::new(Semaphore::new(config.max_visitors + MAX_WAITING)),
            single_views: Arc::new(Semaphore::new(VIEW_PLACES)),
            comparison: Semaphore::new(1),
            config,
            shutdown,
        }
    }
}
