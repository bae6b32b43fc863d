//! The connection to a browser: commands of the DevTools protocol, their answers, and the events of the page.

use std::collections::HashMap;
use std::time::Duration;

use futures_util::{SinkExt as _, StreamExt as _};
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::time::{sleep, timeout};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async_with_config};

use crate::error::BrowserError;
use crate::record::PageRecord;

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// The time within which a browser answers, even on a busy machine.
const ANSWERS_WITHIN: Duration = Duration::from_secs(60);
/// Commands that wait for the socket.
const COMMANDS_IN_FLIGHT: usize = 16;
/// The pause between two looks for the first page.
const POLL: Duration = Duration::from_millis(5);

/// A connection to the one page of a browser. Commands of several tasks may be in flight at once.
///
/// A task owns the socket. It ends when the connection is dropped or lost, and then every command that waits is told so.
#[derive(Debug)]
pub(crate) struct Connection {
    commands: mpsc::Sender<Command>,
    record: watch::Receiver<PageRecord>,
    /// The session of the page; absent while there is none, when commands are for the browser.
    session: Option<String>,
}

#[derive(Debug)]
struct Command {
    /// The command without its number.
    message: Value,
    answer: oneshot::Sender<Value>,
}

impl Connection {
    /// Connects to the first page of the browser at an address.
    ///
    /// # Errors
    /// The browser does not answer.
    pub(crate) async fn open(address: &str) -> Result<Self, BrowserError> {
        let socket = connect_async_with_config(address, None, true).await;
        let (socket, _) = socket.map_err(|error| BrowserError::refused(address, &error.to_string()))?;
        let (commands, received) = mpsc::channel(COMMANDS_IN_FLIGHT);
        let (sender, record) = watch::channel(PageRecord::default());
        tokio::spawn(serve(socket, received, sender));
        let mut connection = Self { commands, record, session: None };
        let session = timeout(ANSWERS_WITHIN, connection.attach()).await;
        let session = session.map_err(|_| BrowserError::no_answer("the first page", ANSWERS_WITHIN))??;
        connection.session = Some(session);
        for domain in ["Inspector", "Log", "Page", "Runtime"] {
            connection.call(&format!("{domain}.enable"), json!({})).await?;
        }
        connection.call("Page.setLifecycleEventsEnabled", json!({ "enabled": true })).await?;
        Ok(connection)
    }

    /// Waits for the first page, and opens a session with it.
    async fn attach(&self) -> Result<String, BrowserError> {
        const METHOD: &str = "Target.attachToTarget";
        let target = loop {
            let targets = self.call("Target.getTargets", json!({})).await?;
            let mut targets = targets["targetInfos"].as_array().into_iter().flatten();
            if let Some(page) = targets.find(|target| target["type"] == "page") {
                break page["targetId"].clone();
            }
            sleep(POLL).await;
        };
        let answer = self.call(METHOD, json!({ "targetId": target, "flatten": true })).await?;
        let session = answer["sessionId"].as_str().map(str::to_owned);
        session.ok_or_else(|| BrowserError::answer(METHOD, answer, "no session"))
    }

    /// Calls a method of the DevTools protocol; returns its result.
    ///
    /// # Errors
    /// The browser refuses it, does not answer in time, or ends.
    pub(crate) async fn call(&self, method: &str, parameters: Value) -> Result<Value, BrowserError> {
        let mut message = json!({ "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = session.as_str().into();
        }
        let (sender, answer) = oneshot::channel();
        let command = Command { message, answer: sender };
        self.commands.send(command).await.map_err(|_| BrowserError::ended(method))?;
        let answer = timeout(ANSWERS_WITHIN, answer).await;
        let answer = answer.map_err(|_| BrowserError::no_answer(method, ANSWERS_WITHIN))?;
        let mut answer = answer.map_err(|_| BrowserError::ended(method))?;
        match answer["error"]["message"].as_str() {
            Some(reason) => Err(BrowserError::refused(method, reason)),
            None => Ok(answer["result"].take()),
        }
    }

    /// Waits until the document of a navigation is loaded, or one that has taken its place meanwhile.
    ///
    /// # Errors
    /// It takes too long, or the browser ends.
    pub(crate) async fn wait_for_load(&self, url: &str, loader: &str) -> Result<(), BrowserError> {
        let mut record = self.record.clone();
        let loaded = timeout(ANSWERS_WITHIN, record.wait_for(|record| record.is_loaded(loader))).await;
        let loaded = loaded.map_err(|_| BrowserError::no_answer(url, ANSWERS_WITHIN))?;
        loaded.map(drop).map_err(|_| BrowserError::ended(url))
    }

    /// What the page has reported so far.
    pub(crate) fn record(&self) -> watch::Ref<'_, PageRecord> {
        self.record.borrow()
    }
}

/// Sends commands, passes on their answers, and records events, until the connection is dropped or lost or the page ends.
async fn serve(mut socket: Socket, mut commands: mpsc::Receiver<Command>, record: watch::Sender<PageRecord>) {
    let mut answers: HashMap<u64, oneshot::Sender<Value>> = HashMap::new();
    let mut last_number = 0;
    loop {
        tokio::select! {
            command = commands.recv() => {
                let Some(Command { mut message, answer }) = command else { return };
                last_number += 1;
                message["id"] = last_number.into();
                answers.insert(last_number, answer);
                if socket.send(Message::text(message.to_string())).await.is_err() {
                    return;
                }
            }
            message = next_message(&mut socket) => {
                let Some(message) = message else { return };
                let number = message["id"].as_u64();
                match number.and_then(|number| answers.remove(&number)) {
                    Some(answer) => drop(answer.send(message)),
                    None if is_end_of_page(&message) => return,
                    None => record.send_modify(|record| record.read(&message)),
                }
            }
        }
    }
}

/// The next message, unless the connection is lost.
async fn next_message(socket: &mut Socket) -> Option<Value> {
    loop {
        match socket.next().await?.ok()? {
            Message::Text(text) => return serde_json::from_str(&text).ok(),
            Message::Close(_) => return None,
            _ => {}
        }
    }
}

fn is_end_of_page(event: &Value) -> bool {
    matches!(event["method"].as_str(), Some("Inspector.targetCrashed" | "Target.detachedFromTarget"))
}
