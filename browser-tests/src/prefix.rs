//! A front server that serves a gateway under a path of its own, as many do.

use std::io::{self, ErrorKind};

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, copy_bidirectional};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;

/// The longest head of a request.
const MAX_HEAD_BYTES: usize = 16 << 10;

/// A server that takes its path away from every request. It ends when it is dropped.
#[derive(Debug)]
pub struct PrefixServer {
    /// Where the gateway's page is: `http://host:port/path/`.
    pub url: String,
    listening: JoinHandle<()>,
}

impl Drop for PrefixServer {
    fn drop(&mut self) {
        self.listening.abort();
    }
}

impl PrefixServer {
    /// Serves a gateway at `host:port` under a path, as `/a/b`.
    ///
    /// # Panics
    /// No port is free.
    pub async fn start(gateway: &str, path: &'static str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let url = format!("http://{}{path}/", listener.local_addr().expect("an address"));
        let gateway = gateway.to_owned();
        let listening = tokio::spawn(async move {
            while let Ok((near, _)) = listener.accept().await {
                let gateway = gateway.clone();
                tokio::spawn(async move { pass(near, &gateway, path).await });
            }
        });
        Self { url, listening }
    }
}

/// Passes one request on, and then all bytes. Each request has a connection of its own.
async fn pass(mut near: TcpStream, gateway: &str, path: &str) -> io::Result<()> {
    let (head, rest) = head(&mut near).await?;
    let Some(head) = stripped(&head, path) else {
        return near.write_all(b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n").await;
    };
    let mut far = TcpStream::connect(gateway).await?;
    far.write_all(head.as_bytes()).await?;
    far.write_all(&rest).await?;
    copy_bidirectional(&mut near, &mut far).await.map(drop)
}

/// The head of a request, its empty line included, and what has come after it.
async fn head(stream: &mut TcpStream) -> io::Result<(String, Vec<u8>)> {
    let mut bytes = Vec::new();
    loop {
        if let Some(end) = bytes.windows(4).position(|window| window == b"\r\n\r\n") {
            let rest = bytes.split_off(end + 4);
            return Ok((String::from_utf8_lossy(&bytes).into_owned(), rest));
        }
        if bytes.len() > MAX_HEAD_BYTES || stream.read_buf(&mut bytes).await? == 0 {
            return Err(ErrorKind::InvalidData.into());
        }
    }
}

/// A head without the path; `None` for another path. A connection that is not upgraded ends with its answer.
fn stripped(head: &str, path: &str) -> Option<String> {
    let (method, rest) = head.split_once(' ')?;
    let head = format!("{method} {}", rest.strip_prefix(path).filter(|rest| rest.starts_with('/'))?);
    Some(head.replacen("\r\nConnection: keep-alive\r\n", "\r\nConnection: close\r\n", 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_path_and_the_end_of_the_connection_change() {
        let head = "GET /a/b/main.js HTTP/1.1\r\nHost: x\r\nConnection: keep-alive\r\n\r\n";
        let bare = "GET /main.js HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n";
        assert_eq!(stripped(head, "/a/b").as_deref(), Some(bare));
        assert_eq!((stripped(head, "/other"), stripped(head, "/a/b/m")), (None, None));
    }
}
