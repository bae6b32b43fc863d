//! Faults, injected into real processes, real sockets and the data between them. Each test checks the client's frames
//! and the coordinator's records against the invariants, and prints the longest time without frames. `docs/faults.md`
//! has the table.

mod bad_input;
mod chunks;
mod many_sessions;
mod network;
mod processes;
mod two_scenes;

use std::time::Duration;

use client::Session;
use cluster_tests::processes::Processes;
use cluster_tests::watcher::Watcher;

/// The program that tests kill.
const PROGRAM: &str = env!("CARGO_BIN_EXE_scalar_cluster");
/// Greatest time until complete frames after a closed connection.
const CLOSED: Duration = Duration::from_secs(5);
/// Greatest time until complete frames after a silent loss.
const SILENT: Duration = Duration::from_secs(15);
/// A sampler at fault loses its role within this, though only one compositor can tell.
const ONE_WITNESS: Duration = Duration::from_secs(10);

/// Prints the time to heal. No invariant may be violated, neither by what the client saw nor by the coordinators' logs.
fn finish(what: &str, wait: Duration, cluster: &Processes, watcher: &Watcher) {
    let mut history = watcher.history();
    cluster.logs().iter().for_each(|log| history.add_log(log).unwrap());
    println!("{what}: {} frames, longest without {:.2} s", history.frames(), wait.as_secs_f64());
    assert_eq!(history.violations(), [""; 0], "{what}");
}

fn has_role(session: &Session, name: &str) -> bool {
    let plan = session.plan().assignment;
    plan.composites(name) || plan.samplers.iter().any(|share| share.node_name == name)
}

fn sampler_of(session: &Session) -> String {
    session.plan().assignment.samplers[0].node_name.clone()
}

fn compositor_of(session: &Session) -> String {
    session.plan().assignment.compositors[0].node_name.clone()
}
