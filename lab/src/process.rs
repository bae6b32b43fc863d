//! This program, started once more: a coordinator or a node of its own, for benches.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use anyhow::Context as _;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

/// How long a process may take until it serves: a scene is made, or a device found.
const START: Duration = Duration::from_secs(300);

/// A process of this program. It is killed when dropped.
#[derive(Debug)]
pub struct Process {
    name: String,
    child: Child,
    lines: mpsc::Receiver<String>,
}

impl Drop for Process {
    fn drop(&mut self) {
        // One that has ended already cannot be killed, which is as well.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Process {
    /// With arguments as on the command line.
    ///
    /// # Errors
    /// Where the system starts none.
    pub fn start(name: &str, arguments: &[String]) -> anyhow::Result<Self> {
        let program = std::env::current_exe().context("this program's file is not known")?;
        let mut command = Command::new(program);
        command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped());
        let mut child = command.spawn().with_context(|| format!("cannot start {name}"))?;
        let output = child.stdout.take().context("a process without output")?;
        Ok(Self { name: name.to_owned(), child, lines: lines_of(output) })
    }

    /// As it was started.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// As the system numbers it.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// The address at the end of the next line that ends in one.
    ///
    /// # Errors
    /// Where the process ends before, or says nothing for long.
    pub fn address(&mut self) -> anyhow::Result<String> {
        loop {
            let line = self.lines.recv_timeout(START).with_context(|| format!("{} does not serve", self.name))?;
            if let Some(address) = line.rsplit(' ').next().filter(|word| word.starts_with("http://")) {
                return Ok(address.to_owned());
            }
        }
    }
}

/// Read to the end: a process that cannot print waits for ever.
fn lines_of(output: ChildStdout) -> mpsc::Receiver<String> {
    let (send, lines) = mpsc::channel();
    std::thread::spawn(move || {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            // Nobody listens any more once it serves.
            let _ = send.send(line);
        }
    });
    lines
}

/// What a process counts, as Prometheus reads it at `http://HOST:PORT/metrics`.
///
/// # Errors
/// Where nobody answers.
pub async fn metrics_page(url: &str) -> anyhow::Result<String> {
    let authority = url.trim_start_matches("http://").split('/').next().unwrap_or_default();
    let mut socket = TcpStream::connect(authority).await.with_context(|| format!("no metrics at {url}"))?;
    let request = format!("GET /metrics HTTP/1.1\r\nhost: {authority}\r\nconnection: close\r\n\r\n");
    socket.write_all(request.as_bytes()).await?;
    let mut page = String::new();
    socket.read_to_string(&mut page).await?;
    Ok(page)
}
