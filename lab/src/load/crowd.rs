//! Many clients, each with a connection, a session and a camera of its own.

use std::time::Duration;

use anyhow::Context as _;
use app_core::delivery::{Wishes, open};
use app_core::live::{Drive, Record, drive};
use client::{Client, ClientError, LiveView, Session};
use cluster::PolicyChoice;
use depth_image::{Camera, PinholeCamera, ViewCell};
use glam::UVec2;
use tokio::task::JoinSet;

/// Poses of a way around; at 10 a second it takes 24 s.
const WAY: usize = 240;
/// Between two clients that come: they do not all come at once.
const BETWEEN: Duration = Duration::from_millis(50);

/// Who asks for what.
#[derive(Debug, Clone)]
pub struct Crowd {
    /// Clients.
    pub clients: usize,
    /// Frames a second of each.
    pub rate_hz: f64,
    /// Of each frame.
    pub size_px: UVec2,
    /// For how long.
    pub lasting: Duration,
}

/// What became of one client.
#[derive(Debug, Clone)]
pub enum Outcome {
    /// It had a session and a stream.
    Served(Record),
    /// There was no room for it: at once, or after a while.
    Refused(String),
}

/// How sessions are opened, and along what their cameras go.
#[derive(Debug, Clone)]
pub struct Tour {
    coordinator: String,
    wishes: Wishes,
    way: Vec<PinholeCamera>,
}

impl Tour {
    /// Around between the sample cameras of the coordinator's scene; 0 frames a second for clients that do nothing.
    ///
    /// # Errors
    /// A coordinator that does not answer, or has no scene.
    pub async fn of(coordinator: &str, size_px: UVec2, rate_hz: f64) -> anyhow::Result<Self> {
        let status = Client::connect(coordinator).await?.status().await?;
        let offer = status.offer.context("the coordinator does not say what it shows")?;
        let samples: Vec<_> = offer.sample_cameras.iter().map(|Camera::Pinhole(camera)| *camera).collect();
        let way = ViewCell::between(&samples).context("no sample cameras")?.orbit(WAY, size_px);
        let wishes = Wishes { policy: PolicyChoice::Pipeline, ..Wishes::offered(&offer).at_rate(rate_hz) };
        Ok(Self { coordinator: coordinator.to_owned(), wishes, way })
    }

    /// A connection and a session of its own. All have the same typical view, so that costs are measured once.
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn session(&self) -> anyhow::Result<Session> {
        let client = Client::connect(&self.coordinator).await?;
        open(&client, &self.wishes, &self.way[..1]).await
    }

    /// The same way for all, begun elsewhere by each.
    fn way_of(&self, client: usize, clients: usize) -> Vec<PinholeCamera> {
        let mut way = self.way.clone();
        way.rotate_left(client * WAY / clients.max(1));
        way
    }

    /// A client that has seen a frame and now does nothing.
    ///
    /// # Errors
    /// The coordinator's.
    pub async fn idle(&self) -> anyhow::Result<(Session, LiveView)> {
        let session = self.session().await?;
        let live = session.live();
        Ok((session, live))
    }

    /// One frame, so that all that is made once has been made.
    ///
    /// # Errors
    /// Where it does not come.
    pub async fn warm(&self) -> anyhow::Result<(Session, LiveView)> {
        let (session, mut live) = self.idle().await?;
        live.look(self.way[0], 0)?;
        live.next().await?;
        Ok((session, live))
    }
}

/// Every client follows its way; what became of each.
///
/// # Errors
/// Any failure but a refusal.
pub async fn follow(tour: &Tour, crowd: &Crowd) -> anyhow::Result<Vec<Outcome>> {
    let mut clients = JoinSet::new();
    for client in 0..crowd.clients {
        let (tour, crowd) = (tour.clone(), crowd.clone());
        clients.spawn(async move { one(&tour, &crowd, client).await });
        tokio::time::sleep(BETWEEN).await;
    }
    let mut outcomes = Vec::with_capacity(crowd.clients);
    while let Some(outcome) = clients.join_next().await {
        outcomes.push(outcome??);
    }
    Ok(outcomes)
}

async fn one(tour: &Tour, crowd: &Crowd, client: usize) -> anyhow::Result<Outcome> {
    let session = match tour.session().await {
        Ok(session) => session,
        Err(error) => return refused(error),
    };
    let path = tour.way_of(client, crowd.clients);
    let way = Drive { path, rate_hz: crowd.rate_hz, lasting: crowd.lasting, set_step_s: 1.0, set_count: 1 };
    let record = drive(&session, &way).await?;
    match record.error {
        None => Ok(Outcome::Served(record)),
        Some(error) => refused(error.into()),
    }
}

fn refused(error: anyhow::Error) -> anyhow::Result<Outcome> {
    match error.downcast_ref() {
        Some(ClientError::Exhausted { reason }) => Ok(Outcome::Refused(reason.clone())),
        _ => Err(error),
    }
}
