//! Views against an independent synthesiser's: MPEG's RVS 4.0 on the same samples and cameras.

use std::path::Path;
use std::sync::Arc;

use app_core::camera_file::{self, Placement};
use app_core::setup::{SceneArgs, Setup};
use depth_image::PinholeCamera;
use engine::GpuEngine;
use render::Lighting;
use report::{Bar, Check, Report};
use scene::{Environment, SceneSpec};

use super::args::BenchArgs;
use crate::evaluation::Evaluation;
use crate::reference_views::ReferenceViews;
use crate::sweep;

/// A fiftieth of the 280 ms a view that RVS takes on two cores.
const PEER_MS_OVER_50: f64 = 5.6;

/// A comparison: name, unit, bar, and our value, over the foreground where there is one, and over whole pictures.
type Comparison = (&'static str, &'static str, Bar, Option<Value>, Value);
type Value = fn(&Evaluation) -> f64;
const COMPARISONS: [Comparison; 5] = [
    ("peer scene: PSNR, mean (RVS 36.4)", "dB", Bar::AtLeast(36.4), Some(|row| row.foreground_psnr_db), |row| {
        row.psnr_db
    }),
    (
        "peer scene: PSNR, worst view (RVS 34.7)",
        "dB",
        Bar::AtLeast(34.7),
        Some(|row| row.foreground_psnr_min_db),
        |row| row.psnr_min_db,
    ),
    ("peer scene: SSIM (RVS 0.992)", "", Bar::AtLeast(0.992), Some(|row| row.foreground_ssim), |row| row.ssim),
    ("peer scene: FLIP (RVS 0.023)", "", Bar::AtMost(0.023), Some(|row| row.foreground_flip), |row| row.flip),
    ("peer scene: time a view (a fiftieth of RVS)", "ms", Bar::AtMost(PEER_MS_OVER_50), None, |row| row.ms_a_view),
];

/// Adds a table and checks, if the folder is given.
pub fn measure(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let Some(folder) = &args.peer else {
        report
            .checks
            .extend(COMPARISONS.map(|(name, unit, bar, ..)| Check::not_run(name, unit, bar, "--peer is not given")));
        return Ok(());
    };
    let (scene, setup) = scene(folder)?;
    let views = views(args, &setup, folder)?;
    let reference = ReferenceViews::draw(engine, &setup, &scene, views)?;
    let row = reference.evaluate(args.scene.method(), args.runs())?;
    report.tables.push(sweep::table("Peer scene", std::slice::from_ref(&row))?);
    report.checks.extend(COMPARISONS.map(|(name, unit, bar, foreground, whole)| {
        let check = Check::new(name, whole(&row), unit, bar);
        foreground.into_iter().fold(check, |check, value| check.with_foreground(value(&row)))
    }));
    Ok(())
}

/// The scene of a folder, unlit and on black as the peer shows it.
pub(super) fn scene(folder: &Path) -> anyhow::Result<(SceneArgs, Setup)> {
    let args = SceneArgs {
        lighting: Lighting::UNLIT,
        samples: Some(folder.join("samples.json")),
        ..SceneArgs::new(SceneSpec::File(folder.join("bench.ply")))
    };
    let setup = args.load_changed(|scene| scene.background = Environment::default())?;
    Ok((args, setup))
}

pub(super) fn views(args: &BenchArgs, setup: &Setup, folder: &Path) -> anyhow::Result<Vec<PinholeCamera>> {
    let near_m = setup.offer.volume.near_m();
    let placement =
        Placement { source_space: setup.scene.source_space, near_m, size_px: app_core::experiment::VIEW_SIZE_PX };
    let all = camera_file::read(&folder.join("views.json"), placement)?;
    let step = if args.quick { 8 } else { 1 };
    Ok(all.into_iter().step_by(step).collect())
}
