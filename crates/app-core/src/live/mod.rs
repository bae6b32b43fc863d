//! A moving camera: poses at a set rate, their frames, and the time of each frame by stage.

mod record;

use std::collections::BTreeMap;
use std::num::NonZeroU32;
use std::time::{Duration, Instant};

use client::{ClientError, LiveFrame, LiveView, Session};
use cluster::SessionPlan;
use depth_image::PinholeCamera;
use tokio::time::MissedTickBehavior;

pub use record::{Record, STAGES, Shown, latencies, quantile};

/// The longest wait for the frame of the last pose.
const LAST_FRAME: Duration = Duration::from_secs(2);

/// A path, and the way to follow it.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Poses, repeated from the first after the last.
    pub path: Vec<PinholeCamera>,
    /// Poses a second.
    pub rate_hz: f64,
    /// The time to follow the path.
    pub lasting: Duration,
    /// Seconds between sample sets of a scene that moves.
    pub set_step_s: f64,
    /// The number of sample sets, shown over and over.
    pub set_count: u32,
}

/// A drive in progress.
struct Driving<'a> {
    session: &'a Session,
    /// The session's fallback of each plan, by epoch.
    fallbacks: BTreeMap<u64, u32>,
    live: LiveView,
    start: Instant,
    record: Record,
    /// The fraction of a pose that is due, where a plan has fewer pictures a second than asked for.
    due: f64,
    last_frame: u64,
}

/// Follows the path, for its time or until `stop` resolves. An error that ends the frames is in the record.
///
/// # Errors
/// A pose cannot be sent: the session has ended, or the pose is not valid.
pub async fn drive(session: &Session, drive: &Drive, stop: impl Future) -> Result<Record, ClientError> {
    let mut driving = Driving {
        session,
        fallbacks: BTreeMap::new(),
        live: session.live(),
        start: Instant::now(),
        record: Record::default(),
        due: 0.0,
        last_frame: 0,
    };
    tokio::select! {
        followed = driving.follow(drive) => followed?,
        _ = stop => (),
    }
    driving.wait_for_the_last().await;
    driving.record.seconds = driving.start.elapsed().as_secs_f64();
    Ok(driving.record)
}

impl Driving<'_> {
    async fn follow(&mut self, drive: &Drive) -> Result<(), ClientError> {
        let mut ticks = tokio::time::interval(Duration::from_secs_f64(1.0 / drive.rate_hz));
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        while self.start.elapsed() < drive.lasting && self.record.error.is_none() {
            tokio::select! {
                _ = ticks.tick() => self.pose(drive)?,
                frame = self.live.next() => self.take(frame),
            }
        }
        Ok(())
    }

    /// Sends a pose as often as the plan has pictures for it.
    fn pose(&mut self, drive: &Drive) -> Result<(), ClientError> {
        let camera = drive.path[(self.record.posed % drive.path.len() as u64) as usize];
        let sets = (self.start.elapsed().as_secs_f64() / drive.set_step_s) as u64;
        self.record.posed += 1;
        self.due += self.plan().frame_rate_ratio;
        if self.due >= 1.0 {
            self.due -= 1.0;
            self.last_frame = self.live.set_pose(camera, (sets % u64::from(drive.set_count)) as u32)?;
        }
        Ok(())
    }

    /// The plan in force; its fallback is kept for frames of it that come later.
    fn plan(&mut self) -> SessionPlan {
        let plan = self.session.plan();
        self.fallbacks.insert(plan.assignment.plan_epoch, plan.fallback.map_or(0, NonZeroU32::get));
        plan
    }

    async fn wait_for_the_last(&mut self) {
        let end = Instant::now() + LAST_FRAME;
        while self.record.error.is_none() && self.record.shown.last().is_none_or(|last| last.frame < self.last_frame) {
            let Ok(frame) = tokio::time::timeout_at(end.into(), self.live.next()).await else { return };
            self.take(frame);
        }
    }

    fn take(&mut self, frame: Result<LiveFrame, ClientError>) {
        match frame {
            Ok(frame) => {
                self.plan();
                let plan_epoch = frame.frame.header.sample_set_id.plan_epoch;
                // Nodes may be a plan ahead of this client.
                let fallback = self.fallbacks.range(..=plan_epoch).next_back().map_or(0, |(_, fallback)| *fallback);
                self.record.shown.push(Shown::of(&frame, self.start, fallback));
            }
            Err(error) => self.record.error = Some(error),
        }
    }
}
