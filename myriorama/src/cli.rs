//! The command line.

use std::time::Duration;

use app_core::exit::Outcome;
use app_core::process::runtime;
use clap::{Parser, Subcommand};

use crate::commands::{coordinator, demo, gateway, health, node, plan, replay, status, up, view};

/// Many views of one scene from a few depth images.
///
/// A few depth images sample the scene; every view is reconstructed from them. One more view then costs a
/// reconstruction, not a rendering. Nodes share the work: samplers make the images, compositors the views.
#[derive(Debug, Parser)]
#[command(name = "myriorama", version, propagate_version = true, after_help = EXAMPLES)]
pub struct Cli {
    /// The subcommand.
    #[command(subcommand)]
    pub command: Command,
}

/// Work on the device that goes on when nodes have ended, such as a measurement, may take so long. A device that hangs must
/// not keep the process.
const MEASURED_TO_END: Duration = Duration::from_secs(5);

const EXAMPLES: &str = "\
Examples:
  myriorama demo                                      a cluster beside direct drawing: out/demo/index.html
  myriorama demo --scene helmet.gltf                  the same for your own model
  myriorama up --scene helmet.gltf                    a whole cluster in this process, on 127.0.0.1:7420
  myriorama view --orbit 24 --out out/orbit           24 views from it, as PNG
  myriorama view --grid 9x5 --depth --out out/quilt   45 views with depth, as for a light-field display

The same on several machines or terminals:
  myriorama coordinator --scene helmet.gltf
  myriorama node --coordinator http://127.0.0.1:7420  one on each
  myriorama view --coordinator http://127.0.0.1:7420 --orbit 24 --out out/orbit

Exit status: 0 done; 1 a check that was asked for fell short; 2 arguments or input that cannot be used; 3 a failure
at run time; 130 `view` was ended by ctrl-c or SIGTERM. RUST_LOG=info (or debug) says what is going on.";

/// A subcommand of the program.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Serves a scene with a whole cluster in this process
    Up(up::UpArgs),
    /// Serves a scene as the coordinator of nodes that join it
    Coordinator(coordinator::CoordinatorArgs),
    /// Joins a coordinator, to sample and composite by its plan
    Node(node::NodeArgs),
    /// Serves the viewer to browsers
    Gateway(gateway::GatewayArgs),
    /// Asks a cluster for views and writes them as pictures
    View(view::ViewArgs),
    /// Finds the cheapest representation of a scene that keeps an error budget
    Plan(plan::PlanArgs),
    /// Shows the nodes of a cluster, their roles, and the reason of the plan
    Status(status::StatusArgs),
    /// Replays a coordinator's recorded events through the schedule
    Replay(replay::ReplayArgs),
    /// Asks a coordinator or a node whether it serves
    Health(health::HealthArgs),
    /// Shows what a cluster gains on one scene, and writes a page with pictures
    Demo(demo::DemoArgs),
}

impl Command {
    /// Runs the subcommand to its end.
    ///
    /// # Errors
    /// Input cannot be used, or the program fails at run time; [`app_core::exit::report`] separates the two.
    pub fn run(self) -> anyhow::Result<Outcome> {
        match self {
            Self::Up(args) => run_to_end(up::run(args), MEASURED_TO_END),
            Self::Coordinator(args) => run_to_end(coordinator::run(args), MEASURED_TO_END),
            Self::Node(args) => run_to_end(node::run(args), MEASURED_TO_END),
            Self::Gateway(args) => runtime()?.block_on(gateway::run(args)),
            // A second signal does not wait for pictures that are being written.
            Self::View(args) => run_to_end(view::run(args), Duration::ZERO),
            Self::Plan(args) => plan::run(&args),
            Self::Status(args) => runtime()?.block_on(status::run(&args)),
            Self::Replay(args) => replay::run(&args),
            Self::Health(args) => runtime()?.block_on(health::run(&args)),
            Self::Demo(args) => demo::run(&args),
        }
    }
}

/// Runs a command. Work that it leaves on other threads may take `most` to end.
fn run_to_end(command: impl Future<Output = anyhow::Result<Outcome>>, most: Duration) -> anyhow::Result<Outcome> {
    let runtime = runtime()?;
    let outcome = runtime.block_on(command);
    runtime.shutdown_timeout(most);
    outcome
}
