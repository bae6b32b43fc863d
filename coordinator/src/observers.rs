//! Observers of the schedule: metrics, and a log of events to be replayed.

use std::io::Write;
use std::time::Duration;

use crate::metrics::CoordinatorMetrics;
use crate::schedule::{Event, Recorder};

/// A log of all events of the schedule.
pub type EventLog = Recorder<Box<dyn Write + Send>>;

/// Metrics and log; neither changes a decision.
#[derive(Default)]
pub struct Observers {
    /// For Prometheus.
    pub metrics: CoordinatorMetrics,
    /// Ends at the first line that cannot be written.
    pub log: Option<EventLog>,
}

impl Observers {
    pub(crate) fn record(&mut self, now: Duration, event: &Event) {
        let failed = self.log.as_mut().and_then(|log| log.record(now, event).err());
        if let Some(error) = failed {
            tracing::error!(%error, "events are no longer recorded");
            self.log = None;
        }
    }
}
