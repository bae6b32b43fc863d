//! Reports to the coordinator on samplers whose images cannot be fetched.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cluster::SamplerReport;
use node::NodeConfig;
use parking_lot::Mutex;
use tonic::{Code, Status};
use wire::rpc::{CoordinatorClient, connect};

/// The time that a report may take.
const DEADLINE: Duration = Duration::from_secs(5);
/// The same report is repeated after this: the coordinator quarantines no node for a single one.
const REPEAT_AFTER: Duration = Duration::from_secs(1);

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
    /// The last report: its plan, its sampler, and when it was made.
    last: Arc<Mutex<Option<(u64, String, Instant)>>>,
}

impl Reports {
    pub(crate) fn new(config: &NodeConfig) -> Self {
        Self { node_name: config.node_name.clone(), coordinator: config.coordinator.clone(), last: Arc::default() }
    }

    /// Reports a sampler in the background, unless its fault may be the plan's or the request's.
    pub(crate) fn report(&self, plan_epoch: u64, failed: &NotFetched) {
        let Some(sampler) = failed.sampler.clone().filter(|sampler| *sampler != self.node_name) else { return };
        let its_fault = [Code::Unavailable, Code::DataLoss, Code::DeadlineExceeded, Code::Unknown];
        if !its_fault.contains(&failed.status.code()) || self.is_repeated(plan_epoch, &sampler) {
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

    /// Whether the same report was made just now.
    fn is_repeated(&self, plan_epoch: u64, sampler: &str) -> bool {
        let mut last = self.last.lock();
        let is_repeated = last
            .as_ref()
            .is_some_and(|(epoch, name, at)| *epoch == plan_epoch && name == sampler && at.elapsed() < REPEAT_AFTER);
        if !is_repeated {
            *last = Some((plan_epoch, sampler.to_owned(), Instant::now()));
        }
        is_repeated
    }
}

async fn send(coordinator: &str, report: SamplerReport) -> Result<(), Status> {
    CoordinatorClient::new(connect(coordinator).await?).report_sampler(report).await
}
