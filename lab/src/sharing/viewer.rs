//! The live viewer whose frames are counted.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use app_core::delivery::{at_rate, open, request};
use app_core::live::{Drive, Record, drive};
use client::{Client, Session};
use cluster::{Assignment, OfferStatus, PolicyChoice, SessionRequest};
use glam::UVec2;
use tokio::task::JoinHandle;

use crate::processes::orbit;

/// The size of the viewer's frames.
const SIZE_PX: UVec2 = UVec2::new(320, 180);
/// Poses a second.
pub(super) const RATE_HZ: f64 = 10.0;
/// Poses of the path.
const PATH_POSES: usize = 240;
/// The time in which the viewer's own start is over.
const SETTLE: Duration = Duration::from_secs(5);
/// The time for which the viewer goes on after the guest has left.
const AFTER: Duration = Duration::from_secs(2);
/// Longer than every guest may take.
const LONGEST: Duration = Duration::from_secs(600);

/// A viewer's frames from the guest's arrival to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Watched {
    /// The longest time without a new frame.
    pub(super) longest_gap_s: f64,
    /// Frames shown over poses.
    pub(super) shown_share: f64,
}

impl Watched {
    /// What a record shows from `since_s` on; a record that ended by an error shows nothing.
    pub(super) fn of(record: &Record, since_s: f64) -> Self {
        let shown = record.shown.iter().filter(|shown| shown.shown_s >= since_s).count();
        let poses = (record.seconds - since_s) * RATE_HZ;
        let (longest_gap_s, _) = record.longest_gap_s(since_s);
        Self { longest_gap_s, shown_share: (shown as f64 / poses.max(1.0)).min(1.0) }
    }
}

/// A viewer that follows its path until it is told to stop.
pub(super) struct Viewer {
    start: Instant,
    session: Arc<Session>,
    driving: JoinHandle<anyhow::Result<Record>>,
    stop: tokio::sync::oneshot::Sender<()>,
}

impl Viewer {
    /// Opens a session and follows an orbit; returns when frames have come for a while.
    ///
    /// # Errors
    /// The coordinator refuses.
    pub(super) async fn start(coordinator: &str, offer: &OfferStatus, policy: PolicyChoice) -> anyhow::Result<Self> {
        let path = orbit(offer, PATH_POSES, SIZE_PX)?;
        let request = at_rate(request(offer.settings.clone(), policy, &path[..1])?, RATE_HZ);
        let request = SessionRequest { scene: Some(offer.name.clone()), ..request };
        let client = Client::connect(coordinator).await?;
        let session = open(&client, request).await?;
        // Once with a frame in hand: shaders are built by then.
        let mut live = session.live();
        live.set_pose(path[0], 0)?;
        live.next().await?;
        drop(live);
        let (stop, stopped) = tokio::sync::oneshot::channel::<()>();
        let settings = Drive { path, rate_hz: RATE_HZ, lasting: LONGEST, set_step_s: 1.0, set_count: 1 };
        let session = Arc::new(session);
        let start = Instant::now();
        let driven = session.clone();
        let driving = tokio::spawn(async move { Ok(drive(&driven, &settings, stopped).await?) });
        tokio::time::sleep(SETTLE).await;
        Ok(Self { start, session, driving, stop })
    }

    /// Seconds since the first pose.
    pub(super) fn now_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// The plan in force.
    pub(super) fn plan(&self) -> Assignment {
        self.session.plan().assignment
    }

    /// Stops after a short while, and gives what was seen since `since_s`.
    ///
    /// # Errors
    /// The frames have ended by an error.
    pub(super) async fn stop(self, since_s: f64) -> anyhow::Result<Watched> {
        tokio::time::sleep(AFTER).await;
        // A viewer whose frames ended by an error has stopped already.
        let _ = self.stop.send(());
        let record = self.driving.await??;
        match record.error.clone() {
            Some(error) => Err(error).context("the viewer's frames have ended"),
            None => Ok(Watched::of(&record, since_s)),
        }
    }
}
