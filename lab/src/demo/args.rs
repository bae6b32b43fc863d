//! Arguments of the demo.

use std::path::PathBuf;

use app_core::setup::{DeviceArgs, SceneArgs};
use clap::Args;

/// Delivers 290 views of 200×150 from S samples of 400×300 by P nodes in one process. Prints tables, and writes a
/// report with pictures and charts to --out. Repeats the scene with soft shadows and occlusion, and measures the cost
/// of every lighting. Takes three minutes at most on two slow cores, and less than one with --quick.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  myriorama demo\n  myriorama demo --showcase\n  myriorama demo --scene helmet.gltf --out out/helmet\n  myriorama demo --scene tree-terrain-30k --quick"
)]
pub struct DemoArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    #[command(flatten)]
    pub(super) device: DeviceArgs,
    /// View cameras from a transforms.json, in the scene file's coordinates [default: spread between the sample
    /// cameras]
    #[arg(long, value_name = "FILE")]
    pub(super) cameras: Option<PathBuf>,
    /// Nodes P that share the device
    #[arg(long, default_value_t = 5, value_name = "P", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(super) nodes: u16,
    /// Where the report goes
    #[arg(long, default_value = "out/demo", value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Makes only the first page, first-page.png in --out, and measures nothing else
    #[arg(long)]
    pub(super) showcase: bool,
    /// Runs a smaller form
    #[arg(long)]
    pub(super) quick: bool,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    pub(super) strict: bool,
}

/// The number of views that are compared pixel by pixel.
pub(super) const COMPARED_VIEWS: usize = 6;
