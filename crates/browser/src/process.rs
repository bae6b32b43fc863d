//! The browser as a group of processes, which ends with its owner.

use std::io::{BufRead as _, BufReader, Read as _};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process_group};
use tokio::sync::oneshot;
use tokio::time::timeout;

use crate::error::BrowserError;

/// The time that the browser may take to open its port.
const STARTS_WITHIN: Duration = Duration::from_secs(20);
/// The shell waits for the end of its input, which comes even when this program is killed. It then kills its group: itself
/// and all processes of the browser. It passes on the browser's standard error, and holds no end of that pipe itself.
const SCRIPT: &str = r#""$@" </dev/null 2>&1 >/dev/null & exec >&-; read -r _; kill -KILL 0"#;

/// A `chromium` with the DevTools protocol at a port of the system's choice. All processes of its group are killed when it is
/// dropped.
#[derive(Debug)]
pub(crate) struct BrowserProcess {
    shell: Child,
    _input: Option<ChildStdin>,
    /// Where the browser speaks the DevTools protocol, as `ws://host:port/path`.
    pub(crate) address: String,
}

impl BrowserProcess {
    /// Starts a browser, with its temporary files in a folder.
    ///
    /// # Errors
    /// There is none on this machine, or it does not start.
    pub(crate) async fn start(arguments: &[String], temporary: &Path) -> Result<Self, BrowserError> {
        let mut command = Command::new("sh");
        command.args(["-c", SCRIPT, "sh"]).arg(program("chromium")?).args(arguments);
        command.env("TMPDIR", temporary).process_group(0);
        let mut shell = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn()?;
        let input = shell.stdin.take();
        let output = shell.stdout.take();
        let mut process = Self { shell, _input: input, address: String::new() };
        let (sender, address) = oneshot::channel();
        std::thread::spawn(move || output.map(|output| read(output, sender)));
        let address = timeout(STARTS_WITHIN, address).await;
        let address = address.map_err(|_| BrowserError::Start(format!("no address within {STARTS_WITHIN:?}")))?;
        process.address = address.unwrap_or_else(|_| Err(String::new())).map_err(BrowserError::Start)?;
        Ok(process)
    }
}

impl Drop for BrowserProcess {
    fn drop(&mut self) {
        let _ = kill_process_group(Pid::from_child(&self.shell), Signal::KILL);
        let _ = self.shell.wait();
    }
}

/// A program on the path.
fn program(name: &'static str) -> Result<PathBuf, BrowserError> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut files = std::env::split_paths(&path).map(|folder| folder.join(name));
    files.find(|file| file.is_file()).ok_or(BrowserError::Missing(name))
}

/// Sends the address, or the last line of a browser that ends without one. Reads to the end, so that the browser never waits
/// for a reader.
fn read(output: ChildStdout, sender: oneshot::Sender<Result<String, String>>) {
    let mut output = BufReader::new(output);
    let mut last_line = "it has ended".to_owned();
    let address = output.by_ref().lines().map_while(Result::ok).find_map(|line| {
        let address = address_in(&line);
        last_line = line;
        address
    });
    let _ = sender.send(address.ok_or(last_line));
    let _ = std::io::copy(&mut output, &mut std::io::sink());
}

fn address_in(line: &str) -> Option<String> {
    line.strip_prefix("DevTools listening on ").map(|address| address.trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_address_is_in_one_line_of_the_browser() {
        let address = "ws://127.0.0.1:37117/devtools/browser/5a";
        assert_eq!(address_in(&format!("DevTools listening on {address}")).as_deref(), Some(address));
        assert_eq!(address_in("[1:1:ERROR:bus.cc(408)] Failed to connect to the bus"), None);
    }

    #[test]
    fn a_missing_program_is_named() {
        let error = program("no-such-browser").unwrap_err();
        assert!(error.to_string().starts_with("no-such-browser is missing"), "{error}");
    }
}
