//! Joining the coordinator, and joining again when it was away.

use std::sync::Arc;
use std::time::Duration;

use tokio_stream::StreamExt as _;
use tokio_util::sync::CancellationToken;
use tonic::Status;
use wire::rpc::{CoordinatorClient, connect};
use wire::{JoinCluster, NodeStatus, Welcome};

use crate::{CurrentPlan, Scenes};

const FIRST_RETRY: Duration = Duration::from_millis(100);
const LAST_RETRY: Duration = Duration::from_secs(3);

/// Stays a member until `shutdown`; frames go on while the coordinator is away.
pub async fn keep_membership(
    node: NodeStatus,
    coordinator: String,
    plan: CurrentPlan,
    scenes: Arc<Scenes>,
    shutdown: CancellationToken,
) {
    let mut retry = FIRST_RETRY;
    loop {
        let mut joined = false;
        let request = JoinCluster { node: node.clone(), plan_epoch: plan.epoch() };
        let ended = tokio::select! {
            ended = member(request, &coordinator, &scenes, &mut joined) => ended,
            () = shutdown.cancelled() => return,
        };
        retry = if joined { FIRST_RETRY } else { (retry * 2).min(LAST_RETRY) };
        tracing::warn!(node = node.node_name, %coordinator, reason = ended.message(), "no longer a member");
        tokio::select! {
            () = tokio::time::sleep(retry) => (),
            () = shutdown.cancelled() => return,
        }
    }
}

/// One membership, until it ends; says why.
async fn member(request: JoinCluster, coordinator: &str, scenes: &Arc<Scenes>, joined: &mut bool) -> Status {
    let stream = async { CoordinatorClient::new(connect(coordinator).await?).join_cluster(request).await };
    let mut stream = match stream.await {
        Ok(stream) => stream,
        Err(status) => return status,
    };
    while let Some(message) = stream.next().await {
        match message {
            Ok(welcome) => preload(welcome, scenes.clone()),
            Err(status) => return status,
        }
        *joined = true;
    }
    Status::ok("the coordinator ended it")
}

/// Loads offered scenes ahead; a plan that needs one waits for it.
fn preload(welcome: Welcome, scenes: Arc<Scenes>) {
    tokio::spawn(async move {
        for scene in welcome.scenes {
            if let Err(status) = scenes.ensure(&scene).await {
                tracing::warn!(scene = %scene.hash, reason = status.message(), "not loaded ahead");
            }
        }
    });
}
