//! One node process: it can sample and composite, and takes its roles from the plan.

use std::sync::Arc;

use cluster::NodeStatus;
use compositor_node::CompositorService;
use node::{
    DeviceLossMonitor, Engine, NodeConfig, NodeMetrics, NodeService, PlansInForce, Scenes, ServeError, health,
    keep_membership, with_reflection,
};
use sampler_node::SamplerService;
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use wire::rpc::{compositor_server, node_server, sampler_server};

/// Serves both roles on one port and stays a member of the coordinator's cluster until `shutdown`. Then it ends its streams
/// and returns when connections have ended, after 10 s at most. A node whose device is lost leaves at once.
///
/// # Errors
/// Where the address is not allowed, the transport fails or the device is lost.
pub async fn serve(
    listener: TcpListener,
    config: NodeConfig,
    engine: Arc<dyn Engine>,
    metrics: NodeMetrics,
    shutdown: CancellationToken,
) -> Result<(), ServeError> {
    let monitor = DeviceLossMonitor::new(engine);
    let engine: Arc<dyn Engine> = Arc::new(monitor.clone());
    let plans = PlansInForce::new(&config.node_name);
    let scenes = Arc::new(Scenes::new(engine.clone(), &config));
    let address = listener.local_addr()?;
    let status = NodeStatus {
        node_name: config.node_name.clone(),
        address: config.advertised_address.clone().unwrap_or_else(|| format!("http://{address}")),
        device_name: engine.device_name(),
        is_software: engine.is_software(),
    };
    let compositor = CompositorService::new(engine.clone(), plans.clone(), &config, metrics.clone(), shutdown.clone());
    let (relay, done) = (compositor.relay(), metrics.done.clone());
    let sampler = SamplerService::new(engine.clone(), plans.clone(), &config, relay, metrics.clone(), shutdown.clone());
    let memory = vec![compositor.memory(), sampler.memory()];
    let service = NodeService::new(engine, plans.clone(), scenes.clone(), metrics, memory);
    let routes = Routes::new(health(&["node", "sampler", "compositor"]).await)
        .add_service(node_server(service))
        .add_service(sampler_server(sampler))
        .add_service(compositor_server(compositor));
    let routes = with_reflection(routes, config.reflection)?;
    let member = keep_membership(status, config.coordinator.clone(), plans, scenes, done, shutdown.clone());
    let membership = tokio::spawn(member);
    let served = tokio::select! {
        served = node::serve(listener, routes, config.insecure_bind, shutdown) => served,
        reason = monitor.lost() => Err(ServeError::DeviceLost { reason }),
    };
    // Where serving has ended by itself, `shutdown` is not cancelled.
    membership.abort();
    served
}
