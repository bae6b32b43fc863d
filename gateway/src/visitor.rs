//! One visitor: poses come over a WebSocket, and pictures go back.
//!
//! A visitor has two live streams, so that a still never holds up motion. A picture's credit is given back when the page has
//! it on its screen: at most two of each stream are on their way. A picture is never older than one that was sent, and a still
//! is always of the newest pose.

use std::collections::VecDeque;
use std::sync::Arc;

use axum::extract::ws::WebSocket;
use client::{ClientError, ClientId, EncodedFrame, PictureQuality, Session};
use cluster::{Assignment, Policy, Promise, SessionPlan};
use codec::FrameCodec;
use depth_image::{Antialias, PinholeCamera, SampleCamera};
use glam::UVec2;
use tokio::sync::watch;

use crate::camera::still_size;
use crate::gateway::Gateway;
use crate::kept_session::{KeptSession, SessionState};
use crate::page::{End, Page, with_page};
use crate::picture_stream::{About, Asked, PictureStream};
use crate::protocol::{FromPage, Pose, ToPage};
use crate::rate::{Rate, Shown};
use crate::scenes::{SceneError, SceneSessions};

/// The longest age that says something of the link: a page may have been hidden.
const MAX_AGE_MS: f64 = 10_000.0;
/// Plans that are remembered.
const PLANS: usize = 2;

/// Serves a page until it leaves.
pub(crate) async fn visit(socket: WebSocket, gateway: Arc<Gateway>) {
    with_page(socket, &gateway, async |page| serve(page, &gateway).await).await;
}

async fn serve(page: &mut Page, gateway: &Gateway) -> Result<(), End> {
    let name = page.opened().await?;
    let _place = admitted(page, gateway).await?;
    let scene = found(page, gateway, name.as_deref()).await?;
    page.tell(&ToPage::Welcome {
        version: crate::assets::VERSION,
        scenes: gateway.scenes.names(),
        scene: scene.offer.name.clone(),
        home: scene.home,
        light_steps: scene.shown.light_steps,
        still_samples: Antialias::MOST.samples(),
        moments: scene.timeline().set_count,
        moment_step_s: scene.timeline().step_s,
        max_still_px: gateway.config.max_still_px.to_array(),
        bounds: [scene.offer.volume.min, scene.offer.volume.max].map(|corner| scene.space.in_source(corner)),
    })?;
    let mut visitor = Visitor {
        number: gateway.next_visitor(),
        is_moving: false,
        light_step: 0,
        made_with: None,
        is_finished: false,
        most_samples: Antialias::MOST,
        scene,
        max_still_px: gateway.config.max_still_px,
        newest: None,
        sent: 0,
        plans: VecDeque::new(),
        promise: None,
        rate: Rate::default(),
    };
    visitor.follow(page).await
}

/// Waits for a place among the visitors.
async fn admitted<'a>(page: &mut Page, gateway: &'a Gateway) -> Result<tokio::sync::SemaphorePermit<'a>, End> {
    if let Ok(place) = gateway.visitors.try_acquire() {
        return Ok(place);
    }
    page.wait("full", "all places are taken: this page is let in when there is room")?;
    page.hearing(gateway.visitors.acquire(), |_, _| Ok(())).await?.map_err(|_| End::Gone)
}

/// The scene that a page asks for, once the coordinator answers.
async fn found(page: &mut Page, gateway: &Gateway, name: Option<&str>) -> Result<Arc<SceneSessions>, End> {
    loop {
        match page.hearing(gateway.scenes.visit(name), |_, _| Ok(())).await? {
            Ok(scene) => return Ok(scene),
            Err(error @ SceneError::Unknown { .. }) => return Err(End::Refused(error.to_string())),
            Err(error) => page.wait("connecting", &error.to_string())?,
        }
        page.pause(|_, _| Ok(())).await?;
    }
}

struct Visitor {
    number: u64,
    scene: Arc<SceneSessions>,
    /// Whether the scene moves for the visitor.
    is_moving: bool,
    /// The latest step of light that a still has shown: from 0.
    light_step: u32,
    /// The sample cameras of the last picture; `None` before one, or where its plan is long over.
    made_with: Option<Vec<SampleCamera>>,
    /// Whether the last picture has finished light and all samples a pixel, if it is a still.
    is_finished: bool,
    /// Samples a pixel of a finished still: fewer where the cluster has refused more.
    most_samples: Antialias,
    max_still_px: UVec2,
    newest: Option<Pose>,
    /// The number of the last picture.
    sent: u64,
    /// The last plans that the page was told of, the newest first: pictures may still come under the one before.
    plans: VecDeque<Assignment>,
    /// The last promise that it was told of.
    promise: Option<Promise>,
    rate: Rate,
}

impl Drop for Visitor {
    fn drop(&mut self) {
        self.kept(&self.scene).visits.left(self.number);
    }
}

impl Visitor {
    /// Serves from one session after the other.
    async fn follow(&mut self, page: &mut Page) -> Result<(), End> {
        let scene = self.scene.clone();
        loop {
            let kept = self.kept(&scene);
            let _visit = kept.visits.begin();
            let mut states = kept.states();
            while self.is_at(kept) {
                let state = states.borrow_and_update().clone();
                let session = match state {
                    SessionState::Open(session) => session,
                    SessionState::Waiting { stage, detail } => {
                        page.wait(stage, &detail)?;
                        self.wait_for_change(page, kept, &mut states).await?;
                        continue;
                    }
                };
                let Some(error) = self.serve_from(page, kept, &session, &mut states).await? else { continue };
                page.wait("reconnecting", &error.to_string())?;
                kept.has_failed(session, &error);
                page.pause(|page, message| self.hear(page, message)).await?;
            }
            kept.visits.left(self.number);
        }
    }

    /// The session of the visitor's moment.
    fn kept<'a>(&self, scene: &'a SceneSessions) -> &'a KeptSession {
        scene.session_of(u32::from(self.is_moving))
    }

    /// Whether a session is that of the visitor's moment.
    fn is_at(&self, kept: &KeptSession) -> bool {
        std::ptr::eq(self.kept(&self.scene), kept)
    }

    /// Takes poses until a session is open, or is another one.
    async fn wait_for_change(
        &mut self,
        page: &mut Page,
        kept: &KeptSession,
        states: &mut watch::Receiver<SessionState>,
    ) -> Result<(), End> {
        loop {
            tokio::select! {
                changed = states.changed() => return changed.map_err(|_| End::Gone),
                message = page.next() => self.hear(page, message?)?,
            }
            if !self.is_at(kept) {
                return Ok(());
            }
        }
    }

    /// Serves from a session until it fails; `None` when the visitor needs another one, or there is another.
    async fn serve_from(
        &mut self,
        page: &mut Page,
        kept: &KeptSession,
        session: &Session,
        states: &mut watch::Receiver<SessionState>,
    ) -> Result<Option<ClientError>, End> {
        self.begin(page, session)?;
        let client = ClientId::new();
        let (mut motion, mut still) = (PictureStream::new(session, client), PictureStream::new(session, client));
        if let Some(pose) = self.newest {
            self.ask(pose, &mut motion, &mut still)?;
        }
        loop {
            tokio::select! {
                message = page.next() => match message? {
                    FromPage::Shown { number, age_ms } => {
                        self.shown(page, number, age_ms, &motion);
                        motion.shown(number);
                        still.shown(number);
                    }
                    message => {
                        self.hear(page, message)?;
                        if !self.is_at(kept) {
                            return Ok(None);
                        }
                        if let Some(pose) = self.newest {
                            self.ask(pose, &mut motion, &mut still)?;
                        }
                    }
                },
                changed = states.changed() => return changed.map(|()| None).map_err(|_| End::Gone),
                plan = session.another_plan(self.plan_epoch()) => {
                    self.tell_plan(page, &plan)?;
                    self.renew_still(&plan, &mut motion, &mut still)?;
                }
                promise = session.another_promise(self.promise.as_ref()) => {
                    self.promise = Some(promise);
                    self.tell_plan(page, &session.plan())?;
                }
                frame = motion.next() => match frame {
                    Ok((frame, asked)) => self.forward(page, session, &mut motion, frame, asked)?,
                    Err(error) => return Ok(Some(error)),
                },
                frame = still.next() => match frame {
                    Ok((frame, asked)) => self.forward(page, session, &mut still, frame, asked)?,
                    Err(ClientError::Exhausted { .. }) if self.most_samples > Antialias::NONE => {
                        self.most_samples = fewer(self.most_samples);
                        still = PictureStream::new(session, client);
                        if let Some(pose) = self.newest {
                            self.ask(pose, &mut motion, &mut still)?;
                        }
                    }
                    Err(error) => return Ok(Some(error)),
                },
            }
        }
    }

    /// Nothing of a session has been sent yet.
    fn begin(&mut self, page: &Page, session: &Session) -> Result<(), End> {
        self.plans.clear();
        self.is_finished = false;
        self.promise = session.promise();
        self.tell_plan(page, &session.plan())
    }

    /// Takes a pose.
    fn hear(&mut self, page: &mut Page, message: FromPage) -> Result<(), End> {
        match message {
            FromPage::Open { .. } => Err(End::Refused("type: open comes once".to_owned())),
            FromPage::Shown { .. } | FromPage::Received {} => Ok(()),
            FromPage::Pose(pose) => {
                let last = self.newest_number();
                if pose.number <= last {
                    return Err(End::Refused(format!("number: {} comes after {last}", pose.number)));
                }
                let moments = self.scene.timeline().set_count;
                if pose.moment >= moments {
                    return Err(End::Refused(format!("moment: {} must be below {moments}", pose.moment)));
                }
                let canvas_px = UVec2::from_array(pose.canvas_px);
                let checked = self.scene.space.camera(&pose.camera, canvas_px);
                checked.map_err(|error| End::Refused(error.to_string()))?;
                self.rate.fit(canvas_px);
                self.newest = Some(pose);
                page.end_still();
                // A scene that moves passes its first moment, too.
                self.is_moving = pose.moment > 0 || self.is_moving && !pose.still;
                self.kept(&self.scene).visits.moved(self.number, page.heard);
                Ok(())
            }
        }
    }

    /// Asks for the picture of a pose.
    fn ask(&self, pose: Pose, motion: &mut PictureStream, still: &mut PictureStream) -> Result<(), End> {
        let canvas_px = UVec2::from_array(pose.canvas_px);
        let chosen = self.rate.chosen();
        let (stream, size_px, codec) = if pose.still {
            (still, still_size(canvas_px, self.max_still_px), FrameCodec::Png)
        } else {
            (motion, chosen.size_px(canvas_px), FrameCodec::Jpeg { quality: chosen.quality() })
        };
        // The first still comes soon: more samples follow once its light is finished.
        let quality = PictureQuality { codec, antialias: Antialias::NONE };
        let camera = self.scene.space.camera(&pose.camera, canvas_px).map(|camera| camera.resized(size_px));
        let camera = camera.map_err(|error| End::Refused(error.to_string()))?;
        let set_index = if self.is_moving { pose.moment } else { self.light_step };
        stream.ask(pose, camera, set_index, quality).map_err(|error| End::Refused(error.to_string()))
    }

    /// Passes a picture on, unless a later one was sent, or it is a still of an earlier pose.
    fn forward(
        &mut self,
        page: &mut Page,
        session: &Session,
        stream: &mut PictureStream,
        frame: EncodedFrame,
        asked: Option<Asked>,
    ) -> Result<(), End> {
        let cameras = self.cameras_of(&frame);
        let Some(asked) = asked.filter(|asked| self.is_wanted(asked, cameras.as_deref())) else {
            stream.discard(&frame);
            return Ok(());
        };
        let plan = session.plan().assignment;
        self.sent = asked.pose.number;
        let (shown, last) = (self.light_step_of(&plan, &frame), self.scene.shown.light_steps - 1);
        let is_own_cell = !frame.header.is_neighbour_cell;
        let is_near = !asked.pose.still || is_near(&plan, &frame);
        let is_direct = plan.policy == Policy::Direct && plan.plan_epoch == frame.header.sample_set_id.plan_epoch;
        let about = About { light_step: shown + 1, is_own_cell: is_own_cell && is_near, is_direct, rtt_s: page.rtt_s };
        let message = stream.message(&frame, &asked, about);
        if asked.pose.still {
            page.send_still(message)?
        } else {
            page.send_moving(message)?
        }
        if asked.pose.still && plan.policy != Policy::Direct && !self.is_moving {
            // Another cell's light begins anew.
            self.light_step = if is_own_cell { self.light_step.max(shown) } else { 0 };
        }
        if asked.pose.number != self.newest_number() {
            return Ok(());
        }
        let samples = frame.header.antialias;
        let is_finished = is_own_cell && (shown == last && samples >= self.most_samples || !asked.pose.still);
        let is_of_plan = cameras.is_some() && cameras == cell_cameras(&plan, &frame.request.camera);
        (self.made_with, self.is_finished) = (cameras, is_finished);
        if is_finished && (is_of_plan || !asked.pose.still) {
            return Ok(());
        }
        // A visitor that rests would see a neighbouring cell's picture, an earlier plan's, unfinished light or few samples a
        // pixel for ever.
        let next_set = match (self.is_moving, is_own_cell) {
            (true, _) => frame.request.set_index,
            (false, true) => (shown + 1).min(last),
            (false, false) => self.light_step,
        };
        let antialias = if is_own_cell && shown == last && asked.pose.still {
            more(samples).min(self.most_samples)
        } else {
            Antialias::NONE
        };
        let quality = PictureQuality { codec: frame.header.codec, antialias };
        let again = stream.ask(asked.pose, frame.request.camera, next_set, quality);
        again.map_err(|error| End::Refused(error.to_string()))
    }

    fn newest_number(&self) -> u64 {
        self.newest.map_or(0, |newest| newest.number)
    }

    /// Whether a picture that was made with these cameras is to be sent.
    fn is_wanted(&self, asked: &Asked, cameras: Option<&[SampleCamera]>) -> bool {
        let number = asked.pose.number;
        if !asked.pose.still {
            return number >= self.sent;
        }
        // A plan that came while the finished still was made has asked for it again, from the first step of light.
        let is_finished = number == self.sent && self.is_finished;
        let is_again = is_finished && cameras.is_some() && cameras == self.made_with.as_deref();
        number == self.newest_number() && !is_again
    }

    /// The epoch of the last plan that the page was told of.
    fn plan_epoch(&self) -> u64 {
        self.plans.front().map_or(0, |plan| plan.plan_epoch)
    }

    /// The sample cameras of a picture, by the plan that it was made under.
    fn cameras_of(&self, frame: &EncodedFrame) -> Option<Vec<SampleCamera>> {
        let plan_epoch = frame.header.sample_set_id.plan_epoch;
        let workload = &self.plans.iter().find(|plan| plan.plan_epoch == plan_epoch)?.workload;
        Some(workload.sample_cameras[workload.cameras_of_cell(frame.header.cell as usize)?].to_vec())
    }

    /// A new plan may have a view cell that is nearer to a visitor who rests: the still is then asked for again.
    fn renew_still(
        &mut self,
        plan: &SessionPlan,
        motion: &mut PictureStream,
        still: &mut PictureStream,
    ) -> Result<(), End> {
        let Some(pose) = self.newest.filter(|pose| pose.still && pose.number == self.sent) else { return Ok(()) };
        let camera = self.scene.space.camera(&pose.camera, UVec2::from_array(pose.canvas_px));
        let camera = camera.map_err(|error| End::Refused(error.to_string()))?;
        // What is on its way goes on under the new plan.
        if cell_cameras(&plan.assignment, &camera) == self.made_with {
            return Ok(());
        }
        if self.is_finished {
            self.light_step = 0;
        }
        self.ask(pose, motion, still)
    }

    /// The step of a picture's light, from 0. Views that are drawn directly show the last, and so do scenes that move.
    fn light_step_of(&self, plan: &Assignment, frame: &EncodedFrame) -> u32 {
        let last = self.scene.shown.light_steps - 1;
        match plan.policy {
            _ if self.is_moving => last,
            Policy::Direct => last,
            Policy::Pipeline | Policy::TimeShare => frame.request.set_index.min(last),
        }
    }

    fn tell_plan(&mut self, page: &Page, plan: &SessionPlan) -> Result<(), End> {
        if self.plan_epoch() != plan.assignment.plan_epoch {
            self.plans.push_front(plan.assignment.clone());
            self.plans.truncate(PLANS);
        }
        let (policy, reason) = (plan.assignment.policy.to_string(), plan.reason.clone());
        let promise = self.promise.as_ref().map(ToString::to_string);
        page.tell(&ToPage::Plan { epoch: self.plan_epoch(), policy, reason, promise })
    }

    /// Learns from a picture on the screen.
    fn shown(&mut self, page: &Page, number: u64, age_ms: f64, motion: &PictureStream) {
        let (Some(height_px), Some(rtt_s)) = (motion.height_of(number), page.rtt_s) else { return };
        if (0.0..=MAX_AGE_MS).contains(&age_ms) {
            let now_s = page.heard.duration_since(page.started).as_secs_f64();
            self.rate.step(now_s, Shown { age_s: age_ms / 1000.0, rtt_s, height_px });
        }
    }
}

/// The samples a pixel of the still after one with so many. Each step costs more than all before it, and positions of one
/// view share their work, which views of one position each would not.
fn more(samples: Antialias) -> Antialias {
    Antialias::of(4 * samples.samples()).unwrap_or(Antialias::MOST)
}

fn fewer(samples: Antialias) -> Antialias {
    Antialias::of(samples.samples() / 4).unwrap_or(Antialias::NONE)
}

/// Whether a plan has a view cell near a frame's camera. Where it has none, the next plan will.
fn is_near(plan: &Assignment, frame: &EncodedFrame) -> bool {
    plan.policy == Policy::Direct || plan.workload.has_cell_near(&frame.request.camera)
}

/// The sample cameras of the cell that a plan has for a view.
fn cell_cameras(plan: &Assignment, camera: &PinholeCamera) -> Option<Vec<SampleCamera>> {
    let cameras = plan.workload.cameras_of_cell(plan.workload.cell_of(camera) as usize)?;
    Some(plan.workload.sample_cameras[cameras].to_vec())
}
