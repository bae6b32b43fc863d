//! The cost of a reconstructed view (c) and its errors, on two scenes at two sizes. Built at two commits and run in turn,
//! the command compares the commits.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context as _;
use app_core::camera_file::{self, Placement};
use app_core::exit::Outcome;
use app_core::setup::{DeviceArgs, SceneArgs, Setup};
use clap::Args;
use depth_image::{PinholeCamera, ViewCell};
use engine::GpuEngine;
use glam::UVec2;
use node::Engine as _;
use reconstruction::ReconstructionMethod;
use render::Lighting;
use scene::{Environment, SceneSpec};

use crate::memory::processor_s;
use crate::reference_views::ReferenceViews;

const SIZES_PX: [UVec2; 2] = [UVec2::new(200, 150), UVec2::new(400, 300)];
const VIEWS: usize = 32;
const RUNS: usize = 9;

/// Prints the time of a reconstructed view and its errors.
#[derive(Debug, Args)]
pub struct ViewCostArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// A folder with bench.ply, samples.json and views.json, beside the built-in scene
    #[arg(long, value_name = "DIR")]
    peer: Option<PathBuf>,
}

/// Measures and prints a line for each scene and size.
///
/// # Errors
/// The device fails, or the folder cannot be used.
pub fn run(args: &ViewCostArgs) -> anyhow::Result<Outcome> {
    let engine = GpuEngine::shared(args.device.device)?;
    println!("{}", engine.device_name());
    let built_in = SceneArgs::new("tree-terrain-500k".parse()?);
    let setup = built_in.load()?;
    let views = ViewCell::between(&setup.around).context("no sample cameras")?.spread(8, SIZES_PX[1]);
    cost(&engine, "500k", &built_in, &setup, &views)?;
    let Some(folder) = &args.peer else { return Ok(Outcome::Done) };
    let args = SceneArgs {
        lighting: Lighting::UNLIT,
        samples: Some(folder.join("samples.json")),
        ..SceneArgs::new(SceneSpec::File(folder.join("bench.ply")))
    };
    let setup = args.load_changed(|scene| scene.background = Environment::default())?;
    let near_m = setup.offer.volume.near_m();
    let placement =
        Placement { source_space: setup.scene.source_space, near_m, size_px: app_core::experiment::VIEW_SIZE_PX };
    let views: Vec<_> = camera_file::read(&folder.join("views.json"), placement)?.into_iter().step_by(16).collect();
    cost(&engine, "peer", &args, &setup, &views)?;
    Ok(Outcome::Done)
}

fn cost(
    engine: &Arc<GpuEngine>,
    name: &str,
    args: &SceneArgs,
    setup: &Setup,
    views: &[PinholeCamera],
) -> anyhow::Result<()> {
    let method = ReconstructionMethod::default();
    for size_px in SIZES_PX {
        let cameras = views.iter().map(|view| view.resized(size_px)).collect();
        let reference = ReferenceViews::draw(engine, setup, args, cameras)?;
        let row = reference.evaluate(method, 1)?;
        let before_s = own_processor_s();
        let ms = reference.ms_a_view(method, VIEWS, RUNS)?;
        // One run more does not count for the median.
        let views = (RUNS + 1) * VIEWS.next_multiple_of(reference.cameras.len());
        let processor_ms = (own_processor_s() - before_s) * 1e3 / views as f64;
        println!(
            "{name} {size_px}: {ms:.2} ms a view, {processor_ms:.2} ms of processors, {:.2} dB, FLIP {:.4}",
            row.psnr_db, row.flip
        );
    }
    Ok(())
}

/// The time of this process on all processors: other load lengthens it less than the time of a clock.
fn own_processor_s() -> f64 {
    processor_s(std::process::id()).unwrap_or(f64::NAN)
}
