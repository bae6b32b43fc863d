//! A whole cluster in one process: coordinator and nodes over loopback gRPC, one device among them.

use std::time::Duration;

use anyhow::Context as _;
use client::Client;
use coordinator::{CoordinatorConfig, Observers, SceneOffers};
use node::{NodeConfig, NodeMetrics, OpenEngine, Port, ServeError};
use tokio::net::TcpListener;
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;

use crate::addresses::loopback_of;

/// The longest wait for nodes of one process to join.
const JOIN: Duration = Duration::from_secs(30);

/// Servers of a cluster, which run until they are drained.
pub struct Cluster {
    /// The address of the coordinator, as `http://host:port`.
    pub address: String,
    shutdown: CancellationToken,
    servers: JoinSet<Result<(), ServeError>>,
}

impl Cluster {
    /// Starts a coordinator of this configuration on `port` and `nodes` nodes, each with its configuration changed by
    /// `configure`, and waits until all have joined. Nodes fetch scenes unless the engine that `open` gives has them.
    ///
    /// # Errors
    /// A port is not to be had, or nodes do not join.
    pub async fn start(
        configure: impl Fn(NodeConfig) -> NodeConfig,
        port: impl Into<Port>,
        config: CoordinatorConfig,
        offers: SceneOffers,
        open: OpenEngine,
        nodes: usize,
    ) -> anyhow::Result<Self> {
        let port = port.into();
        let address = format!("http://{}", loopback_of(&port.listener)?);
        let mut cluster = Self { address, shutdown: CancellationToken::new(), servers: JoinSet::new() };
        let observers = Observers::default();
        let shutdown = cluster.shutdown.clone();
        cluster.servers.spawn(coordinator::serve(port, config, offers, observers, shutdown));
        for number in 0..nodes {
            let listener = TcpListener::bind("127.0.0.1:0").await.context("no loopback port for a node")?;
            // Enough digits to sort well: members are listed by name.
            let config = configure(NodeConfig::new(format!("node-{number:03}"), &cluster.address));
            let open = open.clone();
            let metrics = NodeMetrics::default();
            let shutdown = cluster.shutdown.clone();
            cluster.servers.spawn(node_host::serve(listener, config, open, metrics, shutdown));
        }
        cluster.client().await?.wait_for_nodes(nodes, JOIN).await?;
        Ok(cluster)
    }

    /// A client of this cluster.
    ///
    /// # Errors
    /// The coordinator does not answer.
    pub async fn client(&self) -> anyhow::Result<Client> {
        Ok(Client::connect(&self.address).await?)
    }

    /// Waits for the first server that ends by itself.
    ///
    /// # Errors
    /// The reason of its end.
    pub async fn failed(&mut self) -> anyhow::Result<()> {
        let ended = self.servers.join_next().await;
        ended.map_or(Ok(()), |ended| Ok(ended.context("a server stopped")??))
    }

    /// Ends streams and waits for the servers, 10 s at most.
    ///
    /// # Errors
    /// A server failed.
    pub async fn drain(mut self) -> anyhow::Result<()> {
        self.shutdown.cancel();
        while let Some(ended) = self.servers.join_next().await {
            ended.context("a server stopped")??;
        }
        Ok(())
    }
}
