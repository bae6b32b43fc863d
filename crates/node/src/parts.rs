//! The parts of one node.

use std::sync::Arc;

use tokio::sync::Mutex;
use tokio_util::sync::CancellationToken;

use crate::config::NodeConfig;
use crate::device_monitor::DeviceMonitor;
use crate::engine::Engine;
use crate::plan::PlansInForce;
use crate::telemetry::NodeMetrics;

/// The parts of one node that its services share.
pub struct NodeParts {
    /// The node's configuration.
    pub config: NodeConfig,
    /// The plans in force on it.
    pub plans: PlansInForce,
    /// Its device.
    pub monitor: DeviceMonitor,
    /// The monitored device.
    pub engine: Arc<dyn Engine>,
    /// Its metrics.
    pub metrics: NodeMetrics,
    /// Ends its streams and its membership.
    pub shutdown: CancellationToken,
    /// One load at a time: two plans may want the same scene.
    pub(crate) loading: Mutex<()>,
}

impl NodeParts {
    /// A node without plans and scenes.
    #[must_use]
    pub fn new(
        engine: Arc<dyn Engine>,
        config: &NodeConfig,
        metrics: NodeMetrics,
        shutdown: CancellationToken,
    ) -> Arc<Self> {
        let monitor = DeviceMonitor::new(engine);
        Arc::new(Self {
            config: config.clone(),
            plans: PlansInForce::new(&config.node_name),
            engine: Arc::new(monitor.clone()),
            monitor,
            metrics,
            shutdown,
            loading: Mutex::default(),
        })
    }
}
