//! A session's plan, followed as it changes: nodes come and go, and the coordinator may be away for a while.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use cluster::{Assignment, CompositorShare, SessionEvent, SessionPlan, SessionRequest};
use tokio::sync::{mpsc, watch};
use tokio_stream::StreamExt as _;
use tonic::Status;
use tonic::transport::Channel;
use wire::plan_in_force;
use wire::rpc::{CompositorClient, CoordinatorClient, Messages, connect, connect_later};

use crate::ClientError;
use crate::trouble::Suspicion;

/// Between two attempts to reach a coordinator that went away.
const FIRST_RETRY: Duration = Duration::from_millis(100);
const LAST_RETRY: Duration = Duration::from_secs(1);

/// A compositor and the channel to it.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    pub(crate) share: CompositorShare,
    pub(crate) client: CompositorClient,
    pub(crate) suspicion: Suspicion,
    learned: mpsc::Sender<Assignment>,
}

impl Peer {
    fn new(share: &CompositorShare, channel: Channel, learned: mpsc::Sender<Assignment>) -> Self {
        let client = CompositorClient::new(channel);
        Self { share: share.clone(), client, suspicion: Suspicion::default(), learned }
    }

    /// A compositor that refuses a plan says which is in force: the coordinator may be out of reach.
    pub(crate) fn learn(&self, refusal: &Status) {
        if let Some(assignment) = plan_in_force(refusal) {
            // Where there is no room, others have said so.
            let _ = self.learned.try_send(assignment);
        }
    }

    pub(crate) fn error(&self, reason: impl ToString) -> ClientError {
        compositor_error(&self.share, reason)
    }
}

/// A plan in force, and its compositors, but for those that cannot be reached.
#[derive(Debug)]
pub(crate) struct Live {
    pub(crate) plan: SessionPlan,
    pub(crate) peers: Vec<Peer>,
    learned: mpsc::Sender<Assignment>,
}

impl Live {
    /// # Errors
    /// Where no compositor can be reached.
    pub(crate) async fn reach(plan: SessionPlan, learned: &mpsc::Sender<Assignment>) -> Result<Self, ClientError> {
        let (mut peers, mut failed) = (Vec::with_capacity(plan.assignment.compositors.len()), None);
        for share in &plan.assignment.compositors {
            match connect(&share.address).await {
                Ok(channel) => peers.push(Peer::new(share, channel, learned.clone())),
                Err(status) => failed = Some(compositor_error(share, status.message())),
            }
        }
        match failed.filter(|_| peers.is_empty()) {
            Some(error) => Err(error),
            None => Ok(Self { plan, peers, learned: learned.clone() }),
        }
    }

    /// Reaches compositors when they are first asked: some may be back by then that cannot be reached now.
    fn later(plan: SessionPlan, learned: mpsc::Sender<Assignment>) -> Self {
        let peer = |share: &CompositorShare| {
            connect_later(&share.address).map(|channel| Peer::new(share, channel, learned.clone()))
        };
        let peers = plan.assignment.compositors.iter().filter_map(|share| peer(share).ok()).collect();
        Self { plan, peers, learned }
    }

    /// The plan of which a compositor says that it is in force, if it can be this session's.
    fn succeeded_by(&self, assignment: &Assignment) -> Option<Self> {
        let (old, new) = (&self.plan.assignment, assignment);
        let is_later = new.plan_epoch > old.plan_epoch;
        let shows_the_same = new.workload.scene == old.workload.scene && new.workload.timeline == old.workload.timeline;
        let plan =
            || SessionPlan { assignment: new.clone(), reason: "as a compositor says".to_owned(), ..self.plan.clone() };
        (is_later && shows_the_same).then(|| Self::later(plan(), self.learned.clone()))
    }

    /// All but those that failed lately; where that leaves none, all.
    pub(crate) fn trusted(&self) -> Vec<Peer> {
        let trusted: Vec<Peer> = self.peers.iter().filter(|peer| !peer.suspicion.holds()).cloned().collect();
        if trusted.is_empty() { self.peers.clone() } else { trusted }
    }

    pub(crate) fn plan_epoch(&self) -> u64 {
        self.plan.assignment.plan_epoch
    }
}

fn compositor_error(share: &CompositorShare, reason: impl ToString) -> ClientError {
    ClientError::Compositor {
        node_name: share.node_name.clone(),
        address: share.address.clone(),
        reason: reason.to_string(),
    }
}

/// What the coordinator last said.
#[derive(Debug, Clone)]
pub(crate) struct State {
    /// Its number at the coordinator.
    pub(crate) session: u64,
    pub(crate) live: Arc<Live>,
    /// Why the session has ended, if it has.
    pub(crate) ended: Option<String>,
}

/// Takes over plans that compositors name, until it is aborted.
pub(crate) async fn learn(mut learned: mpsc::Receiver<Assignment>, says: watch::Sender<State>) {
    while let Some(assignment) = learned.recv().await {
        says.send_if_modified(|state| match state.live.succeeded_by(&assignment) {
            Some(live) => {
                tracing::info!(plan_epoch = assignment.plan_epoch, "a compositor names the plan in force");
                state.live = Arc::new(live);
                true
            }
            None => false,
        });
    }
}

/// Follows until the session ends, or nobody looks any more. Frames go on while the coordinator is away; the session
/// is then opened once more.
pub(crate) async fn follow(
    coordinator: CoordinatorClient,
    request: Arc<Mutex<SessionRequest>>,
    mut events: Messages<SessionEvent>,
    says: watch::Sender<State>,
) {
    let mut retry = FIRST_RETRY;
    // Of a coordinator that was started again epochs may begin anew.
    let mut is_first = false;
    loop {
        while let Some(Ok(event)) = events.next().await {
            retry = FIRST_RETRY;
            match event {
                SessionEvent::Opened { session } => says.send_modify(|state| state.session = session),
                SessionEvent::Progress { .. } => (),
                // Plans are told when nodes have taken them: one that was replaced meanwhile may come last, and be in force
                // on a node that has left, with samplers that refuse it.
                SessionEvent::Plan(plan) => {
                    says.send_if_modified(|state| {
                        let counts = is_first || plan.assignment.plan_epoch >= state.live.plan_epoch();
                        if counts {
                            state.live = Arc::new(Live::later(*plan, state.live.learned.clone()));
                        }
                        counts
                    });
                    is_first = false;
                }
                SessionEvent::Ended { reason } => {
                    says.send_modify(|state| state.ended = Some(reason));
                    return;
                }
            }
        }
        events = loop {
            tokio::time::sleep(retry).await;
            retry = (retry * 2).min(LAST_RETRY);
            let again = request.lock().unwrap_or_else(PoisonError::into_inner).clone();
            match coordinator.open_session(again).await {
                Ok(events) => {
                    is_first = true;
                    break events;
                }
                Err(status) => tracing::debug!(reason = status.message(), "the coordinator is away"),
            }
        };
    }
}
