//! The command and its report.

use std::path::PathBuf;

use anyhow::{Context as _, bail};
use app_core::exit::Outcome;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::GpuEngine;
use node::Engine as _;
use reconstruction::MAX_MIRROR_CELLS;
use render::Lighting;
use scene::{Limits, MissingTextures, SceneSpec};
use study::{Cell, Report, Table};

use super::candidates::{candidates, mirrors};
use super::measure::{Figures, Hall};
use crate::failures::stand::Stand;
use crate::progress::bar;

/// Views around a scene.
const VIEWS: [usize; 2] = [24, 6];
const LIGHTING: [&str; 2] = ["soft 16, occlusion 16, reflections 1", "shadows, reflections 1"];

/// Follows the rays off a scene's mirrors in images of their surroundings, and compares the views with direct drawing.
/// Errors are those of the pixels in which a mirror shows the scene.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama study impostors
  myriorama study impostors --quick")]
pub struct ImpostorsArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// A built-in scene with mirrors, or a file
    #[arg(long, default_value = "teapot-mirror", value_name = "SPEC")]
    scene: SceneSpec,
    /// Six views in hard shadows, in place of 24 in soft light
    #[arg(long)]
    quick: bool,
    /// Where the report goes
    #[arg(long, default_value = "out/study/impostors", value_name = "DIR")]
    out: PathBuf,
}

/// Measures all candidates and writes the report.
///
/// # Errors
/// The scene cannot be used or has no mirrors, the device fails, or the folder cannot be written.
pub fn run(args: &ImpostorsArgs) -> anyhow::Result<Outcome> {
    let scene = args.scene.load(&Limits::default(), MissingTextures::Refuse)?;
    let bounds = mirrors(&scene);
    let first = bounds.first().with_context(|| format!("{} has no mirrors", args.scene))?;
    if bounds.len() > MAX_MIRROR_CELLS {
        bail!("{} has {} parts with mirrors, at most {MAX_MIRROR_CELLS} can be followed", args.scene, bounds.len());
    }
    let engine = GpuEngine::shared(args.device.device)?;
    let stand = Stand::new(&engine, false);
    let lighting: Lighting = LIGHTING[usize::from(args.quick)].parse()?;
    let hall = Hall::new(&stand, &scene, lighting, VIEWS[usize::from(args.quick)])?;
    // Candidates of the same name for each mirror.
    let seen = scene.bounds().center();
    let of_mirrors: Vec<_> = bounds.iter().map(|mirror| candidates(mirror, seen)).collect();
    let count = candidates(first, seen).len();
    let progress = bar("candidates", count + 1);
    let mut rows = vec![("the environment alone", hall.figures(&bounds, &[])?)];
    progress.inc(1);
    let mut columns: Vec<_> = of_mirrors.into_iter().map(Vec::into_iter).collect();
    for _ in 0..count {
        let own: Vec<_> = columns.iter_mut().filter_map(Iterator::next).collect();
        let name = own.first().map_or("", |candidate| candidate.name);
        rows.push((name, hall.figures(&bounds, &own)?));
        progress.inc(1);
    }
    progress.finish_and_clear();
    let mut report = Report::new("Myriorama study: impostors", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("scene", args.scene.to_string());
    report.parameter("lighting", lighting.to_string());
    let table = table(&rows)?;
    println!("{}", table.to_text());
    report.tables.push(table);
    Ok(Outcome::of(report.finish(&args.out)?))
}

fn table(rows: &[(&str, Figures)]) -> anyhow::Result<Table> {
    let columns = [
        ("images of the surroundings", ""),
        ("images", ""),
        ("texels", ""),
        ("sampled in", "ms"),
        ("FLIP", ""),
        ("PSNR", "dB"),
        ("guessed", "%"),
        ("a view", "ms"),
        ("over a view without mirrors", "×"),
    ];
    let mut table = Table::new("Pixels in which a mirror shows the scene", &columns);
    for (name, figures) in rows {
        let [with_s, without_s] = figures.view_s;
        let counts = [figures.images, figures.texels].map(Cell::from);
        let numbers = [
            figures.sample_s * 1e3,
            figures.flip,
            figures.psnr_db,
            figures.guessed_ratio * 100.0,
            with_s * 1e3,
            with_s / without_s,
        ];
        table.push([Cell::from(*name)].into_iter().chain(counts).chain(numbers.map(Cell::from)))?;
    }
    Ok(table)
}
