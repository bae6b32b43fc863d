//! Who looks on: what is counted, and what is written down to be replayed.

use std::io::Write;
use std::time::Duration;

use crate::CoordinatorMetrics;
use crate::schedule::{Event, Recorder};

/// A log of all that happens to the schedule.
pub type EventLog = Recorder<Box<dyn Write + Send>>;

/// None of them changes what is done.
#[derive(Default)]
pub struct Observers {
    /// For Prometheus.
    pub metrics: CoordinatorMetrics,
    /// To be replayed; ends at the first line that cannot be written.
    pub log: Option<EventLog>,
}

impl Observers {
    pub(crate) fn note(&mut self, now: Duration, event: &Event) {
        let failed = self.log.as_mut().and_then(|log| log.record(now, event).err());
        if let Some(error) = failed {
            tracing::error!(%error, "events are no longer recorded");
            self.log = None;
        }
    }
}
