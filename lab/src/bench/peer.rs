//! Truth against an independent synthesiser: MPEG's RVS 4.0 on the same samples and views.

use std::sync::Arc;

use app_core::cameras::{self, Placement};
use app_core::setup::{NEAR_OF_DIAGONAL, SceneArgs, Setup};
use depth_image::PinholeCamera;
use engine::GpuEngine;
use render::Lighting;
use scene::SceneSpec;
use study::{Bar, Check, Report};

use super::BenchArgs;
use crate::evaluate::{Row, Truth};
use crate::sweep;

/// RVS takes 280 ms a view on two cores; a fiftieth of it is asked for.
const PEER_MS_OVER_50: f64 = 5.6;

/// What is compared: name, unit, bar, and our value.
type Comparison = (&'static str, &'static str, Bar, fn(&Row) -> f64);
const COMPARISONS: [Comparison; 5] = [
    ("peer scene: PSNR, mean (RVS 36.4)", "dB", Bar::AtLeast(36.4), |row| row.psnr_db),
    ("peer scene: PSNR, worst view (RVS 34.7)", "dB", Bar::AtLeast(34.7), |row| row.psnr_min_db),
    ("peer scene: SSIM (RVS 0.992)", "", Bar::AtLeast(0.992), |row| row.ssim),
    ("peer scene: FLIP (RVS 0.023)", "", Bar::AtMost(0.023), |row| row.flip),
    ("peer scene: time a view (a fiftieth of RVS)", "ms", Bar::AtMost(PEER_MS_OVER_50), |row| row.ms_a_view),
];

/// Runs the comparison, if its folder is given.
pub fn measure(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let Some(folder) = &args.peer else {
        report
            .checks
            .extend(COMPARISONS.map(|(name, unit, bar, _)| Check::not_run(name, unit, bar, "--peer is not given")));
        return Ok(());
    };
    let scene = SceneArgs {
        lighting: Lighting::UNLIT,
        samples: Some(folder.join("samples.json")),
        ..SceneArgs::of(SceneSpec::File(folder.join("bench.ply")))
    };
    let setup = scene.load()?;
    let views = views(args, &setup, folder)?;
    let truth = Truth::take(engine, &setup, &scene, views)?;
    let row = truth.evaluate(args.scene.method, args.runs())?;
    report.tables.push(sweep::table("Peer scene", std::slice::from_ref(&row))?);
    report.checks.extend(COMPARISONS.map(|(name, unit, bar, value)| Check::new(name, value(&row), unit, bar)));
    Ok(())
}

fn views(args: &BenchArgs, setup: &Setup, folder: &std::path::Path) -> anyhow::Result<Vec<PinholeCamera>> {
    let near_m = setup.offer.volume.size().length() * NEAR_OF_DIAGONAL;
    let placement = Placement { origin_in_source: setup.scene.origin_in_source, near_m };
    let all = cameras::read(&folder.join("views.json"), placement)?;
    let step = if args.quick { 8 } else { 1 };
    Ok(all.into_iter().step_by(step).collect())
}
