//! One port for gRPC and for browsers. A connection that begins with the preface of HTTP/2 is served here; one that begins with
//! a request of HTTP/1 is handed on, where somebody takes it.

use std::io;
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::task::JoinSet;
use tokio_stream::wrappers::ReceiverStream;

/// The first bytes of a connection of HTTP/2.
const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
/// The first bytes of requests that browsers send.
const REQUESTS: [&[u8]; 2] = [b"GET /", b"HEAD /"];
/// The time that the first bytes may take. Keepalive covers connections only from then on.
const FIRST_BYTES_TIMEOUT: Duration = Duration::from_secs(5);
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Connections that may be silent at the same time: further ones wait in the system's queue.
const MAX_SILENT: usize = 1024;
/// The delay after a failure to accept: where the system has no more files, others must close theirs first.
const AFTER_ERROR: Duration = Duration::from_millis(100);

/// A port that is listened on.
#[derive(Debug)]
pub struct Port {
    /// The listener.
    pub listener: TcpListener,
    /// The taker of connections of HTTP/1; where there is none, or no room, they are cut.
    pub browsers: Option<mpsc::Sender<TcpStream>>,
}

impl From<TcpListener> for Port {
    fn from(listener: TcpListener) -> Self {
        Self { listener, browsers: None }
    }
}

/// The protocol of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Protocol {
    Http1,
    Http2,
}

impl Port {
    /// Connections of HTTP/2. Accepts until the stream is dropped.
    pub(crate) fn accept(self) -> ReceiverStream<io::Result<TcpStream>> {
        let (send, accepted) = mpsc::channel(16);
        tokio::spawn(async move {
            tokio::select! {
                () = self.sort(send.clone()) => (),
                () = send.closed() => (),
            }
        });
        ReceiverStream::new(accepted)
    }

    async fn sort(self, grpc: mpsc::Sender<io::Result<TcpStream>>) {
        let mut silent = JoinSet::new();
        loop {
            if silent.len() >= MAX_SILENT {
                silent.join_next().await;
            }
            while silent.try_join_next().is_some() {}
            match self.listener.accept().await {
                Ok((stream, _)) => drop(silent.spawn(admit(stream, grpc.clone(), self.browsers.clone()))),
                Err(error) => {
                    tracing::warn!(%error, "no connection can be accepted");
                    tokio::time::sleep(AFTER_ERROR).await;
                }
            }
        }
    }
}

async fn admit(
    stream: TcpStream,
    grpc: mpsc::Sender<io::Result<TcpStream>>,
    browsers: Option<mpsc::Sender<TcpStream>>,
) {
    let protocol = tokio::time::timeout(FIRST_BYTES_TIMEOUT, protocol_of(&stream)).await;
    let Ok(Ok(Some(protocol))) = protocol else { return };
    let _ = stream.set_nodelay(true);
    match (protocol, browsers) {
        (Protocol::Http2, _) => drop(grpc.send(Ok(stream)).await),
        // Browsers that nobody has time for do not hold up gRPC.
        (Protocol::Http1, Some(browsers)) => drop(browsers.try_send(stream)),
        (Protocol::Http1, None) => (),
    }
}

/// The protocol that a connection begins with, if it is known. The bytes stay unread.
async fn protocol_of(stream: &TcpStream) -> io::Result<Option<Protocol>> {
    let mut received = [0; PREFACE.len()];
    loop {
        let count = stream.peek(&mut received).await?;
        let received = &received[..count];
        if REQUESTS.iter().any(|request| received.starts_with(request)) {
            return Ok(Some(Protocol::Http1));
        }
        if count == 0 || !REQUESTS.iter().chain([&PREFACE]).any(|known| known.starts_with(received)) {
            return Ok(None);
        }
        if count == PREFACE.len() {
            return Ok(Some(Protocol::Http2));
        }
        // Another peek at once would find the same bytes.
        tokio::time::sleep(POLL_INTERVAL).await;
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio_stream::StreamExt as _;

    use super::*;

    async fn listening() -> (TcpListener, std::net::SocketAddr) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        (listener, address)
    }

    #[tokio::test]
    async fn connections_without_the_preface_of_http2_are_cut() {
        let (listener, address) = listening().await;
        let mut accepted = Port::from(listener).accept();
        for wrong in [&b"GET / HTTP/1.1\r\n\r\n"[..], b"PRI * HTTP/1.0", b"\0"] {
            let mut stream = TcpStream::connect(address).await.unwrap();
            stream.write_all(wrong).await.unwrap();
            // It is reset or ended at once.
            let ended = tokio::time::timeout(Duration::from_secs(1), stream.read(&mut [0; 8])).await.unwrap();
            assert!(ended.map_or(true, |count| count == 0));
        }
        let mut stream = TcpStream::connect(address).await.unwrap();
        stream.write_all(&PREFACE[..9]).await.unwrap();
        tokio::time::sleep(2 * POLL_INTERVAL).await;
        stream.write_all(&PREFACE[9..]).await.unwrap();
        let mut served = accepted.next().await.unwrap().unwrap();
        let mut said = [0; PREFACE.len()];
        served.read_exact(&mut said).await.unwrap();
        assert_eq!(said, PREFACE);
    }

    #[tokio::test]
    async fn browsers_without_room_are_cut_and_grpc_goes_on() {
        let (listener, address) = listening().await;
        let (browsers, mut taken) = mpsc::channel(1);
        let mut accepted = Port { listener, browsers: Some(browsers) }.accept();
        let mut pages = Vec::new();
        for _ in 0..2 {
            let mut page = TcpStream::connect(address).await.unwrap();
            page.write_all(b"GE").await.unwrap();
            tokio::time::sleep(2 * POLL_INTERVAL).await;
            page.write_all(b"T / HTTP/1.1\r\n\r\n").await.unwrap();
            pages.push(page);
        }
        let cut = tokio::time::timeout(Duration::from_secs(1), pages[1].read(&mut [0; 8])).await.unwrap();
        assert!(cut.map_or(true, |count| count == 0));
        let mut client = TcpStream::connect(address).await.unwrap();
        client.write_all(PREFACE).await.unwrap();
        assert!(accepted.next().await.unwrap().is_ok());
        let mut request = [0; 5];
        taken.recv().await.unwrap().read_exact(&mut request).await.unwrap();
        assert_eq!(&request, b"GET /");
    }
}
