//! Clusters of real processes, which can be killed, stopped and asked to end.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use client::Client;
use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

use crate::cluster::connected;

/// A process of `scalar_cluster`, killed when it is dropped.
#[derive(Debug)]
pub struct Process {
    child: Child,
    /// The process ends with its input, so that none stays behind when a test is killed.
    _input: Option<ChildStdin>,
    /// Its address, as `http://host:port`.
    pub address: String,
}

impl Process {
    /// Starts a process, which first prints its address.
    ///
    /// # Panics
    /// The process does not start.
    #[must_use]
    pub fn start(program: &str, arguments: &[&str]) -> Self {
        let mut command = Command::new(program);
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().expect("it starts");
        let mut address = String::new();
        BufReader::new(child.stdout.take().expect("its output")).read_line(&mut address).expect("a line");
        assert!(address.starts_with("http://"), "{arguments:?} says {address:?}");
        Self { _input: child.stdin.take(), child, address: address.trim().to_owned() }
    }

    fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// Sends a signal.
    ///
    /// # Panics
    /// The process has ended.
    pub fn signal(&self, signal: Signal) {
        kill_process(self.pid(), signal).expect("it runs");
    }

    /// Kills it abruptly.
    pub fn kill(&mut self) {
        let _ = (self.child.kill(), self.child.wait());
    }

    /// Waits until it has ended.
    ///
    /// # Panics
    /// It takes longer than `deadline`.
    pub async fn ended(&mut self, deadline: Duration) -> (ExitStatus, Duration) {
        let start = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().expect("a child of ours") {
                return (status, start.elapsed());
            }
            assert!(start.elapsed() < deadline, "it has not ended within {deadline:?}");
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    }

    /// Its open files and connections.
    ///
    /// # Panics
    /// The system does not report it.
    #[must_use]
    pub fn open_files(&self) -> usize {
        std::fs::read_dir(format!("/proc/{}/fd", self.child.id())).expect("it runs").count()
    }

    /// The memory that it holds.
    ///
    /// # Panics
    /// The system does not report it.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).expect("it runs");
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("a line with VmRSS");
        1024 * line.trim().trim_end_matches("kB").trim().parse::<usize>().expect("a number")
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

/// A coordinator that records, and nodes `n0`, `n1`….
#[derive(Debug)]
pub struct Processes {
    program: &'static str,
    folder: TempDir,
    coordinators: usize,
    /// The coordinator.
    pub coordinator: Process,
    /// The nodes.
    pub nodes: Vec<Process>,
    /// Further arguments of the coordinator.
    pub client: Client,
}

impl Processes {
    /// Starts them, each on a port of the system's choice, and waits until all nodes have joined.
    ///
    /// # Panics
    /// They do not start.
    pub async fn start(program: &'static str, nodes: usize) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let coordinator = coordinator(program, "127.0.0.1:0", &log_path(folder.path(), 0));
        let client = connected(&coordinator.address).await;
        let mut processes = Self { program, folder, coordinators: 1, coordinator, nodes: Vec::new(), client };
        for number in 0..nodes {
            let node = processes.node(&format!("n{number}"), &[]);
            processes.nodes.push(node);
        }
        processes.client.wait_for_nodes(nodes, Duration::from_secs(10)).await.expect("joined");
        processes
    }

    /// A node of this cluster.
    #[must_use]
    pub fn node(&self, name: &str, more: &[&str]) -> Process {
        self.node_by(&self.coordinator.address, name, more)
    }

    /// A node that knows the coordinator by another address.
    #[must_use]
    pub fn node_by(&self, coordinator: &str, name: &str, more: &[&str]) -> Process {
        let arguments = ["node", "--name", name, "--coordinator", coordinator];
        Process::start(self.program, &[&arguments[..], more].concat())
    }

    /// Starts another coordinator at the first one's address, with its own log.
    pub fn restart_coordinator(&mut self) {
        let address = self.coordinator.address.trim_start_matches("http://").to_owned();
        let log = log_path(self.folder.path(), self.coordinators);
        self.coordinator = coordinator(self.program, &address, &log);
        self.coordinators += 1;
    }

    /// The coordinators' logs, the first one's first.
    #[must_use]
    pub fn logs(&self) -> Vec<PathBuf> {
        (0..self.coordinators).map(|number| log_path(self.folder.path(), number)).collect()
    }
}

fn log_path(folder: &Path, number: usize) -> PathBuf {
    folder.join(format!("coordinator-{number}.log"))
}

fn coordinator(program: &str, listen: &str, log: &Path) -> Process {
    let log = log.to_str().expect("text");
    Process::start(program, &["coordinator", "--listen", listen, "--record", log])
}

/// The place of a node in its cluster, by its name.
///
/// # Panics
/// The name is not `n0`, `n1`….
#[must_use]
pub fn number_of(node_name: &str) -> usize {
    node_name.trim_start_matches('n').parse().expect("n and a number")
}
