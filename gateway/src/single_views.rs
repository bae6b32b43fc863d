//! Single views over HTTP: some of each session are made at a time, and others wait.

use axum::http::StatusCode;
use client::{ClientError, Frame, Session, ViewRequest};
use cluster::SessionPlan;
use depth_image::{PinholeCamera, ViewPlanes};
use tokio::sync::OwnedSemaphorePermit;

use crate::gateway::Gateway;
use crate::kept_session::KeptSession;
use crate::responses::Refusal;

/// Views that are made, wait, or are read.
pub(crate) const PLACES: usize = 68;

/// A view, and the plan that it was made under.
pub(crate) struct SingleView {
    pub(crate) frame: Frame,
    /// `None` where the plan has changed twice meanwhile.
    plan: Option<SessionPlan>,
    /// Kept until the answer has been read.
    pub(crate) place: OwnedSemaphorePermit,
}

impl Gateway {
    /// One view: of a moment of a scene that moves, else in its finished light. By a method of the session's samples where one is
    /// named.
    pub(crate) async fn draw(
        &self,
        kept: &KeptSession,
        camera: PinholeCamera,
        planes: ViewPlanes,
        method: Option<String>,
        moment: u32,
    ) -> Result<SingleView, Refusal> {
        // A session that does not open takes no place from others.
        let session = kept.opened().await?;
        let place = self.single_views.clone().try_acquire_owned().map_err(|_| {
            let reason = format!("{PLACES} views are under way already: try again later");
            Refusal(StatusCode::TOO_MANY_REQUESTS, reason)
        })?;
        let _made = kept.single_views.acquire().await.map_err(Refusal::internal)?;
        match made(&session, camera, planes, method, moment).await {
            Ok((frame, plan)) => Ok(SingleView { frame, plan, place }),
            Err(error) => {
                // Pages judge a session that they watch: one request ends it for nobody.
                if !kept.visits.has_pages() {
                    kept.has_failed(session, &error);
                }
                Err(match error {
                    ClientError::Invalid { .. } => Refusal::bad(error),
                    error => error.into(),
                })
            }
        }
    }
}

async fn made(
    session: &Session,
    camera: PinholeCamera,
    planes: ViewPlanes,
    method: Option<String>,
    moment: u32,
) -> Result<(Frame, Option<SessionPlan>), ClientError> {
    let plan = session.plan();
    let timeline = plan.assignment.workload.timeline;
    let set_index = if timeline.moves() { moment } else { timeline.set_count - 1 };
    let request = ViewRequest { frame: 1, set_index, camera };
    let frames = session.render_views_with(planes, method, [request])?.all().await?;
    let frame = frames.into_iter().next();
    let frame = frame.ok_or_else(|| ClientError::Ended { reason: "no frame was received".to_owned() })?;
    let plan_epoch = frame.header.sample_set_id.plan_epoch;
    let plan = [plan, session.plan()].into_iter().find(|plan| plan.assignment.plan_epoch == plan_epoch);
    Ok((frame, plan))
}

impl SingleView {
    /// The number of the first sample camera of its view cell.
    pub(crate) fn first_camera(&self) -> Result<usize, Refusal> {
        let plan = self
            .plan
            .as_ref()
            .ok_or_else(|| Refusal(StatusCode::SERVICE_UNAVAILABLE, "the plan has changed: try again".to_owned()))?;
        let workload = &plan.assignment.workload;
        Ok(workload.cameras_of_cell(self.frame.header.cell as usize).map_or(0, |cameras| cameras.start))
    }
}
