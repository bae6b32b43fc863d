//! Arguments of `view`.

use std::path::PathBuf;

use app_core::sizes::SizePx;
use clap::Args;
use cluster::PolicyChoice;
use codec::FrameCodec;
use reconstruction::ReconstructionMethod;
use render::Lighting;

use super::viewpoints::Viewpoints;

/// Asks for views and writes them to --out. Colour is view_0000.png. With --depth, view_0000.depth.png has 16-bit
/// inverse planar depth: value / 65535 × inverse_depth_max_per_m of the frame in cameras.json, 0 for background. With
/// --provenance, view_0000.provenance.png has a colour for each sample camera, white for blended and red for filled
/// pixels. cameras.json has the cameras in the transforms.json convention, in the scene file's coordinates.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// The address of the coordinator
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:7420", env = "MYRIORAMA_COORDINATOR")]
    pub(super) coordinator: String,
    #[command(flatten)]
    pub(super) viewpoints: Viewpoints,
    /// Samples near the views, in as many view cells as they need, in place of the coordinator's sample cameras
    #[arg(long)]
    pub(super) cells: bool,
    /// Size of the views, unless --cameras gives it
    #[arg(long, default_value = "200x150", value_name = "WxH")]
    pub(super) size: SizePx,
    /// The folder of the pictures
    #[arg(long, default_value = "out/view", value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Writes the depth of every view as well
    #[arg(long)]
    pub(super) depth: bool,
    /// Writes the provenance of every pixel as well
    #[arg(long)]
    pub(super) provenance: bool,
    /// How views are reconstructed [default: the coordinator's]
    #[arg(long, value_name = "NAME")]
    pub(super) method: Option<ReconstructionMethod>,
    /// How surfaces are lit, as in "soft 16, occlusion 16" (see `myriorama up --help`) [default: the coordinator's]
    #[arg(long, value_name = "TERMS")]
    pub(super) lighting: Option<Lighting>,
    /// Draws every view directly as well, and prints the PSNR, SSIM and FLIP of the views against it; also in
    /// comparison.csv
    #[arg(long)]
    pub(super) compare: bool,
    /// With --compare: exit status 1 if the PSNR of a view is below
    #[arg(long, value_name = "DB", requires = "compare")]
    pub(super) least_psnr: Option<f64>,
    /// With --frames: starts with one ray a light and pixel, and doubles them from frame to frame
    #[arg(long)]
    pub(super) refine: bool,
    /// The codec of frames: lz4 (lossless) or jpeg:QUALITY
    #[arg(long, default_value = "lz4", value_name = "NAME")]
    pub(super) codec: FrameCodec,
    /// The policy: pipeline, direct, time-share, or auto (the fastest by prediction)
    #[arg(long, default_value = "auto", value_name = "NAME")]
    pub(super) policy: PolicyChoice,
    /// Tiles of every sample image, shared among samplers [default: the fastest by prediction]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16))]
    pub(super) tiles: Option<u32>,
    /// Moments of an animated scene; all views are made of each moment
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(super) frames: u32,
    /// Seconds between moments
    #[arg(long, default_value_t = 1.0 / 30.0, value_name = "S")]
    pub(super) frame_step: f64,
    /// Moves along the views at --rate for --seconds, and prints the time of frames by stage. Every frame is in
    /// live.csv in --out; no pictures are written
    #[arg(long, conflicts_with_all = ["compare", "depth", "provenance"])]
    pub(super) live: bool,
    /// With --live: poses a second
    #[arg(long, default_value_t = 10.0, value_name = "HZ", value_parser = rate)]
    pub(super) rate: f64,
    /// With --live: the time to move
    #[arg(long, default_value_t = 10.0, value_name = "S", value_parser = duration)]
    pub(super) seconds: f64,
    /// With --live: exit status 1 if no new frame came for longer
    #[arg(long, value_name = "S", requires = "live")]
    pub(super) longest_gap: Option<f64>,
}

fn rate(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|hz| (0.01..=1000.0).contains(hz)).ok_or_else(|| "expected 0.01 to 1000".to_owned())
}

fn duration(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|s| (0.1..=86_400.0).contains(s)).ok_or_else(|| "expected 0.1 to 86400".to_owned())
}
