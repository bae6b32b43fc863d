//! A client that requests views all the time, and records the answers.

use std::sync::Arc;
use std::time::{Duration, Instant};

use client::{Client, Session, ViewRequest};
use cluster::{PolicyChoice, Refinement, SessionRequest, Timeline};
use glam::UVec2;
use parking_lot::{Mutex, MutexGuard};
use tokio::task::JoinHandle;

use crate::cluster::{camera, request};
use crate::history::{Call, History, Seen};
use crate::picture::fault_of;

/// Views of one call: enough for every compositor of a small cluster.
const VIEWS: u64 = 4;
/// Pause between two calls, which leaves time for other work.
const PAUSE: Duration = Duration::from_millis(20);

/// A repeated timeline of distinct sets. They are more than a node of `scalar_cluster` keeps, so that samplers are needed
/// all the time.
pub const MOVING: Timeline = Timeline { start_s: 0.0, step_s: 0.05, set_count: 40 };

/// The request of the recorded session.
#[must_use]
pub fn watched_request() -> SessionRequest {
    request(PolicyChoice::Pipeline, MOVING)
}

/// A client that requests views until it is dropped.
#[derive(Debug)]
pub struct Watcher {
    /// The session of its requests.
    pub session: Arc<Session>,
    history: Arc<Mutex<History>>,
    asking: JoinHandle<()>,
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.asking.abort();
    }
}

impl Watcher {
    /// Opens a session and starts the requests.
    ///
    /// # Panics
    /// No session opens, or its first frames do not arrive.
    pub async fn start(client: &Client) -> Self {
        Self::start_with(client, watched_request()).await
    }

    /// As [`Watcher::start`], with a request of the timeline [`MOVING`].
    ///
    /// # Panics
    /// As [`Watcher::start`].
    pub async fn start_with(client: &Client, request: SessionRequest) -> Self {
        let session = Arc::new(client.open_session(request, |_| ()).await.expect("a session"));
        let history = Arc::<Mutex<History>>::default();
        let asking = tokio::spawn(ask(session.clone(), history.clone()));
        let watcher = Self { session, history, asking };
        watcher.calls_after(Instant::now(), 2, Duration::from_secs(10)).await;
        watcher
    }

    /// The history up to now.
    #[must_use]
    pub fn history(&self) -> History {
        self.locked().clone()
    }

    fn locked(&self) -> MutexGuard<'_, History> {
        self.history.lock()
    }

    /// The client's present plan.
    #[must_use]
    pub fn epoch(&self) -> u64 {
        self.session.plan().assignment.plan_epoch
    }

    /// Waits for `count` complete calls that began after `since`.
    ///
    /// # Panics
    /// They take longer than `deadline`.
    pub async fn calls_after(&self, since: Instant, count: usize, deadline: Duration) {
        let answered = |call: &&Call| call.error.is_none() && call.asked >= since;
        let what = format!("{count} calls in full");
        eventually(&what, deadline, || self.locked().calls.iter().filter(answered).count() >= count).await;
    }

    /// Waits for a plan that `holds` and frames of it; returns the longest time without frames since then.
    ///
    /// # Panics
    /// It takes longer than `deadline`.
    pub async fn healed(&self, since: Instant, deadline: Duration, holds: impl Fn(&Session) -> bool) -> Duration {
        eventually("another plan", deadline, || holds(&self.session)).await;
        self.calls_after(Instant::now(), 2, deadline).await;
        let wait = self.locked().longest_wait(since);
        assert!(wait < deadline, "no frames for {wait:?}, at most {deadline:?}");
        wait
    }
}

/// Waits for a condition.
///
/// # Panics
/// It takes longer than `deadline`.
pub async fn eventually(what: &str, deadline: Duration, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < deadline, "{what}: not within {deadline:?}");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

async fn ask(session: Arc<Session>, history: Arc<Mutex<History>>) {
    for number in 0.. {
        let plan = session.plan().assignment;
        let call = ask_once(&session, number).await;
        {
            let mut history = history.lock();
            if history.plans.last() != Some(&plan) {
                history.plans.push(plan);
            }
            history.calls.push(call);
        }
        tokio::time::sleep(PAUSE).await;
    }
}

async fn ask_once(session: &Session, number: u64) -> Call {
    let wanted = number * VIEWS..(number + 1) * VIEWS;
    let set_index = (number % u64::from(MOVING.set_count)) as u32;
    let scene_time_s = MOVING.time_s(set_index).expect("one of its sets");
    let view = move |frame: u64| ViewRequest {
        frame,
        set_index,
        camera: camera((frame % VIEWS) as f32 * 0.2 - 0.3, UVec2::new(40, 30)),
    };
    let asked = Instant::now();
    let mut frames = Vec::new();
    let mut error = None;
    match session.render_views(wanted.clone().map(view)) {
        Err(refused) => error = Some(refused.to_string()),
        Ok(mut coming) => {
            while let Some(next) = coming.next().await {
                match next {
                    Ok(frame) => frames.push(Seen {
                        frame: frame.request.frame,
                        plan_epoch: frame.header.sample_set_id.plan_epoch,
                        set_index: frame.header.sample_set_id.index,
                        fault: fault_of(&frame, scene_time_s, Refinement::default()),
                    }),
                    Err(failed) => error = Some(failed.to_string()),
                }
            }
        }
    }
    Call { asked, ended: Instant::now(), wanted, set_index: u64::from(set_index), frames, error }
}
