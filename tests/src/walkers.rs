//! Viewers that walk around the scene, each at its own place and always into a new view cell.

use std::f32::consts::TAU;
use std::sync::Arc;
use std::time::{Duration, Instant};

use client::{LiveView, Session};
use cluster::{PolicyChoice, SessionRequest, Timeline};
use depth_image::PinholeCamera;
use glam::UVec2;
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval, timeout};

use crate::cluster::{Cluster, camera_around, request};

const STILL: Timeline = Timeline { start_s: 1.0, step_s: 0.0, set_count: 1 };
/// Poses a second of each walker.
const RATE_HZ: f64 = 10.0;
/// A view cell ends after a quarter of the distance from the scene's middle: one in two seconds.
const RAD_PER_S: f32 = 0.125;
/// The longest wait for a walker's first frame.
const FIRST_FRAME: Duration = Duration::from_secs(20);

/// What the walkers saw, and what the cluster did.
#[derive(Debug, Clone, PartialEq)]
pub struct Walked {
    /// The policy of the last plan.
    pub policy: String,
    /// The time of the walk.
    pub seconds: f64,
    /// New plans.
    pub plans: u64,
    /// Sets that a walker waited for, and that could not be fetched.
    pub wanted_fetches_ended: u64,
    /// Sets that compositors loaded.
    pub sets_loaded: u64,
    /// The longest time without a new frame of any walker, in seconds.
    pub longest_gap_s: f64,
}

fn view(azimuth_rad: f32) -> PinholeCamera {
    camera_around(azimuth_rad, 3.0, UVec2::new(48, 36))
}

/// Lets `count` walkers walk for `lasting`, once all see the scene.
///
/// # Panics
/// A session does not open, or a walker's frames end.
pub async fn walk(cluster: &Cluster, count: usize, lasting: Duration) -> Walked {
    let mut walkers = Vec::with_capacity(count);
    for number in 0..count {
        walkers.push(Walker::start(cluster, TAU * number as f32 / count as f32).await);
    }
    let counted = || {
        let all = cluster.metrics.iter();
        all.fold((0, 0), |(ended, loaded), node| {
            (ended + node.wanted_fetches_ended.get(), loaded + node.sets_loaded.get())
        })
    };
    let plan = || walkers[0].session.plan().assignment;
    let first_epoch = plan().plan_epoch;
    let before = counted();
    let start = Instant::now();
    let watch = walkers[0].session.clone();
    let mut walking = JoinSet::new();
    for walker in walkers {
        walking.spawn(walker.walk(lasting));
    }
    let mut longest_gap_s = 0.0_f64;
    while let Some(gap_s) = walking.join_next().await {
        longest_gap_s = longest_gap_s.max(gap_s.expect("a walk to its end"));
    }
    let plan = watch.plan().assignment;
    let after = counted();
    Walked {
        policy: plan.policy.to_string(),
        seconds: start.elapsed().as_secs_f64(),
        plans: plan.plan_epoch - first_epoch,
        wanted_fetches_ended: after.0 - before.0,
        sets_loaded: after.1 - before.1,
        longest_gap_s,
    }
}

struct Walker {
    session: Arc<Session>,
    live: LiveView,
    azimuth_rad: f32,
}

impl Walker {
    /// Opens a session, and waits for a frame.
    async fn start(cluster: &Cluster, azimuth_rad: f32) -> Self {
        let request = SessionRequest {
            viewpoints: vec![view(azimuth_rad)],
            frames_per_s: Some(RATE_HZ),
            ..request(PolicyChoice::Pipeline, STILL)
        };
        let session = cluster.client.open_session(request, |_| ()).await.expect("a session");
        let mut live = session.live();
        live.set_pose(view(azimuth_rad), 0).expect("a pose");
        timeout(FIRST_FRAME, live.next()).await.expect("in time").expect("a frame");
        Self { session: session.into(), live, azimuth_rad }
    }

    /// Walks on and on; gives the longest time without a new frame.
    async fn walk(mut self, lasting: Duration) -> f64 {
        let mut ticks = interval(Duration::from_secs_f64(1.0 / RATE_HZ));
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let start = Instant::now();
        let mut last = Instant::now();
        let mut longest = Duration::ZERO;
        while start.elapsed() < lasting {
            tokio::select! {
                _ = ticks.tick() => {
                    let walked_rad = RAD_PER_S * start.elapsed().as_secs_f32();
                    self.live.set_pose(view(self.azimuth_rad + walked_rad), 0).expect("a pose");
                }
                frame = self.live.next() => {
                    frame.expect("a frame");
                    longest = longest.max(last.elapsed());
                    last = Instant::now();
                }
            }
        }
        longest.max(last.elapsed()).as_secs_f64()
    }
}
