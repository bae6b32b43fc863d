//! What a reconstructed view costs (c), and its errors, on two scenes at two sizes. Built at two commits and run in turn, it
//! compares them.
//!
//!     cargo run --release -p lab --example view_cost -- [PEER_DIR]

use std::path::Path;

use anyhow::Context as _;
use app_core::camera_file::{self, Placement};
use app_core::setup::SceneArgs;
use depth_image::{PinholeCamera, ViewCell};
use engine::GpuEngine;
use glam::UVec2;
use lab::reference_views::ReferenceViews;
use lab::scene_args;
use node::Engine as _;
use reconstruction::ReconstructionMethod;
use render::Lighting;
use scene::{Environment, SceneSpec};

const SIZES_PX: [UVec2; 2] = [UVec2::new(200, 150), UVec2::new(400, 300)];
const VIEWS: usize = 32;
const RUNS: usize = 9;

fn main() -> anyhow::Result<()> {
    let engine = GpuEngine::shared(gpu::DevicePreference::default())?;
    println!("{}", engine.device_name());
    let setup = scene_args("tree-terrain-500k".parse()?).load()?;
    let views = ViewCell::between(&setup.around).context("no sample cameras")?.spread(8, SIZES_PX[1]);
    cost(&engine, "500k", &scene_args("tree-terrain-500k".parse()?), &setup, &views)?;
    let Some(folder) = std::env::args().nth(1) else { return Ok(()) };
    let folder = Path::new(&folder);
    let args = SceneArgs {
        lighting: Lighting::UNLIT,
        samples: Some(folder.join("samples.json")),
        ..scene_args(SceneSpec::File(folder.join("bench.ply")))
    };
    let setup = args.load_changed(|scene| scene.background = Environment::default())?;
    let near_m = setup.offer.volume.near_m();
    let placement = Placement { origin_in_source: setup.scene.origin_in_source, near_m };
    let views: Vec<_> = camera_file::read(&folder.join("views.json"), placement)?.into_iter().step_by(16).collect();
    cost(&engine, "peer", &args, &setup, &views)
}

fn cost(
    engine: &std::sync::Arc<GpuEngine>,
    name: &str,
    args: &SceneArgs,
    setup: &app_core::setup::Setup,
    views: &[PinholeCamera],
) -> anyhow::Result<()> {
    let method = ReconstructionMethod::default();
    for size_px in SIZES_PX {
        let cameras = views.iter().map(|view| view.resized(size_px)).collect();
        let reference = ReferenceViews::draw(engine, setup, args, cameras)?;
        let row = reference.evaluate(method, 1)?;
        let before_s = processor_s();
        let ms = reference.ms_a_view(method, VIEWS, RUNS)?;
        // One run more does not count for the median.
        let views = (RUNS + 1) * VIEWS.next_multiple_of(reference.cameras.len());
        let processor_ms = (processor_s() - before_s) * 1e3 / views as f64;
        println!(
            "{name} {size_px}: {ms:.2} ms a view, {processor_ms:.2} ms of processors, {:.2} dB, FLIP {:.4}",
            row.psnr_db, row.flip
        );
    }
    Ok(())
}

/// The time that this process has had on all processors; other load lengthens it less than a clock's time.
fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(11).take(2).filter_map(|field| field.parse::<f64>().ok());
    ticks.sum::<f64>() / 100.0
}
