//! The parts of one node.

use std::sync::Arc;

use tokio_util::sync::CancellationToken;

use crate::config::NodeConfig;
use crate::device_monitor::DeviceMonitor;
use crate::engine::Engine;
use crate::plan::PlansInForce;
use crate::scenes::Scenes;
use crate::telemetry::NodeMetrics;

/// The parts of one node that its services share.
pub struct NodeParts {
    /// The node's configuration.
    pub config: NodeConfig,
    /// The plans in force on it.
    pub plans: PlansInForce,
    /// Its device.
    pub monitor: DeviceMonitor,
    /// Its scenes on the device.
    pub scenes: Scenes,
    /// Its metrics.
    pub metrics: NodeMetrics,
    /// Ends its streams and its membership.
    pub shutdown: CancellationToken,
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
        let scenes = Scenes::new(Arc::new(monitor.clone()), config);
        let plans = PlansInForce::new(&config.node_name);
        Arc::new(Self { config: config.clone(), plans, monitor, scenes, metrics, shutdown })
    }
}
