//! State that all calls share.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use cluster::{ChangeSession, ClusterStatus, SessionEvent};
use node::Connections;
use parking_lot::Mutex;
use tokio::sync::Notify;
use tonic::Status;

use crate::config::{CoordinatorConfig, SceneOffers};
use crate::cost_table::CostTable;
use crate::membership::MembershipRegistry;
use crate::observers::Observers;
use crate::schedule::{Command, Event, Scheduler};
use crate::sessions::SessionRegistry;

pub(crate) struct Shared {
    pub(crate) config: CoordinatorConfig,
    pub(crate) offers: SceneOffers,
    pub(crate) connections: Connections,
    /// Costs are measured one session at a time.
    pub(crate) measuring: Arc<tokio::sync::Mutex<()>>,
    pub(crate) costs: CostTable,
    pub(crate) commands: CommandQueue,
    pub(crate) membership: MembershipRegistry,
    pub(crate) sessions: SessionRegistry,
    /// One node at a time: the schedule hears of nodes in the order in which they are registered.
    pub(crate) joining: Mutex<()>,
    started: Instant,
    /// The schedule, and those that watch its events.
    schedule: Mutex<(Scheduler, Observers)>,
    last_number: AtomicU64,
}

impl Shared {
    pub(crate) fn new(config: CoordinatorConfig, offers: SceneOffers, observers: Observers) -> Self {
        Self {
            config,
            offers,
            connections: Connections::default(),
            measuring: Arc::default(),
            costs: CostTable::default(),
            commands: CommandQueue::default(),
            membership: MembershipRegistry::default(),
            sessions: SessionRegistry::default(),
            joining: Mutex::default(),
            started: Instant::now(),
            schedule: Mutex::new((Scheduler::default(), observers)),
            last_number: AtomicU64::default(),
        }
    }

    /// Tells the schedule; its commands are executed in its order.
    pub(crate) fn step(&self, event: Event) {
        self.step_locked(&mut self.schedule.lock(), event);
    }

    /// Tells the schedule a change, where it admits the change. No other event comes in between.
    pub(crate) fn change_session(&self, change: ChangeSession) -> Result<(), Status> {
        let ChangeSession { session, views_per_set, frames_per_s, viewpoints } = change;
        let views_per_set = views_per_set as usize;
        let mut schedule = self.schedule.lock();
        if !schedule.0.has_session(session) {
            return Err(Status::unavailable(format!("session_number: session {session} is still being opened")));
        }
        schedule.0.admits(session, views_per_set, frames_per_s, viewpoints.as_deref())?;
        self.step_locked(&mut schedule, Event::DemandChanged { session, views_per_set, frames_per_s });
        if let Some(viewpoints) = viewpoints {
            self.step_locked(&mut schedule, Event::ViewpointsChanged { session, viewpoints });
        }
        Ok(())
    }

    fn step_locked(&self, (scheduler, observers): &mut (Scheduler, Observers), event: Event) {
        let now = self.started.elapsed();
        observers.record(now, &event);
        let is_tick = matches!(event, Event::Tick);
        let commands = scheduler.step(now, event);
        // Nodes report often, and gauges are read seldom.
        if is_tick || !commands.is_empty() {
            observers.metrics.show(&scheduler.status(), &commands);
        }
        self.commands.waiting.lock().extend(commands);
        self.commands.added.notify_one();
    }

    /// Reads the schedule.
    pub(crate) fn with_scheduler<T>(&self, read: impl FnOnce(&Scheduler) -> T) -> T {
        read(&self.schedule.lock().0)
    }

    pub(crate) fn status(&self) -> ClusterStatus {
        self.with_scheduler(Scheduler::status)
    }

    /// A session whose client does not read its events is closed.
    pub(crate) fn send(&self, session: u64, event: SessionEvent) {
        if !self.sessions.send(session, event) {
            self.step(Event::Closed { session });
        }
    }

    /// A number that no session and no incarnation has had.
    pub(crate) fn next_number(&self) -> u64 {
        self.last_number.fetch_add(1, Ordering::Relaxed) + 1
    }
}

/// Commands in their order. None may be lost, and only an admitted event adds any.
#[derive(Default)]
pub(crate) struct CommandQueue {
    waiting: Mutex<VecDeque<Command>>,
    added: Notify,
}

impl CommandQueue {
    pub(crate) async fn next(&self) -> Command {
        loop {
            let next = self.waiting.lock().pop_front();
            match next {
                Some(command) => return command,
                None => self.added.notified().await,
            }
        }
    }
}
