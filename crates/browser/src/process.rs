//! The driver as a process, which ends with all of its browser.

use std::io::{BufRead as _, BufReader};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};
use tokio::sync::oneshot;

use crate::error::BrowserError;

/// The time that the driver may take to open its port.
const STARTS_WITHIN: Duration = Duration::from_secs(20);
/// The shell waits for the end of its input, which comes even when this program is killed. It then kills its group: itself, the
/// driver, and the browser.
const SCRIPT: &str = r#""$@" </dev/null & exec >&-; read -r _; kill -KILL 0"#;

/// A driver takes a free port of IPv4 and the same of IPv6, and ends if another program has just taken that.
const TRIES: u32 = 3;

/// A `chromedriver` at a port of the system's choice. All processes of its group are killed when it is dropped.
#[derive(Debug)]
pub struct DriverProcess {
    shell: Child,
    _input: Option<ChildStdin>,
    /// Its address, as `http://host:port`.
    pub address: String,
}

impl DriverProcess {
    /// Starts a driver.
    ///
    /// # Errors
    /// There is none on this machine, or it does not start.
    pub async fn start() -> Result<Self, BrowserError> {
        let driver = program("chromedriver")?;
        let mut tries = 1;
        loop {
            match Self::start_once(&driver).await {
                Err(BrowserError::Ended) if tries < TRIES => tries += 1,
                started => return started,
            }
        }
    }

    async fn start_once(driver: &Path) -> Result<Self, BrowserError> {
        let mut command = Command::new("sh");
        command.args(["-c", SCRIPT, "sh"]).arg(driver).arg("--port=0").process_group(0);
        let mut shell = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn()?;
        let (input, output) = (shell.stdin.take(), shell.stdout.take());
        let mut process = Self { shell, _input: input, address: String::new() };
        let (send, port) = oneshot::channel();
        std::thread::spawn(move || output.map(|output| read(output, send)));
        let port = tokio::time::timeout(STARTS_WITHIN, port).await;
        let port = port.map_err(|_| BrowserError::Driver(format!("no port within {STARTS_WITHIN:?}")))?;
        let port = port.map_err(|_| BrowserError::Ended)?;
        process.address = format!("http://127.0.0.1:{port}");
        Ok(process)
    }
}

impl Drop for DriverProcess {
    fn drop(&mut self) {
        let _ = kill_process_group(Pid::from_child(&self.shell), Signal::KILL);
        let _ = self.shell.wait();
    }
}

/// A program on the path.
///
/// # Errors
/// There is none.
pub fn program(name: &'static str) -> Result<PathBuf, BrowserError> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut found = std::env::split_paths(&path).map(|folder| folder.join(name));
    found.find(|file| file.is_file()).ok_or(BrowserError::Missing(name))
}

/// Sends the port; reads further lines to their end, so that the driver never waits for a reader.
fn read(output: ChildStdout, send: oneshot::Sender<u16>) {
    let mut lines = BufReader::new(output).lines().map_while(Result::ok);
    if let Some(port) = lines.by_ref().find_map(|line| port_in(&line)) {
        let _ = send.send(port);
    }
    lines.for_each(drop);
}

fn port_in(line: &str) -> Option<u16> {
    line.split_once("started successfully on port ")?.1.trim_end_matches('.').parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_port_is_in_one_line_of_the_driver() {
        assert_eq!(port_in("ChromeDriver was started successfully on port 37117."), Some(37117));
        assert_eq!(port_in("Starting ChromeDriver 156.0 on port 0"), None);
    }

    #[test]
    fn a_missing_program_is_named() {
        let error = program("no-such-browser").unwrap_err();
        assert!(error.to_string().starts_with("no-such-browser is missing"), "{error}");
    }
}
