//! Open sessions, and the streams by which their clients hear of them.

use std::collections::HashMap;

use cluster::SessionEvent;
use parking_lot::Mutex;
use tokio::sync::mpsc;
use tonic::Status;

/// Events that a session's client has not read yet.
const UNREAD_EVENTS: usize = 64;

pub(crate) type EventSender = mpsc::Sender<Result<SessionEvent, Status>>;

/// Event streams by session.
#[derive(Default)]
pub(crate) struct SessionRegistry(Mutex<HashMap<u64, EventSender>>);

impl SessionRegistry {
    /// Admits one more session, before any work is done for it.
    pub(crate) fn admit(
        &self,
        session: u64,
        most: usize,
    ) -> Result<(EventSender, mpsc::Receiver<Result<SessionEvent, Status>>), Status> {
        let mut sessions = self.0.lock();
        if sessions.len() >= most {
            return Err(Status::resource_exhausted(format!("quota max_sessions: {most} sessions are open")));
        }
        let (events, stream) = mpsc::channel(UNREAD_EVENTS);
        // There is room: it is the first event.
        let _ = events.try_send(Ok(SessionEvent::Opened { session }));
        sessions.insert(session, events.clone());
        Ok((events, stream))
    }

    pub(crate) fn contains(&self, session: u64) -> bool {
        self.0.lock().contains_key(&session)
    }

    /// Ends a session that cannot be planned.
    pub(crate) fn refuse(&self, session: u64, status: Status) {
        tracing::warn!(session, reason = status.message(), "session refused");
        if let Some(events) = self.0.lock().remove(&session) {
            let _ = events.try_send(Err(status));
        }
    }

    /// Sends an event. `false` where the client does not read its events: the session is removed.
    pub(crate) fn send(&self, session: u64, event: SessionEvent) -> bool {
        let mut sessions = self.0.lock();
        let is_full = sessions.get(&session).is_some_and(|events| events.try_send(Ok(event)).is_err());
        if is_full {
            sessions.remove(&session);
        }
        !is_full
    }

    pub(crate) fn remove(&self, session: u64) {
        self.0.lock().remove(&session);
    }
}
