//! One node process: it can sample and composite, and takes its roles from the plan.

use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use cluster::NodeStatus;
use compositor_node::CompositorService;
use node::{
    Engine, EngineError, NodeConfig, NodeMetrics, NodeParts, NodeService, OpenEngine, ServeError, health,
    keep_membership,
};
use probe::Probers;
use sampler_node::SamplerService;
use tokio::net::TcpListener;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;
use tonic::service::Routes;
use wire::rpc::{compositor_server, node_server, sampler_server};

/// Attempts to open a device, or to listen again, until the node ends.
const MAX_ATTEMPTS: usize = 3;

/// Serves both roles on one port and stays a member of the coordinator's cluster until `shutdown`. Then it ends its streams
/// and returns when connections have ended, after 10 s at most. A node whose device is lost ends its streams and leaves, and
/// comes back with a new device and nothing in it, after a while at least where that device is lost too. One whose device runs
/// out of memory again and again leaves for a while.
///
/// # Errors
/// Where the address is not allowed, the transport fails or no device can be opened.
pub async fn serve(
    listener: TcpListener,
    config: NodeConfig,
    open: OpenEngine,
    metrics: NodeMetrics,
    shutdown: CancellationToken,
) -> Result<(), ServeError> {
    let address = listener.local_addr()?;
    let away = config.deadlines.away;
    let mut listening = Some(listener);
    loop {
        let ready = async {
            let engine = attempted("device", away, || engine_of(open.clone())).await?;
            let listener = match listening.take() {
                Some(listener) => listener,
                // Meanwhile another connection may have the port.
                None => attempted("address", away, || async { Ok(TcpListener::bind(address).await?) }).await?,
            };
            Ok::<_, ServeError>((engine, listener))
        };
        let (engine, listener) = tokio::select! {
            biased;
            () = shutdown.cancelled() => break,
            ready = ready => ready?,
        };
        let since = Instant::now();
        let Some(reason) = serve_on(engine, listener, &config, metrics.clone(), shutdown.child_token()).await? else {
            break;
        };
        tracing::error!(node = config.node_name, reason, "device lost: leaves, and opens it again");
        tokio::select! {
            () = tokio::time::sleep_until(since + away) => (),
            () = shutdown.cancelled() => (),
        }
    }
    Ok(())
}

/// The result of a few attempts.
async fn attempted<T, F>(what: &str, pause: Duration, attempt: impl Fn() -> F) -> Result<T, ServeError>
where
    F: Future<Output = Result<T, ServeError>>,
{
    for number in 1..MAX_ATTEMPTS {
        match attempt().await {
            Ok(done) => return Ok(done),
            Err(error) => tracing::warn!(%error, number, "no {what}"),
        }
        tokio::time::sleep(pause).await;
    }
    attempt().await
}

async fn engine_of(open: OpenEngine) -> Result<Arc<dyn Engine>, ServeError> {
    let opened = tokio::task::spawn_blocking(move || open()).await;
    Ok(opened.unwrap_or_else(|panicked| Err(EngineError::Device(panicked.to_string())))?)
}

/// Serves until `shutdown`, or until the device is lost, with the reason.
async fn serve_on(
    engine: Arc<dyn Engine>,
    listener: TcpListener,
    config: &NodeConfig,
    metrics: NodeMetrics,
    shutdown: CancellationToken,
) -> Result<Option<String>, ServeError> {
    let node = NodeParts::new(engine, config, metrics, shutdown.clone());
    let address = listener.local_addr()?;
    let status = NodeStatus {
        node_name: config.node_name.clone(),
        address: config.advertised_address.clone().unwrap_or_else(|| format!("http://{address}")),
        device_name: node.engine.device_name(),
        is_software: node.engine.is_software(),
    };
    let probers = Arc::new(Probers::new(node.engine.clone()));
    let compositor = CompositorService::new(node.clone(), probers.clone());
    let sampler = SamplerService::new(node.clone(), compositor.relay());
    let service = NodeService::new(node.clone(), probers);
    let routes = Routes::new(health(&["node", "sampler", "compositor"]).await)
        .add_service(node_server(service))
        .add_service(sampler_server(sampler))
        .add_service(compositor_server(compositor));
    let membership = tokio::spawn(stay_while_memory_lasts(node.clone(), status));
    let mut serving = pin!(node::serve(listener, routes, config.insecure_bind, shutdown.clone()));
    let served = tokio::select! {
        served = &mut serving => served.map(|()| None),
        reason = node.monitor.lost() => {
            shutdown.cancel();
            serving.await.map(|()| Some(reason))
        }
    };
    // Where serving has ended by itself, `shutdown` is not cancelled.
    membership.abort();
    served
}

/// A member leaves when its device has no memory left, and begins again without plans and sets.
async fn stay_while_memory_lasts(node: Arc<NodeParts>, status: NodeStatus) {
    let away = node.config.deadlines.away;
    loop {
        tokio::select! {
            () = keep_membership(node.clone(), status.clone()) => return,
            () = node.monitor.exhausted() => (),
        }
        tracing::error!(
            node = &*node.plans.node_name,
            away_s = away.as_secs_f64(),
            "out of device memory: leaves for a while"
        );
        node.plans.forget_all();
        tokio::time::sleep(away).await;
        node.monitor.begin_anew();
    }
}
