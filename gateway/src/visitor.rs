//! One visitor: poses come over a WebSocket, and pictures go back.
//!
//! A visitor has two live streams, so that a still never holds up motion. A picture's credit is given back when the page has
//! it on its screen: at most two of each stream are on their way. A picture is never older than one that was sent, and a still
//! is always of the newest pose.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Bytes;
use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use client::{ClientError, EncodedFrame, Session};
use codec::FrameCodec;
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt as _, StreamExt as _};
use glam::UVec2;
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use crate::camera::still_size;
use crate::gateway::Gateway;
use crate::picture_stream::{Asked, PictureStream};
use crate::protocol::{self, FromPage, Pose, ToPage};
use crate::rate::{Rate, Shown};
use crate::scenes::{SceneSession, SessionState};

/// The first message is due by then.
const OPENED_WITHIN: Duration = Duration::from_secs(10);
/// The time that the last messages may take.
const FAREWELL: Duration = Duration::from_secs(5);
/// The interval of pings, which measure the round trip and show that a page is there.
const PING: Duration = Duration::from_secs(2);
/// A page that answers no ping for so long has gone.
const SILENCE: Duration = Duration::from_secs(20);
/// Messages of a page that are read in a second; further ones wait, as after a stall of the link.
const MAX_MESSAGES_S: u32 = 240;
/// Messages on their way to the page. Pictures among them are bounded by their credits.
const OUTGOING: usize = 32;
/// The delay before a view that has failed is begun anew.
const AFTER_FAILURE: Duration = Duration::from_millis(250);
/// The longest age that says something of the link: a page may have been hidden.
const MAX_AGE_MS: f64 = 10_000.0;

/// Why a visit ends.
pub(crate) enum End {
    /// The page has gone.
    Gone,
    /// The page breaks the protocol.
    Refused(String),
}

/// A connected page.
pub(crate) struct Page {
    incoming: SplitStream<WebSocket>,
    outgoing: mpsc::Sender<Message>,
    /// The second that messages are counted in, and their number.
    counted: (Instant, u32),
    heard: Instant,
    started: Instant,
    /// The least round trip so far.
    rtt_s: Option<f64>,
    pings: tokio::time::Interval,
}

/// Serves a page until it leaves.
pub(crate) async fn visit(socket: WebSocket, gateway: Arc<Gateway>) {
    let (sink, incoming) = socket.split();
    let (outgoing, to_send) = mpsc::channel(OUTGOING);
    let now = Instant::now();
    let mut page = Page {
        incoming,
        outgoing,
        counted: (now, 0),
        heard: now,
        started: now,
        rtt_s: None,
        pings: tokio::time::interval(PING),
    };
    let mut writer = JoinSet::new();
    writer.spawn(write(sink, to_send));
    let end = tokio::select! {
        Err(end) = serve(&mut page, &gateway) => end,
        _ = writer.join_next() => End::Gone,
        () = gateway.shutdown.cancelled() => End::Gone,
    };
    if let End::Refused(reason) = end {
        tracing::info!(reason, "a page is refused");
        let _ = page.tell(&ToPage::Refused { reason: reason.clone() });
        let reason = reason.chars().take(100).collect::<String>();
        let close = CloseFrame { code: close_code::POLICY, reason: reason.into() };
        let _ = page.outgoing.try_send(Message::Close(Some(close)));
    } else {
        let _ = page.outgoing.try_send(Message::Close(None));
    }
    drop(page);
    // What is on its way is sent, for as long as a page takes to read it.
    let _ = tokio::time::timeout(FAREWELL, writer.join_next()).await;
}

async fn write(mut sink: SplitSink<WebSocket, Message>, mut messages: mpsc::Receiver<Message>) {
    while let Some(message) = messages.recv().await {
        if sink.send(message).await.is_err() {
            return;
        }
    }
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
        bounds: [scene.offer.volume.min, scene.offer.volume.max].map(|corner| scene.space.in_source(corner)),
    })?;
    let mut visitor = Visitor {
        number: gateway.next_visitor(),
        scene,
        max_still_px: gateway.config.max_still_px,
        newest: None,
        sent: 0,
        plan_epoch: 0,
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
    let place = gateway.visitors.acquire();
    tokio::pin!(place);
    loop {
        tokio::select! {
            place = &mut place => return place.map_err(|_| End::Gone),
            message = page.next() => drop(message?),
        }
    }
}

/// The scene that a page asks for, once the coordinator answers.
async fn found(page: &mut Page, gateway: &Gateway, name: Option<&str>) -> Result<Arc<SceneSession>, End> {
    loop {
        match gateway.scenes.visit(name).await {
            Ok(scene) => return Ok(scene),
            Err(error @ crate::scenes::SceneError::Unknown { .. }) => return Err(End::Refused(error.to_string())),
            Err(error) => page.wait("connecting", &error.to_string())?,
        }
        page.pause(|_, _| Ok(())).await?;
    }
}

impl Page {
    /// The next message of the protocol, within its limits. Cancellation loses none.
    async fn next(&mut self) -> Result<FromPage, End> {
        loop {
            let (second, count) = self.counted;
            if count >= MAX_MESSAGES_S {
                tokio::time::sleep_until((second + Duration::from_secs(1)).into()).await;
            }
            let message = tokio::select! {
                message = self.incoming.next() => message.and_then(Result::ok).ok_or(End::Gone)?,
                _ = self.pings.tick() => {
                    if self.heard.elapsed() > SILENCE {
                        return Err(End::Gone);
                    }
                    self.ping()?;
                    continue;
                }
            };
            self.heard = Instant::now();
            self.count();
            match message {
                Message::Text(text) => {
                    return serde_json::from_str(&text).map_err(|error| End::Refused(format!("message: {error}")));
                }
                Message::Binary(_) => return Err(End::Refused("message: binary, must be JSON text".to_owned())),
                Message::Pong(sent) => self.learn_round_trip(&sent),
                Message::Ping(_) => (),
                Message::Close(_) => return Err(End::Gone),
            }
        }
    }

    fn count(&mut self) {
        let (second, count) = &mut self.counted;
        if self.heard.duration_since(*second) >= Duration::from_secs(1) {
            (*second, *count) = (self.heard, 0);
        }
        *count += 1;
    }

    fn learn_round_trip(&mut self, sent: &[u8]) {
        let Ok(sent) = sent.try_into().map(f64::from_le_bytes) else { return };
        let rtt_s = self.heard.duration_since(self.started).as_secs_f64() - sent;
        // A page may answer what was never asked.
        if (0.0..SILENCE.as_secs_f64()).contains(&rtt_s) {
            self.rtt_s = Some(self.rtt_s.map_or(rtt_s, |least| least.min(rtt_s)));
        }
    }

    fn ping(&self) -> Result<(), End> {
        let now_s = self.started.elapsed().as_secs_f64();
        self.send(Message::Ping(Bytes::copy_from_slice(&now_s.to_le_bytes())))
    }

    async fn opened(&mut self) -> Result<Option<String>, End> {
        match tokio::time::timeout(OPENED_WITHIN, self.next()).await {
            Ok(Ok(FromPage::Open { scene })) => Ok(scene),
            Ok(Ok(_)) => Err(End::Refused("type: the first message must be open".to_owned())),
            Ok(Err(end)) => Err(end),
            Err(_) => Err(End::Refused("no message was received".to_owned())),
        }
    }

    /// Lets a moment pass before another attempt; `hear` takes the messages of that time.
    async fn pause(&mut self, mut hear: impl FnMut(&Self, FromPage) -> Result<(), End>) -> Result<(), End> {
        let end = tokio::time::sleep(AFTER_FAILURE);
        tokio::pin!(end);
        loop {
            let message = tokio::select! {
                () = &mut end => return Ok(()),
                message = self.next() => message?,
            };
            hear(self, message)?;
        }
    }

    fn tell(&self, message: &ToPage) -> Result<(), End> {
        self.send(Message::Text(protocol::text(message).into()))
    }

    fn wait(&self, stage: &'static str, detail: &str) -> Result<(), End> {
        self.tell(&ToPage::Waiting { stage, detail: detail.to_owned() })
    }

    /// A page that reads nothing has no room after a while.
    fn send(&self, message: Message) -> Result<(), End> {
        self.outgoing.try_send(message).map_err(|_| End::Gone)
    }
}

struct Visitor {
    number: u64,
    scene: Arc<SceneSession>,
    max_still_px: UVec2,
    newest: Option<Pose>,
    /// The number of the last picture.
    sent: u64,
    /// The last plan that the page was told of.
    plan_epoch: u64,
    rate: Rate,
}

impl Drop for Visitor {
    fn drop(&mut self) {
        self.scene.visits.left(self.number);
    }
}

impl Visitor {
    /// Serves from one session after the other.
    async fn follow(&mut self, page: &mut Page) -> Result<(), End> {
        let mut states = self.scene.states();
        loop {
            let state = states.borrow_and_update().clone();
            let session = match state {
                SessionState::Open(session) => session,
                SessionState::Waiting { stage, detail } => {
                    page.wait(stage, &detail)?;
                    loop {
                        tokio::select! {
                            changed = states.changed() => break changed.map_err(|_| End::Gone)?,
                            message = page.next() => self.hear(page, message?)?,
                        }
                    }
                    continue;
                }
            };
            let error = self.serve_from(page, &session).await?;
            page.wait("reconnecting", &error.to_string())?;
            // A picture that has no room, or takes too long, is no fault of the session.
            if !matches!(error, ClientError::Exhausted { .. } | ClientError::Invalid { .. }) {
                self.scene.has_failed(session);
            }
            page.pause(|page, message| self.hear(page, message)).await?;
        }
    }

    /// Serves from a session, until it fails.
    async fn serve_from(&mut self, page: &mut Page, session: &Session) -> Result<ClientError, End> {
        self.tell_plan(page, session)?;
        let (mut motion, mut still) = (PictureStream::new(session), PictureStream::new(session));
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
                        if let Some(pose) = self.newest {
                            self.ask(pose, &mut motion, &mut still)?;
                        }
                    }
                },
                frame = motion.next() => match frame {
                    Ok((frame, asked)) => self.forward(page, session, &mut motion, frame, asked)?,
                    Err(error) => return Ok(error),
                },
                frame = still.next() => match frame {
                    Ok((frame, asked)) => self.forward(page, session, &mut still, frame, asked)?,
                    Err(error) => return Ok(error),
                },
            }
        }
    }

    /// Takes a pose.
    fn hear(&mut self, page: &Page, message: FromPage) -> Result<(), End> {
        match message {
            FromPage::Open { .. } => Err(End::Refused("type: open comes once".to_owned())),
            FromPage::Shown { .. } => Ok(()),
            FromPage::Pose(pose) => {
                let last = self.newest.map_or(0, |newest| newest.number);
                if pose.number <= last {
                    return Err(End::Refused(format!("number: {} comes after {last}", pose.number)));
                }
                let canvas_px = UVec2::from_array(pose.canvas_px);
                let checked = self.scene.space.camera(&pose.camera, canvas_px);
                checked.map_err(|error| End::Refused(error.to_string()))?;
                self.rate.fit(canvas_px);
                self.newest = Some(pose);
                self.scene.visits.moved(self.number, page.heard);
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
        let camera = self.scene.space.camera(&pose.camera, canvas_px).map(|camera| camera.resized(size_px));
        let camera = camera.map_err(|error| End::Refused(error.to_string()))?;
        stream.ask(pose, camera, codec).map_err(|error| End::Refused(error.to_string()))
    }

    /// Passes a picture on, unless a later one was sent, or it is a still of an earlier pose.
    fn forward(
        &mut self,
        page: &Page,
        session: &Session,
        stream: &mut PictureStream,
        frame: EncodedFrame,
        asked: Option<Asked>,
    ) -> Result<(), End> {
        let newest = self.newest.map_or(0, |newest| newest.number);
        let is_wanted = |asked: &Asked| {
            let number = asked.pose.number;
            if asked.pose.still { number == newest } else { number >= self.sent }
        };
        let Some(asked) = asked.filter(is_wanted) else {
            stream.discard(&frame);
            return Ok(());
        };
        if self.plan_epoch != frame.header.sample_set_id.plan_epoch {
            self.tell_plan(page, session)?;
        }
        self.sent = asked.pose.number;
        page.send(Message::Binary(stream.message(&frame, &asked)))?;
        // A visitor that rests would see a neighbouring cell's picture for ever.
        if frame.header.is_neighbour_cell && asked.pose.number == newest {
            let again = stream.ask(asked.pose, frame.request.camera, frame.header.codec);
            again.map_err(|error| End::Refused(error.to_string()))?;
        }
        Ok(())
    }

    fn tell_plan(&mut self, page: &Page, session: &Session) -> Result<(), End> {
        let plan = session.plan();
        self.plan_epoch = plan.assignment.plan_epoch;
        let (policy, reason) = (plan.assignment.policy.to_string(), plan.reason);
        page.tell(&ToPage::Plan { epoch: self.plan_epoch, policy, reason })
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
