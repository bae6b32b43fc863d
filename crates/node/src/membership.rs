//! Joining the coordinator, and joining again when it was away.

use std::sync::Arc;
use std::time::Duration;

use cluster::{JoinCluster, NodeStatus, Welcome, WorkReport};
use tokio_stream::StreamExt as _;
use tokio_util::sync::CancellationToken;
use tonic::Status;
use wire::rpc::{CoordinatorClient, connect};

use crate::warm::warm_up;
use crate::{CurrentPlan, Scenes, WorkDone};

const FIRST_RETRY: Duration = Duration::from_millis(100);
const LAST_RETRY: Duration = Duration::from_secs(1);
/// How often a member says what it did.
const REPORT: Duration = Duration::from_secs(1);

/// Stays a member until `shutdown`; frames go on while the coordinator is away.
pub async fn keep_membership(
    node: NodeStatus,
    coordinator: String,
    plan: CurrentPlan,
    scenes: Arc<Scenes>,
    done: WorkDone,
    shutdown: CancellationToken,
) {
    let (mut retry, mut warmed) = (FIRST_RETRY, false);
    loop {
        let mut joined = false;
        let request = JoinCluster { node: node.clone(), plan_epoch: plan.epoch() };
        let ended = tokio::select! {
            ended = member(request, &coordinator, &scenes, (&plan, &done), (&mut warmed, &mut joined)) => ended,
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
async fn member(
    request: JoinCluster,
    coordinator: &str,
    scenes: &Arc<Scenes>,
    (plan, done): (&CurrentPlan, &WorkDone),
    (warmed, joined): (&mut bool, &mut bool),
) -> Status {
    let client = match connect(coordinator).await {
        Ok(channel) => CoordinatorClient::new(channel),
        Err(status) => return status,
    };
    if !std::mem::replace(warmed, true) {
        warm_up(&client, scenes, plan).await;
    }
    let mut stream = match client.join_cluster(request).await {
        Ok(stream) => stream,
        Err(status) => return status,
    };
    let mut reports = tokio::time::interval(REPORT);
    loop {
        tokio::select! {
            message = stream.next() => match message {
                Some(Ok(welcome)) => preload(welcome, scenes.clone()),
                Some(Err(status)) => return status,
                None => return Status::ok("the coordinator ended it"),
            },
            _ = reports.tick(), if *joined => report(&client, plan, done).await,
        }
        *joined = true;
    }
}

/// What a coordinator does not hear it does without.
async fn report(client: &CoordinatorClient, plan: &CurrentPlan, done: &WorkDone) {
    let sums = done.take();
    if sums.is_empty() {
        return;
    }
    let report = WorkReport {
        node_name: plan.node_name().to_owned(),
        plan_epoch: plan.epoch(),
        costs: sums.costs(),
        busy_s: sums.busy_s,
        views: sums.views,
        dropped_views: sums.dropped_views,
    };
    match tokio::time::timeout(REPORT, client.report_work(report)).await {
        Ok(Ok(())) => (),
        Ok(Err(status)) => tracing::debug!(reason = status.message(), "the report was not taken"),
        Err(_) => tracing::debug!("the report took too long"),
    }
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
