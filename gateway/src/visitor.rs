//! One visitor: poses come over a WebSocket, and pictures go back.
//!
//! A visitor has two live streams, so that a still never holds up motion. A picture's credit is given back when the page has
//! it on its screen: at most two of each stream are on their way. A picture is never older than one that was sent, and a still
//! is always of the newest pose.

use std::collections::VecDeque;
use std::sync::Arc;

use axum::http::StatusCode;
use client::{ClientError, ClientId, EncodedFrame, PictureQuality, Session};
use cluster::{Assignment, DIRECT, Policy, Promise, SessionPlan};
use codec::FrameCodec;
use depth_image::{Antialias, LightCacheQuality, PinholeCamera, SampleCamera};
use glam::UVec2;
use tokio::sync::watch;

use crate::camera::still_size;
use crate::gateway::Gateway;
use crate::kept_session::{KeptSession, SessionState};
use crate::page::{AFTER_FAILURE, End, Page};
use crate::picture_stream::{About, Asked, PictureStream, Wanted};
use crate::protocol::{FromPage, Pose, ToPage};
use crate::rate::{Rate, Shown};
use crate::responses::Refusal;
use crate::scenes::SceneSessions;
use crate::still::{PictureLight, PlannedLight, Still, Stills, fewer};
use crate::visits::Visit;

/// The longest age that says something of the link: a page may have been hidden.
const MAX_AGE_MS: f64 = 10_000.0;
/// Plans that are remembered.
const PLANS: usize = 2;

/// Serves a page until it leaves.
pub(crate) async fn serve(page: &mut Page, gateway: &Gateway) -> Result<(), End> {
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
        quality: scene.quality.name(),
        moments: scene.timeline().set_count,
        moment_step_s: scene.timeline().step_s,
        max_still_px: gateway.config.max_still_px.to_array(),
        bounds: [scene.offer.volume.min, scene.offer.volume.max].map(|corner| scene.space.in_source(corner)),
    })?;
    let mut visitor = Visitor {
        gateway,
        visit: scene.session_of(0).visits.begin(),
        is_moving: false,
        light_step: 0,
        made_with: None,
        is_finished: false,
        is_drawn: false,
        stills: Stills {
            quality: scene.quality,
            most_samples: Antialias::MOST,
            may_draw: true,
            light_steps: scene.shown.light_steps,
        },
        scene,
        newest: None,
        sent: 0,
        plans: VecDeque::new(),
        planned: None,
        fallback: None,
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
    page.until(gateway.visitors.acquire()).await?.map_err(|_| End::Gone)
}

/// The scene that a page asks for, once the coordinator answers.
async fn found(page: &mut Page, gateway: &Gateway, name: Option<&str>) -> Result<Arc<SceneSessions>, End> {
    loop {
        match page.until(gateway.scenes.visit(name)).await? {
            Ok(scene) => return Ok(scene),
            Err(Refusal(StatusCode::NOT_FOUND, reason)) => return Err(End::Refused(reason)),
            Err(Refusal(_, reason)) => page.wait("connecting", &reason)?,
        }
        page.until(tokio::time::sleep(AFTER_FAILURE)).await?;
    }
}

struct Visitor<'a> {
    gateway: &'a Gateway,
    visit: Visit,
    scene: Arc<SceneSessions>,
    /// Whether the scene moves for the visitor.
    is_moving: bool,
    /// The latest step of light that a still has shown: from 0.
    light_step: u32,
    /// The sample cameras of the last picture; `None` before one, or where its plan is long over.
    made_with: Option<Vec<SampleCamera>>,
    /// Whether no better picture follows the last under its plan.
    is_finished: bool,
    /// Whether the last picture was drawn from the scene.
    is_drawn: bool,
    stills: Stills,
    newest: Option<(Pose, PinholeCamera)>,
    /// The number of the last picture.
    sent: u64,
    /// The last plans that the page was told of, the newest first: pictures may still come under the one before.
    plans: VecDeque<Assignment>,
    /// The light of the last plan's views.
    planned: Option<PlannedLight>,
    /// The quality of shared light that an overload leaves in motion.
    fallback: Option<LightCacheQuality>,
    /// The last promise that it was told of.
    promise: Option<Promise>,
    rate: Rate,
}

impl Visitor<'_> {
    /// Serves from one session after the other.
    async fn follow(&mut self, page: &mut Page) -> Result<(), End> {
        let scene = self.scene.clone();
        loop {
            let kept = self.kept(&scene);
            let mut states = kept.state.clone();
            while self.is_at(kept) {
                let state = states.borrow_and_update().clone();
                let session = match state {
                    Ok(session) => session,
                    Err(waiting) => {
                        page.tell(&ToPage::Waiting(waiting))?;
                        if let Some(Err(_)) = self.hear_until(states.changed(), page, kept).await? {
                            return Err(End::Gone);
                        }
                        continue;
                    }
                };
                let Some(error) = self.serve_from(page, kept, &session, &mut states).await? else { continue };
                page.wait("reconnecting", &error.to_string())?;
                kept.has_failed(session, &error);
                self.hear_until(tokio::time::sleep(AFTER_FAILURE), page, kept).await?;
            }
            self.visit = self.kept(&scene).visits.begin();
            self.visit.moved(page.heard);
        }
    }

    /// The session of the visitor's moment.
    fn kept<'s>(&self, scene: &'s SceneSessions) -> &'s KeptSession {
        scene.session_of(u32::from(self.is_moving))
    }

    /// Whether a session is that of the visitor's moment.
    fn is_at(&self, kept: &KeptSession) -> bool {
        std::ptr::eq(self.kept(&self.scene), kept)
    }

    /// Takes poses while something else is awaited; `None` when they need another session.
    async fn hear_until<T>(
        &mut self,
        other: impl Future<Output = T>,
        page: &mut Page,
        kept: &KeptSession,
    ) -> Result<Option<T>, End> {
        tokio::pin!(other);
        while self.is_at(kept) {
            tokio::select! {
                output = &mut other => return Ok(Some(output)),
                message = page.next() => self.hear(page, message?)?,
            }
        }
        Ok(None)
    }

    /// Serves from a session until it fails; `None` when the visitor needs another one, or there is another.
    async fn serve_from(
        &mut self,
        page: &mut Page,
        kept: &KeptSession,
        session: &Session,
        states: &mut watch::Receiver<SessionState>,
    ) -> Result<Option<ClientError>, End> {
        // Nothing of this session has been sent yet.
        self.plans.clear();
        self.is_finished = false;
        self.is_drawn = false;
        self.promise = session.promise();
        self.tell_plan(page, &session.plan())?;
        let client = ClientId::new();
        let mut motion = PictureStream::new(session, client);
        let mut still = PictureStream::new(session, client);
        self.ask(Antialias::NONE, &mut motion, &mut still)?;
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
                        self.ask(Antialias::NONE, &mut motion, &mut still)?;
                    }
                },
                changed = states.changed() => return changed.map(|()| None).map_err(|_| End::Gone),
                plan = session.another_plan(self.plan_epoch()) => {
                    self.tell_plan(page, &plan)?;
                    if self.is_outdated(&plan.assignment) {
                        self.ask(Antialias::NONE, &mut motion, &mut still)?;
                    }
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
                    Err(ClientError::Exhausted { .. }) if still.draws() || self.stills.most_samples > Antialias::NONE => {
                        let samples = self.with_less(&still);
                        still = PictureStream::new(session, client);
                        self.ask(samples, &mut motion, &mut still)?;
                    }
                    Err(error) => return Ok(Some(error)),
                },
            }
        }
    }

    /// The cluster has refused the last still: gives the samples a pixel to go on with.
    fn with_less(&mut self, still: &PictureStream) -> Antialias {
        if still.draws() {
            self.stills.may_draw = false;
            return self.stills.most_samples;
        }
        self.stills.most_samples = fewer(self.stills.most_samples);
        Antialias::NONE
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
                let camera = self.scene.space.camera(&pose.camera, canvas_px).map_err(End::Refused)?;
                self.rate.fit(canvas_px);
                self.newest = Some((pose, camera));
                self.stills.quality = pose.quality.unwrap_or(self.scene.quality);
                self.limit_rate();
                page.stills.end();
                // A scene that moves passes its first moment, too.
                self.is_moving = pose.moment > 0 || self.is_moving && !pose.still;
                self.visit.moved(page.heard);
                Ok(())
            }
        }
    }

    /// Asks for the picture of the newest pose. The first still has one sample a pixel, so that it comes soon: more samples
    /// follow once its light is finished.
    fn ask(&self, still_samples: Antialias, motion: &mut PictureStream, still: &mut PictureStream) -> Result<(), End> {
        let Some((pose, camera)) = self.newest else { return Ok(()) };
        let canvas_px = UVec2::from_array(pose.canvas_px);
        let chosen = self.rate.chosen();
        let (stream, size_px, codec) = if pose.still {
            (still, still_size(canvas_px, self.gateway.config.max_still_px), FrameCodec::Png)
        } else {
            (motion, chosen.size_px(canvas_px), FrameCodec::Jpeg { quality: chosen.jpeg_quality() })
        };
        let samples = if pose.still { still_samples } else { Antialias::NONE };
        let light = match self.planned {
            Some(planned) if pose.still => self.stills.light(planned, samples),
            Some(planned) if planned.is_shared => PictureLight::Shared(chosen.light()),
            _ => PictureLight::Session,
        };
        let set_index = if self.is_moving { pose.moment } else { self.light_step };
        self.ask_for(pose, camera.resized(size_px), codec, Wanted { set_index, samples, light }, stream)
    }

    fn ask_for(
        &self,
        pose: Pose,
        camera: PinholeCamera,
        codec: FrameCodec,
        wanted: Wanted,
        stream: &mut PictureStream,
    ) -> Result<(), End> {
        let method = match wanted.light {
            PictureLight::Session => None,
            PictureLight::Shared(quality) => Some((self.gateway.config.methods.of_quality)(quality)),
            PictureLight::Drawn => Some(DIRECT.to_owned()),
        };
        let quality = PictureQuality { codec, antialias: wanted.samples, method, waits_for_set: pose.still };
        let chosen = (!pose.still).then(|| self.rate.chosen());
        stream.ask(pose, camera, quality, wanted, chosen).map_err(|error| End::Refused(error.to_string()))
    }

    /// Passes a picture on, unless a later one was sent, or it is a still of an earlier pose. What follows it is asked for.
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
        let pose = asked.pose;
        let plan = session.plan().assignment;
        self.sent = pose.number;
        let is_drawn = asked.light == PictureLight::Drawn;
        let is_planned_direct =
            plan.policy == Policy::Direct && plan.plan_epoch == frame.header.sample_set_id.plan_epoch;
        let is_own_cell = is_drawn || !frame.header.is_neighbour_cell;
        // Where the plan has no view cell near the frame's camera, the next plan will.
        let is_near = is_drawn
            || !pose.still
            || plan.policy == Policy::Direct
            || plan.workload.has_cell_near(&frame.request.camera);
        // Views that are drawn directly show the last step of light, and so do scenes that move.
        let last = self.stills.light_steps - 1;
        let is_last = self.is_moving || plan.policy == Policy::Direct;
        let shown = if is_last { last } else { frame.request.set_index.min(last) };
        if pose.still && plan.policy != Policy::Direct && !self.is_moving {
            // Another cell's light begins anew.
            self.light_step = if is_own_cell { self.light_step.max(shown) } else { 0 };
        }
        let own_cell = plan.workload.cell_of(&frame.request.camera);
        let is_of_plan = is_drawn || cameras.is_some() && cameras == cell_cameras(&plan, own_cell);
        let is_newest = pose.number == self.newest_number();
        let next = self.next(&asked, &frame, shown, is_own_cell);
        // A visitor that rests would see a neighbouring cell's picture, an earlier plan's, unfinished light or few samples a
        // pixel for ever.
        let again = Wanted { set_index: frame.request.set_index, samples: frame.header.antialias, light: asked.light };
        let follows = next.or_else(|| (pose.still && !is_of_plan).then_some(again)).filter(|_| is_newest);
        let about = About {
            light_step: shown + 1,
            is_own_cell: is_own_cell && is_near,
            is_direct: is_drawn || is_planned_direct,
            more: follows.is_some(),
            rtt_s: page.rtt_s,
        };
        let message = stream.message(&frame, &asked, about);
        page.send_picture(message, pose.still)?;
        if is_newest {
            (self.made_with, self.is_finished) = (cameras, next.is_none());
            self.is_drawn = is_drawn;
        }
        match follows {
            Some(next) => self.ask_for(pose, frame.request.camera, frame.header.codec, next, stream),
            None => Ok(()),
        }
    }

    /// The picture of the same pose that follows one, under the same plan; `None` after the last.
    fn next(&self, asked: &Asked, frame: &EncodedFrame, shown: u32, is_own_cell: bool) -> Option<Wanted> {
        let last = self.stills.light_steps - 1;
        let samples = Antialias::NONE;
        if !is_own_cell {
            let set_index = if self.is_moving { frame.request.set_index } else { self.light_step };
            return Some(Wanted { set_index, samples, light: asked.light });
        }
        if !asked.pose.still {
            return None;
        }
        if shown < last && asked.light != PictureLight::Drawn {
            return Some(Wanted { set_index: shown + 1, samples, light: asked.light });
        }
        let still = Still {
            samples: frame.header.antialias,
            light: asked.light,
            pixel_count: frame.request.camera.pixel_count(),
            made_s: frame.header.stage_times.batch_s,
        };
        let (samples, light) = self.stills.after(self.planned?, still)?;
        let set_index = if self.is_moving { frame.request.set_index } else { last };
        Some(Wanted { set_index, samples, light })
    }

    fn newest_number(&self) -> u64 {
        self.newest.map_or(0, |(pose, _)| pose.number)
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
        cell_cameras(self.plans.iter().find(|plan| plan.plan_epoch == plan_epoch)?, frame.header.cell)
    }

    /// Whether a new plan has a view cell that is nearer to a visitor who rests: the still is then asked for again.
    fn is_outdated(&mut self, plan: &Assignment) -> bool {
        let shown = self.newest.filter(|(pose, _)| pose.still && pose.number == self.sent);
        let Some((_, camera)) = shown else { return false };
        // What is on its way goes on under the new plan, and what was drawn from the scene is the same under any.
        let is_renewed = !self.is_drawn && cell_cameras(plan, plan.workload.cell_of(&camera)) != self.made_with;
        if is_renewed && self.is_finished {
            self.light_step = 0;
        }
        is_renewed
    }

    fn tell_plan(&mut self, page: &Page, plan: &SessionPlan) -> Result<(), End> {
        if self.plan_epoch() != plan.assignment.plan_epoch {
            self.plans.push_front(plan.assignment.clone());
            self.plans.truncate(PLANS);
        }
        let planned = PlannedLight::from(plan);
        self.planned = Some(planned);
        self.fallback = plan.fallback.and_then(|_| (self.gateway.config.methods.quality_of)(&plan.method));
        self.limit_rate();
        page.tell(&ToPage::Plan {
            epoch: self.plan_epoch(),
            policy: plan.assignment.policy.to_string(),
            reason: plan.reason.clone(),
            shares_light: planned.is_shared,
            promise: self.promise.as_ref().map(ToString::to_string),
        })
    }

    /// Bounds the light of pictures in motion by what the visitor wants, and by the fallback of all.
    fn limit_rate(&mut self) {
        let wanted = self.stills.quality;
        let best = self.fallback.map_or(wanted, |fallback| fallback.min(wanted));
        self.rate.limit(self.planned.filter(|planned| planned.is_shared).map(|_| best));
    }

    /// Learns from a picture on the screen.
    fn shown(&mut self, page: &Page, number: u64, age_ms: f64, motion: &PictureStream) {
        let (Some(chosen), Some(rtt_s)) = (motion.chosen_for(number), page.rtt_s) else { return };
        if (0.0..=MAX_AGE_MS).contains(&age_ms) {
            let now_s = page.heard.duration_since(page.started).as_secs_f64();
            self.rate.step(now_s, Shown { age_s: age_ms / 1000.0, rtt_s, chosen });
        }
    }
}

/// The sample cameras of a plan's view cell.
fn cell_cameras(plan: &Assignment, cell: u32) -> Option<Vec<SampleCamera>> {
    Some(plan.workload.sample_cameras[plan.workload.cameras_of_cell(cell as usize)?].to_vec())
}
