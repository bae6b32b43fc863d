//! Views over plain HTTP: four at a time, and some that wait.

use client::{Session, ViewRequest};
use depth_image::{PinholeCamera, View};
use tokio::sync::Semaphore;

/// Views that are made at a time.
const MADE: usize = 4;
/// Views that wait.
const WAITING: usize = 64;

/// The places of views over HTTP.
pub(crate) struct Stills {
    made: Semaphore,
    all: Semaphore,
}

/// Why a view is not made.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StillError {
    /// Too many wait.
    #[error("{WAITING} views wait already: try again later")]
    Full,
    /// The cluster's reason.
    #[error(transparent)]
    Client(#[from] client::ClientError),
}

impl Default for Stills {
    fn default() -> Self {
        Self { made: Semaphore::new(MADE), all: Semaphore::new(MADE + WAITING) }
    }
}

impl Stills {
    /// One view of a session.
    pub(crate) async fn view(&self, session: &Session, camera: PinholeCamera) -> Result<View, StillError> {
        let _waits = self.all.try_acquire().map_err(|_| StillError::Full)?;
        let _made = self.made.acquire().await.map_err(|_| StillError::Full)?;
        let request = ViewRequest { frame: 1, set_index: 0, camera };
        let frames = session.render_views([request])?.all().await?;
        let over = || client::ClientError::Ended { reason: "no frame was received".to_owned() };
        Ok(frames.into_iter().next().map(|frame| frame.view).ok_or_else(over)?)
    }
}
