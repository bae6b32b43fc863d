//! Reports to the coordinator on samplers whose images cannot be fetched.

use std::sync::Arc;
use std::time::Duration;

use cluster::SamplerReport;
use node::NodeConfig;
use parking_lot::Mutex;
use tonic::{Code, Status};
use wire::rpc::{CoordinatorClient, connect};

/// The time that a report may take.
const DEADLINE: Duration = Duration::from_secs(5);

/// A set that could not be fetched.
#[derive(Debug)]
pub(crate) struct NotFetched {
    /// The sampler whose images were not received; `None` where no sampler is at fault.
    pub(crate) sampler: Option<String>,
    pub(crate) status: Status,
}

impl From<Status> for NotFetched {
    fn from(status: Status) -> Self {
        Self { sampler: None, status }
    }
}

/// The reports of one compositor.
#[derive(Debug, Clone)]
pub(crate) struct Reports {
    node_name: String,
    coordinator: String,
    /// The last report: each sampler is reported once a plan.
    last: Arc<Mutex<Option<(u64, String)>>>,
}

impl Reports {
    pub(crate) fn new(config: &NodeConfig) -> Self {
        Self { node_name: config.node_name.clone(), coordinator: config.coordinator.clone(), last: Arc::default() }
    }

    /// Reports a sampler in the background, unless its fault may be the plan's or the request's.
    pub(crate) fn report(&self, plan_epoch: u64, failed: &NotFetched) {
        let Some(sampler) = failed.sampler.clone().filter(|sampler| *sampler != self.node_name) else { return };
        let its_fault = [Code::Unavailable, Code::DataLoss, Code::DeadlineExceeded, Code::Unknown];
        let report = Some((plan_epoch, sampler.clone()));
        let last = std::mem::replace(&mut *self.last.lock(), report.clone());
        if !its_fault.contains(&failed.status.code()) || last == report {
            return;
        }
        let reason = failed.status.message().chars().take(256).collect();
        let report = SamplerReport { plan_epoch, compositor: self.node_name.clone(), sampler, reason };
        let coordinator = self.coordinator.clone();
        tokio::spawn(async move {
            if let Err(status) = tokio::time::timeout(DEADLINE, send(&coordinator, report)).await.unwrap_or(Ok(())) {
                tracing::debug!(reason = status.message(), "a sampler could not be reported");
            }
        });
    }
}

async fn send(coordinator: &str, report: SamplerReport) -> Result<(), Status> {
    CoordinatorClient::new(connect(coordinator).await?).report_sampler(report).await
}
