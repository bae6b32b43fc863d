//! Arguments of the bench.

use std::path::PathBuf;

use app_core::setup::{DeviceArgs, SceneArgs};
use clap::{Args, Subcommand};

use crate::load::command::LoadArgs;
use crate::scaling::command::ScalingArgs;

/// Every bullet is a check: a value, a bar, holds or falls short. Checks whose input was not given are not run
/// and do not fall short.
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Example: myriorama bench --models models/ --peer peer-bench/ --strict"
)]
pub struct BenchArgs {
    #[command(subcommand)]
    pub(super) part: Option<Part>,
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    #[command(flatten)]
    pub(super) device: DeviceArgs,
    /// A folder of models (.gltf, .glb, .obj, .ply): the methods are compared on the largest of them, too
    #[arg(long, value_name = "DIR")]
    pub(super) models: Option<PathBuf>,
    /// A folder with bench.ply, samples.json and views.json: the reference is compared with another synthesiser's
    #[arg(long, value_name = "DIR")]
    pub(super) peer: Option<PathBuf>,
    /// P: nodes that share the device
    #[arg(long, default_value_t = 5, value_name = "P", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(super) nodes: u16,
    /// Where the report goes
    #[arg(long, default_value = "out/bench", value_name = "DIR")]
    pub(super) out: PathBuf,
    /// A smaller form of the same run: fewer repeats, views and models
    #[arg(long)]
    pub(super) quick: bool,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    pub(super) strict: bool,
}

/// What is measured by itself.
#[derive(Debug, Subcommand)]
pub(super) enum Part {
    /// How many clients a cluster of processes serves, and what becomes of those that are too many
    Load(LoadArgs),
    /// How the cluster scales with nodes and views, on processes of equal CPU share and in simulation
    Scaling(ScalingArgs),
}

impl BenchArgs {
    /// Times that a measurement is repeated; the median counts.
    pub(super) fn runs(&self) -> usize {
        if self.quick { 1 } else { 3 }
    }

    /// Views that are compared pixel by pixel.
    pub(super) fn compared_views(&self) -> usize {
        if self.quick { 4 } else { 8 }
    }
}
