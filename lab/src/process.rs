//! Processes of the program `myriorama`: a coordinator or a node of its own, for benches.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

use anyhow::Context as _;
use app_core::exit::BadInput;
use gpu::DevicePreference;
use tempfile::TempDir;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

/// The longest time until a process serves: a scene is made, or a device found.
const START: Duration = Duration::from_secs(300);

/// The program `myriorama`, which lies beside this one.
///
/// # Errors
/// It has not been built.
fn product() -> anyhow::Result<PathBuf> {
    let own = std::env::current_exe().context("this program's file is not known")?;
    let product = own.with_file_name("myriorama");
    if !product.is_file() {
        return Err(BadInput(format!("{} is missing: `make lab` builds it", product.display())).into());
    }
    Ok(product)
}

/// A process of the product, which is killed when dropped.
#[derive(Debug)]
pub struct Process {
    name: String,
    child: Child,
    lines: mpsc::Receiver<String>,
    /// Files of the fixtures among its arguments.
    _fixtures: TempDir,
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

impl Process {
    /// Starts a process of a name with further arguments.
    fn start(name: &str, arguments: &[&str], further: &[impl AsRef<str>]) -> anyhow::Result<Self> {
        let folder = tempfile::tempdir()?;
        let arguments = arguments.iter().copied().chain(further.iter().map(AsRef::as_ref));
        let mut command = Command::new(product()?);
        command.args(with_fixture_files(arguments, folder.path())?).stdin(Stdio::null()).stdout(Stdio::piped());
        let mut child = command.spawn().with_context(|| format!("cannot start {name}"))?;
        let output = child.stdout.take().context("a process without output")?;
        Ok(Self { name: name.to_owned(), child, lines: lines_of(output), _fixtures: folder })
    }

    /// Starts a coordinator on a free port, with further arguments.
    pub fn coordinator(arguments: &[String]) -> anyhow::Result<Self> {
        Self::start("coordinator", &["coordinator", "--no-viewer", "--listen", "127.0.0.1:0"], arguments)
    }

    /// Starts a whole cluster in one process on a free port, with further arguments.
    pub fn up(arguments: &[String]) -> anyhow::Result<Self> {
        Self::start("up", &["up", "--no-viewer", "--listen", "127.0.0.1:0"], arguments)
    }

    /// Starts a whole cluster in one process on a free port, with its viewer. It prints its address, then the viewer's.
    pub fn up_with_viewer(arguments: &[&str]) -> anyhow::Result<Self> {
        Self::start("up", &["up", "--listen", "127.0.0.1:0"], arguments)
    }

    /// Starts a gateway. It prints the address of its page.
    pub fn gateway(arguments: &[&str]) -> anyhow::Result<Self> {
        Self::start("gateway", &["gateway"], arguments)
    }

    /// Kills the process as `kill -9` does.
    pub fn kill(&mut self) {
        // A process that has ended already cannot be killed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Starts a node on a free port. It prints its address, then that of its metrics.
    pub fn node(number: usize, coordinator: &str, device: DevicePreference) -> anyhow::Result<Self> {
        // Enough digits to sort well.
        let name = format!("node-{number:03}");
        let own = ["--coordinator", coordinator, "--name", &name, "--device", &device.to_string()];
        Self::start(&name, &["node", "--listen", "127.0.0.1:0", "--metrics", "127.0.0.1:0"], &own)
    }

    /// The name that it was started with.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The system's number of the process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// The address at the end of the next line that ends in an address.
    ///
    /// # Errors
    /// The process ends before, or prints nothing for long.
    pub fn address(&mut self) -> anyhow::Result<String> {
        loop {
            let line = self.lines.recv_timeout(START).with_context(|| format!("{} does not serve", self.name))?;
            if let Some(address) = line.rsplit(' ').next().filter(|word| word.starts_with("http://")) {
                return Ok(address.to_owned());
            }
        }
    }
}

/// Writes each fixture that an argument names to a file, which takes its place.
fn with_fixture_files<'a>(arguments: impl Iterator<Item = &'a str>, folder: &Path) -> anyhow::Result<Vec<String>> {
    let mut replaced: Vec<String> = arguments.map(str::to_owned).collect();
    for place in 1..replaced.len() {
        if replaced[place - 1] != "--scene" {
            continue;
        }
        if let Some(fixture) = fixtures::by_name(&replaced[place]) {
            let file = folder.join(format!("{}.glb", fixture.name));
            fixtures::write_glb(&fixture, &file)?;
            replaced[place] = file.display().to_string();
        }
    }
    Ok(replaced)
}

/// Output is read to the end: a process that cannot print stops.
fn lines_of(output: ChildStdout) -> mpsc::Receiver<String> {
    let (send, lines) = mpsc::channel();
    std::thread::spawn(move || {
        for line in BufReader::new(output).lines().map_while(Result::ok) {
            // Nobody reads the lines once the process serves.
            let _ = send.send(line);
        }
    });
    lines
}

/// The text at an address `http://HOST:PORT/PATH`.
///
/// # Errors
/// Nobody answers.
pub async fn http_page(url: &str) -> anyhow::Result<String> {
    let (authority, path) = url.trim_start_matches("http://").split_once('/').unwrap_or_default();
    let mut socket = TcpStream::connect(authority).await.with_context(|| format!("nobody answers at {url}"))?;
    let request = format!("GET /{path} HTTP/1.1\r\nhost: {authority}\r\nconnection: close\r\n\r\n");
    socket.write_all(request.as_bytes()).await?;
    let mut answer = String::new();
    socket.read_to_string(&mut answer).await?;
    let (_, page) = answer.split_once("\r\n\r\n").context("an answer without an end of its headers")?;
    Ok(page.to_owned())
}
