//! One node process: it can sample and composite, and does what the plan says.

use std::net::SocketAddr;
use std::sync::Arc;

use compositor_node::CompositorService;
use node::{CurrentPlan, Engine, NodeConfig, NodeMetrics, NodeService, Scenes, ServeError, health, keep_membership};
use sampler_node::SamplerService;
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use wire::NodeStatus;
use wire::rpc::{compositor_server, node_server, sampler_server};

/// Serves both roles on one port and stays a member of the coordinator's cluster until `shutdown`; then
/// ends its streams and returns when connections have ended, after 10 s at most.
///
/// # Errors
/// Where the address is not allowed or the transport fails.
pub async fn serve(
    listener: TcpListener,
    config: NodeConfig,
    engine: Arc<dyn Engine>,
    metrics: NodeMetrics,
    shutdown: CancellationToken,
) -> Result<(), ServeError> {
    let plan = CurrentPlan::new(&config.node_name);
    let scenes = Arc::new(Scenes::new(engine.clone(), &config));
    let status = status_of(&config, listener.local_addr()?, engine.as_ref());
    let sampler = SamplerService::new(engine.clone(), plan.clone(), &config, metrics.clone(), shutdown.clone());
    let compositor = CompositorService::new(engine.clone(), plan.clone(), &config, metrics.clone(), shutdown.clone());
    let service = NodeService::new(engine, plan.clone(), scenes.clone(), metrics);
    let routes = Routes::new(health(&["node", "sampler", "compositor"]).await)
        .add_service(node_server(service))
        .add_service(sampler_server(sampler))
        .add_service(compositor_server(compositor));
    let membership = tokio::spawn(keep_membership(status, config.coordinator.clone(), plan, scenes, shutdown.clone()));
    let served = node::serve(listener, routes, config.insecure_bind, shutdown).await;
    // Where serving failed, nobody has cancelled it.
    membership.abort();
    served
}

fn status_of(config: &NodeConfig, address: SocketAddr, engine: &dyn Engine) -> NodeStatus {
    NodeStatus {
        node_name: config.node_name.clone(),
        address: config.advertised_address.clone().unwrap_or_else(|| format!("http://{address}")),
        device_name: engine.device_name(),
        is_software: engine.is_software(),
    }
}
