//! Views over plain HTTP: four at a time, and some that wait.

use std::sync::Arc;

use client::{Frame, Session, ViewRequest};
use depth_image::{PinholeCamera, ViewPlanes};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Views that are made at a time.
const MADE: usize = 4;
/// Views that wait.
const WAITING: usize = 64;

/// The places of views over HTTP.
pub(crate) struct Stills {
    made: Semaphore,
    all: Arc<Semaphore>,
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
        Self { made: Semaphore::new(MADE), all: Arc::new(Semaphore::new(MADE + WAITING)) }
    }
}

impl Stills {
    /// A place, which a view keeps until it has been read.
    pub(crate) fn place(&self) -> Result<OwnedSemaphorePermit, StillError> {
        self.all.clone().try_acquire_owned().map_err(|_| StillError::Full)
    }

    /// One view of a session: of a moment of a scene that moves, else in its finished light.
    pub(crate) async fn frame(
        &self,
        session: &Session,
        camera: PinholeCamera,
        planes: ViewPlanes,
        moment: u32,
    ) -> Result<Frame, StillError> {
        let _made = self.made.acquire().await.map_err(|_| StillError::Full)?;
        let timeline = session.plan().assignment.workload.timeline;
        let set_index = if timeline.moves() { moment } else { timeline.set_count - 1 };
        let request = ViewRequest { frame: 1, set_index, camera };
        let frames = session.render_views_with(planes, [request])?.all().await?;
        let over = || client::ClientError::Ended { reason: "no frame was received".to_owned() };
        Ok(frames.into_iter().next().ok_or_else(over)?)
    }
}
