//! One node process: it can sample and composite, and takes its roles from the plan.

use std::sync::Arc;
use std::time::Duration;

use cluster::NodeStatus;
use compositor_node::CompositorService;
use node::{
    DeviceMonitor, Engine, NodeConfig, NodeMetrics, NodeService, PlansInForce, Scenes, ServeError, health,
    keep_membership, with_reflection,
};
use sampler_node::SamplerService;
use tokio::net::TcpListener;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use wire::rpc::{compositor_server, node_server, sampler_server};

/// Serves both roles on one port and stays a member of the coordinator's cluster until `shutdown`. Then it ends its streams
/// and returns when connections have ended, after 10 s at most. A node whose device is lost leaves at once; one whose device
/// runs out of memory again and again leaves for a while.
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
    let monitor = DeviceMonitor::new(engine);
    let engine: Arc<dyn Engine> = Arc::new(monitor.clone());
    let plans = PlansInForce::new(&config.node_name);
    let scenes = Arc::new(Scenes::new(engine.clone(), &config));
    let (address, left) = (listener.local_addr()?, plans.clone());
    let status = NodeStatus {
        node_name: config.node_name.clone(),
        address: config.advertised_address.clone().unwrap_or_else(|| format!("http://{address}")),
        device_name: engine.device_name(),
        is_software: engine.is_software(),
    };
    let compositor = CompositorService::new(scenes.clone(), plans.clone(), &config, metrics.clone(), shutdown.clone());
    let (relay, done) = (compositor.relay(), metrics.done.clone());
    let sampler = SamplerService::new(scenes.clone(), plans.clone(), &config, relay, metrics.clone(), shutdown.clone());
    monitor.set_memory(vec![compositor.memory(), sampler.memory()]);
    let service = NodeService::new(plans.clone(), scenes.clone(), metrics);
    let routes = Routes::new(health(&["node", "sampler", "compositor"]).await)
        .add_service(node_server(service))
        .add_service(sampler_server(sampler))
        .add_service(compositor_server(compositor));
    let routes = with_reflection(routes, config.reflection)?;
    let (coordinator, away, ends) = (config.coordinator.clone(), config.deadlines.away, shutdown.clone());
    let member = move || {
        let (node, coordinator, plans) = (status.clone(), coordinator.clone(), plans.clone());
        keep_membership(node, coordinator, plans, scenes.clone(), done.clone(), ends.clone())
    };
    let membership = tokio::spawn(stay_while_memory_lasts(member, monitor.clone(), left, away));
    let served = tokio::select! {
        served = node::serve(listener, routes, config.insecure_bind, shutdown) => served,
        reason = monitor.lost() => Err(ServeError::DeviceLost { reason }),
    };
    // Where serving has ended by itself, `shutdown` is not cancelled.
    membership.abort();
    served
}

/// A member leaves when its device has no memory left, and begins again with nothing in it.
async fn stay_while_memory_lasts<F: Future<Output = ()>>(
    member: impl Fn() -> F,
    monitor: DeviceMonitor,
    plans: PlansInForce,
    away: Duration,
) {
    loop {
        tokio::select! {
            () = member() => return,
            () = monitor.exhausted() => (),
        }
        tracing::error!(
            node = &*plans.node_name,
            away_s = away.as_secs_f64(),
            "out of device memory: leaves for a while"
        );
        plans.forget_all();
        tokio::time::sleep(away).await;
        monitor.free();
    }
}
