//! Arguments of the bench.

use std::path::PathBuf;

use app_core::setup::SceneArgs;
use clap::{Args, Subcommand};

use crate::load::command::LoadArgs;
use crate::scaling::command::ScalingArgs;
use crate::sharing::command::SharingArgs;
use crate::study::RunArgs;
use crate::viewer::command::ViewerBenchArgs;

/// Holds measured values against bars and writes a report. A check without its input is not run and does not fall
/// short.
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Example: myriorama-lab bench --models models/ --strict"
)]
pub struct BenchArgs {
    #[command(subcommand)]
    pub(super) part: Option<Part>,
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    #[command(flatten)]
    pub(super) run: RunArgs,
    /// A folder of models (.gltf, .glb, .obj, .ply), with its subfolders. All are loaded, and methods are compared on the
    /// largest
    #[arg(long, value_name = "DIR")]
    pub(super) models: Option<PathBuf>,
    /// Nodes P that share the device
    #[arg(long, default_value_t = 5, value_name = "P", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(super) nodes: u16,
    /// Loads the files of --models alone: contents, time to load, and the share of the first picture that each covers
    #[arg(long, requires = "models")]
    pub(super) loading: bool,
}

/// A measurement of its own.
#[derive(Debug, Subcommand)]
pub(super) enum Part {
    /// Measure the number of clients that a cluster serves, and the refusal of more
    Load(LoadArgs),
    /// Measure how the cluster scales with nodes and views, on processes of equal CPU share and in simulation
    Scaling(ScalingArgs),
    /// Measure a live viewer beside the batches of other clients
    Sharing(SharingArgs),
    /// Measure the viewer in a browser
    Viewer(ViewerBenchArgs),
}

impl BenchArgs {
    /// Repeats of a measurement; the median counts.
    pub(super) fn runs(&self) -> usize {
        if self.run.quick { 1 } else { 3 }
    }

    /// The number of views that are compared pixel by pixel.
    pub(super) fn compared_views(&self) -> usize {
        if self.run.quick { 4 } else { 8 }
    }
}
