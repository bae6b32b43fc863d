//! Nodes that are members and yet of no use: who cannot be reached, or whose images nobody can get.

use std::sync::Arc;
use std::time::Duration;

use cluster::{NodeStatus, SamplerReport};
use tokio::task::JoinSet;
use tonic::{Code, Status};
use wire::rpc::is_serving;

use crate::reports::{Verdict, concerns};
use crate::schedule::Event;
use crate::service::Inner;

/// How long a node is left out: its link may be mended by then. Where nobody else is left, only as long as it takes not
/// to plan the same again and again.
const LEFT_OUT: Duration = Duration::from_secs(30);
const LEFT_OUT_ALONE: Duration = Duration::from_secs(2);
/// Between two probes of a node, and how long its answer may take: as keepalive does. Membership shows only that the
/// node reaches us.
const PROBES_APART: Duration = Duration::from_secs(5);
const ANSWERS_WITHIN: Duration = Duration::from_secs(5);
const ASKED_AGAIN: Duration = Duration::from_millis(200);

/// Asks all nodes of the plan in force whether they serve. Runs until it is aborted.
pub(crate) async fn probe(inner: Arc<Inner>) {
    loop {
        tokio::time::sleep(PROBES_APART).await;
        let status = inner.status();
        let Some(plan) = status.plan else { continue };
        let plan_epoch = plan.assignment.plan_epoch;
        let ready: Vec<_> = status.conditions.iter().filter(|node| node.is_ready).map(|node| &node.node_name).collect();
        let mut probes = JoinSet::new();
        for node in status.nodes.into_iter().filter(|node| ready.contains(&&node.node_name)) {
            probes.spawn(answer(node));
        }
        while let Some(ended) = probes.join_next().await {
            if let Ok(Some((node_name, reason))) = ended {
                // Of several, each leads to another plan.
                let plan_epoch = inner.status().plan.map_or(plan_epoch, |plan| plan.assignment.plan_epoch);
                inner.leave_out(plan_epoch, node_name, reason);
            }
        }
    }
}

/// A node that does not answer, and why.
async fn answer(node: NodeStatus) -> Option<(String, String)> {
    let late = |_| Status::deadline_exceeded(format!("no answer for {} s", ANSWERS_WITHIN.as_secs()));
    // What breaks at once may be the network's fault.
    let mut attempts = 3;
    let failed = loop {
        let asked = tokio::time::timeout(ANSWERS_WITHIN, is_serving(&node.address, "")).await.map_err(late);
        let failed = asked.and_then(|asked| asked).err()?;
        attempts -= 1;
        if attempts == 0 || failed.code() == Code::DeadlineExceeded {
            break failed;
        }
        tokio::time::sleep(ASKED_AGAIN).await;
    };
    // One that has no such service, or too much to do, answers.
    let silent = ![Code::Unimplemented, Code::NotFound, Code::ResourceExhausted].contains(&failed.code());
    silent.then(|| (node.node_name, format!("{} does not answer: {}", node.address, failed.message())))
}

impl Inner {
    /// The plan goes on without a node, if it is in force. After a while the node may join again.
    pub(crate) fn leave_out(self: &Arc<Self>, plan_epoch: u64, node_name: String, reason: String) {
        let counts = self.status().plan.is_some_and(|plan| plan.assignment.plan_epoch == plan_epoch);
        let membership = self.seats.incarnation(&node_name).filter(|_| counts);
        tracing::warn!(node = node_name, plan_epoch, reason, "left out");
        self.step(Event::Unready { plan_epoch, node_name: node_name.clone(), reason });
        if let Some(incarnation) = membership {
            tokio::spawn(let_back(self.clone(), node_name, incarnation));
        }
    }

    /// Hears a compositor's report.
    pub(crate) fn hear(self: &Arc<Self>, report: &SamplerReport) -> Result<(), Status> {
        let plan = self.status().plan;
        if !plan.is_some_and(|plan| concerns(report, &plan)) {
            return Err(Status::failed_precondition(format!("plan_epoch {} gives no such roles", report.plan_epoch)));
        }
        let reason = format!("{} cannot get images of {}: {}", report.compositor, report.sampler, report.reason);
        match self.reports.judge(report) {
            Verdict::Sampler => self.leave_out(report.plan_epoch, report.sampler.clone(), reason),
            Verdict::Compositor { blamed } => {
                self.leave_out(report.plan_epoch, report.compositor.clone(), reason);
                if let Some(incarnation) = self.seats.incarnation(&blamed) {
                    self.seats.end(&blamed, incarnation, "was left out for another's fault: join again");
                }
            }
        }
        Ok(())
    }
}

async fn let_back(inner: Arc<Inner>, node_name: String, incarnation: u64) {
    let others_work = async || {
        while inner.status().plan.is_some() {
            tokio::time::sleep(ASKED_AGAIN).await;
        }
    };
    tokio::time::sleep(LEFT_OUT_ALONE).await;
    let _ = tokio::time::timeout(LEFT_OUT.saturating_sub(LEFT_OUT_ALONE), others_work()).await;
    inner.seats.end(&node_name, incarnation, "was left out for a while: join again");
}
