//! The command line.

use clap::{Args, Parser, Subcommand};
use gpu::DevicePreference;

use crate::commands::{bench, coordinator, demo, health, node, replay, status, study, up, view};
use crate::exit::Outcome;

/// Many views of one scene from a few depth images.
///
/// A few depth images sample the scene; every view is reconstructed from them, so that one more view costs a
/// reconstruction, not a rendering. Nodes share the work: samplers make the images, compositors the views.
#[derive(Debug, Parser)]
#[command(name = "myriorama", version, propagate_version = true, after_help = EXAMPLES)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const EXAMPLES: &str = "\
Examples:
  myriorama demo                                      the paper's experiment on this machine: out/demo/index.html
  myriorama demo --scene helmet.gltf                  the same for your own model
  myriorama up --scene helmet.gltf                    a whole cluster in this process, on 127.0.0.1:7420
  myriorama view --orbit 24 --out out/orbit           24 views from it, as PNG
  myriorama view --grid 9x5 --depth --out out/quilt   45 views with depth, as for a light-field display

The same on several machines or terminals:
  myriorama coordinator --scene helmet.gltf
  myriorama node --coordinator http://127.0.0.1:7420  one on each
  myriorama view --coordinator http://127.0.0.1:7420 --orbit 24 --out out/orbit

Exit status: 0 done; 1 a check that was asked for fell short; 2 arguments or input that cannot be used; 3 a failure
at run time. RUST_LOG=info (or debug) says what is going on.";

/// What the program does.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Serve a scene with a whole cluster in this process
    Up(up::UpArgs),
    /// Serve a scene as the coordinator of nodes that join it
    Coordinator(coordinator::CoordinatorArgs),
    /// Join a coordinator: sample and composite as it says
    Node(node::NodeArgs),
    /// Ask a cluster for views and write them as pictures
    View(view::ViewArgs),
    /// Show a cluster's nodes, their roles, and why they have them
    Status(status::StatusArgs),
    /// Run a coordinator's recorded events through the schedule once more
    Replay(replay::ReplayArgs),
    /// Ask a coordinator or a node whether it serves
    Health(health::HealthArgs),
    /// Run the paper's experiment on this machine and write a report
    Demo(demo::DemoArgs),
    /// Measure speed and accuracy against what is promised, and write a report
    Bench(bench::BenchArgs),
    /// Repeat a paper's experiments, its figures beside ours, and write a report
    #[command(subcommand)]
    Study(study::StudyCommand),
}

/// Which device.
#[derive(Debug, Clone, Copy, Args)]
pub struct DeviceArgs {
    /// any (a GPU if there is one) or software
    #[arg(long, default_value_t, value_name = "NAME", env = "MYRIORAMA_DEVICE")]
    pub device: DevicePreference,
}

impl Command {
    /// Runs it to its end.
    ///
    /// # Errors
    /// Input that cannot be used, or a failure at run time; [`crate::exit::code_of`] tells them apart.
    pub fn run(self) -> anyhow::Result<Outcome> {
        match self {
            Self::Up(args) => up::run(args),
            Self::Coordinator(args) => coordinator::run(args),
            Self::Node(args) => node::run(args),
            Self::View(args) => view::run(args),
            Self::Status(args) => status::run(&args),
            Self::Replay(args) => replay::run(&args),
            Self::Health(args) => health::run(&args),
            Self::Demo(args) => demo::run(&args),
            Self::Bench(args) => bench::run(&args),
            Self::Study(command) => command.run(),
        }
    }
}
