//! Many clients, each with a connection, a session and a camera of its own.

use std::time::Duration;

use anyhow::Context as _;
use app_core::delivery::{at_rate, open, request};
use app_core::live::{Drive, Record, drive};
use client::{Client, ClientError, LiveView, Session};
use cluster::{DIRECT, PolicyChoice, SessionRequest};
use depth_image::PinholeCamera;
use glam::UVec2;
use tokio::task::JoinSet;

use crate::processes::orbit;

/// Poses of a path; at 10 a second it takes 24 s.
const PATH_POSES: usize = 240;
/// The time between the starts of two clients.
const START_INTERVAL: Duration = Duration::from_millis(50);

/// What the clients of all loads ask for.
#[derive(Debug, Clone)]
pub struct Wanted {
    pub size_px: UVec2,
    /// Frames a second of each client, in place of each load's own.
    pub rate_hz: Option<f64>,
    /// How views are made; `None`: as the cluster offers.
    pub method: Option<String>,
}

/// A number of equal clients.
#[derive(Debug, Clone)]
pub struct Clients {
    pub count: usize,
    pub rate_hz: f64,
    /// The time for which each client asks.
    pub lasting: Duration,
}

/// The end of one client.
#[derive(Debug, Clone)]
pub enum Outcome {
    /// The client had a session and a stream.
    Served(Record),
    /// The cluster had no room for the client, at once or after a while.
    Refused,
}

/// A session to open, and a path for its camera.
#[derive(Debug, Clone)]
pub struct Tour {
    coordinator: String,
    request: SessionRequest,
    path: Vec<PinholeCamera>,
}

impl Tour {
    /// An orbit between the sample cameras of the coordinator's scene; idle clients ask for 0 frames a second.
    ///
    /// # Errors
    /// The coordinator does not answer, or has no scene.
    pub async fn of(coordinator: &str, wanted: &Wanted, rate_hz: f64) -> anyhow::Result<Self> {
        let status = Client::connect(coordinator).await?.status().await?;
        let offer = status.offers.into_iter().next().context("the coordinator does not say what it shows")?;
        let path = orbit(&offer, PATH_POSES, wanted.size_px)?;
        let mut settings = offer.settings;
        settings.method = wanted.method.clone().or(settings.method);
        let is_direct = settings.method.as_deref() == Some(DIRECT);
        let policy = if is_direct { PolicyChoice::Direct } else { PolicyChoice::Pipeline };
        let request = at_rate(request(settings, policy, &path[..1])?, rate_hz);
        Ok(Self { coordinator: coordinator.to_owned(), request, path })
    }

    /// Opens a connection and a session. All sessions have the same typical view, so that costs are measured once.
    pub async fn session(&self) -> anyhow::Result<Session> {
        let client = Client::connect(&self.coordinator).await?;
        open(&client, self.request.clone()).await
    }

    /// The path, from a start of the client's own.
    fn path_of(&self, client: usize, clients: usize) -> Vec<PinholeCamera> {
        let mut path = self.path.clone();
        path.rotate_left(client * PATH_POSES / clients.max(1));
        path
    }

    /// Opens a session and a live view that asks for nothing.
    pub async fn idle(&self) -> anyhow::Result<(Session, LiveView)> {
        let session = self.session().await?;
        let live = session.live();
        Ok((session, live))
    }

    /// Receives one frame, so that all that is made once has been made.
    ///
    /// # Errors
    /// The frame does not come.
    pub async fn warm(&self) -> anyhow::Result<(Session, LiveView)> {
        let (session, mut live) = self.idle().await?;
        live.set_pose(self.path[0], 0)?;
        live.next().await?;
        Ok((session, live))
    }
}

/// Lets every client follow its path, and returns the end of each.
///
/// # Errors
/// A client fails other than by refusal.
pub async fn follow(tour: &Tour, clients: &Clients) -> anyhow::Result<Vec<Outcome>> {
    let mut running = JoinSet::new();
    for client in 0..clients.count {
        let tour = tour.clone();
        let clients = clients.clone();
        running.spawn(async move { one(&tour, &clients, client).await });
        tokio::time::sleep(START_INTERVAL).await;
    }
    let mut outcomes = Vec::with_capacity(clients.count);
    while let Some(outcome) = running.join_next().await {
        outcomes.push(outcome??);
    }
    Ok(outcomes)
}

async fn one(tour: &Tour, clients: &Clients, client: usize) -> anyhow::Result<Outcome> {
    let session = match tour.session().await {
        Ok(session) => session,
        Err(error) => return refused(error),
    };
    let path = tour.path_of(client, clients.count);
    let settings = Drive { path, rate_hz: clients.rate_hz, lasting: clients.lasting, set_step_s: 1.0, set_count: 1 };
    let record = drive(&session, &settings, std::future::pending::<()>()).await?;
    match record.error {
        None => Ok(Outcome::Served(record)),
        Some(error) => refused(error.into()),
    }
}

fn refused(error: anyhow::Error) -> anyhow::Result<Outcome> {
    match error.downcast_ref() {
        Some(ClientError::Exhausted { .. }) => Ok(Outcome::Refused),
        _ => Err(error),
    }
}
