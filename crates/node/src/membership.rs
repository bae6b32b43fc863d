//! Membership: joining the coordinator, again after it was away.

use std::sync::Arc;
use std::time::Duration;

use cluster::{JoinCluster, NodeStatus, Welcome, WorkReport};
use tokio_stream::StreamExt as _;
use tokio_util::sync::CancellationToken;
use tonic::Status;
use wire::rpc::{Backoff, CoordinatorClient, connect};

use crate::plan::CurrentPlan;
use crate::scenes::Scenes;
use crate::warm::warm_up;
use crate::work_done::WorkDone;

/// The interval of a member's reports on its work.
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
    let (mut backoff, mut warmed) = (Backoff::reconnect(), false);
    loop {
        let mut joined = false;
        let request = JoinCluster { node: node.clone(), plan_epoch: plan.epoch() };
        let ended = tokio::select! {
            ended = member(request, &coordinator, &scenes, (&plan, &done), (&mut warmed, &mut joined)) => ended,
            () = shutdown.cancelled() => return,
        };
        if joined {
            backoff.reset();
        }
        tracing::warn!(node = node.node_name, %coordinator, reason = ended.message(), "no longer a member");
        tokio::select! {
            () = tokio::time::sleep(backoff.next_delay()) => (),
            () = shutdown.cancelled() => return,
        }
    }
}

/// One membership, until it ends, with the reason.
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

/// Reports the work since the last report; a report that fails is not repeated.
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
        Ok(Err(status)) => tracing::debug!(reason = status.message(), "the report was refused"),
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
