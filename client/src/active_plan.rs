//! The plan in force and its compositors, as a session knows them. It changes: nodes come and go, and the coordinator may be
//! away for a while.

use std::cmp::Reverse;
use std::sync::Arc;

use cluster::{Assignment, Promise, RenderViews, SessionEvent, SessionPlan, SessionRequest};
use parking_lot::Mutex;
use tokio::sync::{mpsc, watch};
use tokio_stream::StreamExt as _;
use wire::rpc::{Backoff, CoordinatorClient, Messages, connect, connect_later};

use crate::error::ClientError;
use crate::peer::Peer;
use crate::view_request::ViewSettings;

/// A plan in force, and its compositors, but for those that cannot be reached.
#[derive(Debug)]
pub(crate) struct ActivePlan {
    pub(crate) plan: SessionPlan,
    pub(crate) peers: Vec<Peer>,
    /// As the session asked for.
    pub(crate) settings: ViewSettings,
    named_plans: mpsc::Sender<Assignment>,
}

impl ActivePlan {
    /// Connects to the plan's compositors; what they name as the plan in force goes to `named_plans`.
    ///
    /// # Errors
    /// Where no compositor can be reached.
    pub(crate) async fn connect(
        plan: SessionPlan,
        settings: ViewSettings,
        named_plans: mpsc::Sender<Assignment>,
    ) -> Result<Self, ClientError> {
        let mut peers = Vec::new();
        let mut failed = None;
        for share in &plan.assignment.compositors {
            match connect(&share.address).await {
                Ok(channel) => peers.push(Peer::new(share, channel, named_plans.clone())),
                Err(status) => failed = Some(ClientError::compositor(share, status.message())),
            }
        }
        match failed.filter(|_| peers.is_empty()) {
            Some(error) => Err(error),
            None => Ok(Self { plan, peers, settings, named_plans }),
        }
    }

    /// The plan after this one. Connects to compositors when they are first asked: some that cannot be reached now may be
    /// back by then.
    pub(crate) fn replaced_by(&self, plan: SessionPlan) -> Self {
        let peers = plan.assignment.compositors.iter().filter_map(|share| {
            let channel = connect_later(&share.address).ok()?;
            Some(Peer::new(share, channel, self.named_plans.clone()))
        });
        let peers = peers.collect();
        Self { plan, peers, settings: self.settings.clone(), named_plans: self.named_plans.clone() }
    }

    /// The plan that a compositor names as the one in force, if it can be this session's.
    pub(crate) fn succeeded_by(&self, new: &Assignment) -> Option<Self> {
        let old = &self.plan.assignment;
        let can_follow = new.plan_epoch > old.plan_epoch
            && new.workload_number == old.workload_number
            && new.workload.scene == old.workload.scene
            && new.workload.timeline == old.workload.timeline;
        let reason = "as a compositor says".to_owned();
        can_follow.then(|| self.replaced_by(SessionPlan { assignment: new.clone(), reason, ..self.plan.clone() }))
    }

    /// All peers but those that failed lately; where that leaves none, all. Those of the greatest weight come first.
    pub(crate) fn trusted(&self) -> Vec<Peer> {
        let mut peers: Vec<Peer> = self.peers.iter().filter(|peer| !peer.breaker.is_open()).cloned().collect();
        if peers.is_empty() {
            peers.clone_from(&self.peers);
        }
        peers.sort_by_key(|peer| Reverse(peer.share.view_weight));
        peers
    }

    pub(crate) fn plan_epoch(&self) -> u64 {
        self.plan.assignment.plan_epoch
    }

    /// A request without views, of set 0. The plan may name the method of all sessions.
    pub(crate) fn request(&self) -> RenderViews {
        let ViewSettings { method, codec, planes } = &self.settings;
        RenderViews {
            plan_epoch: self.plan_epoch(),
            workload_number: self.plan.assignment.workload_number,
            set_index: 0,
            method: self.plan.assignment.method.as_ref().unwrap_or(method).clone(),
            codec: *codec,
            planes: *planes,
            views: Vec::new(),
            live: None,
        }
    }
}

/// The state of a session, as the coordinator last said.
#[derive(Debug, Clone)]
pub(crate) struct SessionState {
    /// Its number at the coordinator.
    pub(crate) session: u64,
    /// The promise to it.
    pub(crate) promise: Option<Promise>,
    pub(crate) active: Arc<ActivePlan>,
}

/// Waits until `find` finds something in a session's state. Nothing follows once the session has ended: the wait then never
/// ends.
pub(crate) async fn first_in<T>(
    mut state: watch::Receiver<SessionState>,
    find: impl Fn(&SessionState) -> Option<T>,
) -> T {
    let found = state.wait_for(|state| find(state).is_some()).await.ok().and_then(|state| find(&state));
    match found {
        Some(found) => found,
        None => std::future::pending().await,
    }
}

/// Takes over plans that compositors name, until it is aborted.
pub(crate) async fn follow_compositors(
    mut named_plans: mpsc::Receiver<Assignment>,
    state: watch::Sender<SessionState>,
) {
    while let Some(assignment) = named_plans.recv().await {
        state.send_if_modified(|state| {
            let Some(active) = state.active.succeeded_by(&assignment) else { return false };
            tracing::info!(plan_epoch = assignment.plan_epoch, "a compositor names the plan in force");
            state.active = Arc::new(active);
            true
        });
    }
}

/// Takes over what the coordinator says, until it is aborted. Frames go on while the coordinator is away; the session
/// is then opened once more.
pub(crate) async fn follow_coordinator(
    coordinator: CoordinatorClient,
    request: Arc<Mutex<SessionRequest>>,
    mut events: Messages<SessionEvent>,
    state: watch::Sender<SessionState>,
) {
    let mut backoff = Backoff::reconnect();
    // Epochs of a coordinator that was restarted may begin anew.
    let mut is_new_session = false;
    loop {
        while let Some(Ok(event)) = events.next().await {
            backoff.reset();
            take_over(event, &state, &mut is_new_session);
        }
        events = loop {
            tokio::time::sleep(backoff.next_delay()).await;
            let request = request.lock().clone();
            match coordinator.open_session(request).await {
                Ok(events) => break events,
                Err(status) => tracing::debug!(reason = status.message(), "the coordinator is away"),
            }
        };
        is_new_session = true;
    }
}

fn take_over(event: SessionEvent, state: &watch::Sender<SessionState>, is_new_session: &mut bool) {
    match event {
        SessionEvent::Opened { session } => {
            state.send_modify(|state| (state.session, state.promise) = (session, None));
        }
        SessionEvent::Progress { .. } => (),
        // The coordinator sends a plan when its nodes have taken it: one that was replaced meanwhile may arrive last.
        SessionEvent::Plan(plan) => drop(state.send_if_modified(|state| {
            let is_new_session = std::mem::take(is_new_session);
            let is_current = is_new_session || plan.assignment.plan_epoch >= state.active.plan_epoch();
            if is_current {
                state.active = Arc::new(state.active.replaced_by(*plan));
            }
            is_current
        })),
        SessionEvent::Promise(promise) => state.send_modify(|state| state.promise = Some(promise)),
    }
}
