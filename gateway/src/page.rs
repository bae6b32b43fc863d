//! A page at the other end of a WebSocket: messages within limits, in both directions.

use std::time::{Duration, Instant};

use axum::body::Bytes;
use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt as _, StreamExt as _};
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use crate::gateway::Gateway;
use crate::parts::Parts;
use crate::protocol::{self, FromPage, ToPage, Waiting};

/// The first message is due by then.
const OPENED_WITHIN: Duration = Duration::from_secs(10);
/// The time that the last messages may take.
const FAREWELL: Duration = Duration::from_secs(5);
/// The interval of pings, which measure the round trip and show that a page is there.
const PING: Duration = Duration::from_secs(2);
/// A page that answers no ping for so long has gone.
const SILENCE: Duration = Duration::from_secs(20);
/// Messages of a page a second, in the long run.
const MAX_MESSAGES_PER_S: f64 = 240.0;
/// Messages that a page may send at once: those of some seconds, as after a stall of the link.
const MAX_BURST: f64 = 4.0 * MAX_MESSAGES_PER_S;
/// Messages on their way to the page. Pictures among them are bounded by their credits, and parts of stills by the link.
const OUTGOING: usize = 96;
/// The delay before a view that has failed is begun anew.
pub(crate) const AFTER_FAILURE: Duration = Duration::from_millis(250);

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
    /// Messages that may follow at once.
    allowance: f64,
    /// The last message came.
    pub(crate) heard: Instant,
    pub(crate) started: Instant,
    /// The least round trip so far.
    pub(crate) rtt_s: Option<f64>,
    /// Its parts end with the next pose.
    pub(crate) stills: Parts,
    pings: tokio::time::Interval,
}

/// Serves a page with `serve` until it leaves.
pub(crate) async fn with_page(
    socket: WebSocket,
    gateway: &Gateway,
    serve: impl AsyncFnOnce(&mut Page) -> Result<(), End>,
) {
    let (sink, incoming) = socket.split();
    let (outgoing, to_send) = mpsc::channel(OUTGOING);
    let now = Instant::now();
    let mut page = Page {
        incoming,
        outgoing,
        allowance: MAX_BURST,
        heard: now,
        started: now,
        rtt_s: None,
        stills: Parts::default(),
        pings: tokio::time::interval(PING),
    };
    let mut writer = JoinSet::new();
    writer.spawn(write(sink, to_send));
    let end = tokio::select! {
        Err(end) = serve(&mut page) => end,
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

impl Page {
    /// The next message of the protocol, within its limits. Cancellation loses none.
    pub(crate) async fn next(&mut self) -> Result<FromPage, End> {
        loop {
            let message = tokio::select! {
                message = self.incoming.next() => message.and_then(Result::ok).ok_or(End::Gone)?,
                _ = self.pings.tick() => {
                    if self.heard.elapsed() > SILENCE {
                        return Err(End::Gone);
                    }
                    let now_s = self.started.elapsed().as_secs_f64();
                    self.send(Message::Ping(Bytes::copy_from_slice(&now_s.to_le_bytes())))?;
                    self.tell(&ToPage::Alive)?;
                    continue;
                }
            };
            self.count(Instant::now())?;
            match message {
                Message::Text(text) => {
                    let message = serde_json::from_str(&text);
                    match message.map_err(|error| End::Refused(format!("message: {error}")))? {
                        FromPage::Received {} => self.go_on()?,
                        message => return Ok(message),
                    }
                }
                Message::Binary(_) => return Err(End::Refused("message: binary, must be JSON text".to_owned())),
                Message::Pong(sent) => self.learn_round_trip(&sent),
                Message::Ping(_) => (),
                Message::Close(_) => return Err(End::Gone),
            }
        }
    }

    /// Sends further parts of a still.
    fn go_on(&mut self) -> Result<(), End> {
        // Until the round trip is known, the link is taken for a fast one.
        if !self.stills.received(self.heard, self.rtt_s.unwrap_or(0.0)) {
            return Err(End::Refused("type: received, but no part is on its way".to_owned()));
        }
        // Answers to parts are as many as the parts.
        self.allowance += 1.0;
        while let Some(part) = self.stills.next(self.heard) {
            self.send(Message::Binary(protocol::continued(&part)))?;
        }
        Ok(())
    }

    /// Sends a picture, which ends a still that is on its way. A still is sent in parts, until a pose ends it.
    pub(crate) fn send_picture(&mut self, mut message: Bytes, is_still: bool) -> Result<(), End> {
        self.stills.end();
        if is_still {
            message = self.stills.begin(message, Instant::now());
        }
        self.send(Message::Binary(message))
    }

    fn count(&mut self, now: Instant) -> Result<(), End> {
        let earned = MAX_MESSAGES_PER_S * now.duration_since(self.heard).as_secs_f64();
        self.allowance = (self.allowance + earned).min(MAX_BURST) - 1.0;
        self.heard = now;
        if self.allowance < 0.0 {
            return Err(End::Refused(format!("messages: more than {MAX_MESSAGES_PER_S} a second")));
        }
        Ok(())
    }

    fn learn_round_trip(&mut self, sent: &[u8]) {
        let Ok(sent) = sent.try_into().map(f64::from_le_bytes) else { return };
        let rtt_s = self.heard.duration_since(self.started).as_secs_f64() - sent;
        // A page may answer what was never asked.
        if (0.0..SILENCE.as_secs_f64()).contains(&rtt_s) {
            self.rtt_s = Some(self.rtt_s.map_or(rtt_s, |least| least.min(rtt_s)));
        }
    }

    /// The scene that the first message names.
    pub(crate) async fn opened(&mut self) -> Result<Option<String>, End> {
        match tokio::time::timeout(OPENED_WITHIN, self.next()).await {
            Ok(Ok(FromPage::Open { scene })) => Ok(scene),
            Ok(Ok(_)) => Err(End::Refused("type: the first message must be open".to_owned())),
            Ok(Err(end)) => Err(end),
            Err(_) => Err(End::Refused("no message was received".to_owned())),
        }
    }

    /// Awaits something else, and drops the messages of that time.
    pub(crate) async fn until<T>(&mut self, other: impl Future<Output = T>) -> Result<T, End> {
        tokio::pin!(other);
        loop {
            tokio::select! {
                output = &mut other => return Ok(output),
                message = self.next() => drop(message?),
            }
        }
    }

    /// Sends a message.
    pub(crate) fn tell(&self, message: &ToPage) -> Result<(), End> {
        self.send(Message::Text(protocol::text(message).into()))
    }

    /// Says why there are no pictures.
    pub(crate) fn wait(&self, stage: &'static str, detail: &str) -> Result<(), End> {
        self.tell(&ToPage::Waiting(Waiting { stage, detail: detail.to_owned() }))
    }

    /// A page that reads nothing has no room after a while.
    fn send(&self, message: Message) -> Result<(), End> {
        self.outgoing.try_send(message).map_err(|_| End::Gone)
    }
}
