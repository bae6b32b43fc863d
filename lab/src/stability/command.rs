//! `myriorama-lab study stability`.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context as _;
use app_core::exit::{BadInput, Outcome};
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use depth_image::Antialias;
use engine::GpuEngine;
use node::Engine as _;
use report::{Bar, Check, Report};

use super::measure::{Measured, Stand};
use super::paths::{PATHS, Path, PathKind};
use super::report::add_to;
use super::still::differing_rows;
use crate::fronts::conditions::Conditions;
use crate::fronts::subject::Subject;

/// Frames of a path, in the quick form and in the full one.
const FRAMES: [usize; 2] = [16, 48];
/// The scene of the still camera.
const STILL_SCENE: &str = "tree-terrain-30k";

/// Measures how errors change from frame to frame along paths, and the jump where a view's samples change.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study stability --strict        exit status 1 when a check falls short
  myriorama-lab study stability --quick --path cells")]
pub struct StabilityArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// Where the report goes
    #[arg(long, default_value = "out/study/stability", value_name = "DIR")]
    out: PathBuf,
    /// Measures 16 frames of a path in place of 48
    #[arg(long)]
    quick: bool,
    /// Only paths whose names contain this text
    #[arg(long = "path", value_name = "TEXT", default_value = "")]
    path: String,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

/// Measures all paths and writes the report.
///
/// # Errors
/// The device fails, or the folder cannot be written.
pub fn run(args: &StabilityArgs) -> anyhow::Result<Outcome> {
    let engine = GpuEngine::shared(args.device.device)?;
    let mut report = Report::new("Myriorama study: stability", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    let wanted: Vec<PathKind> = PATHS.into_iter().filter(|kind| kind.name.contains(&args.path)).collect();
    if wanted.is_empty() {
        return Err(BadInput(format!("no path's name contains {:?}", args.path)).into());
    }
    let progress = bar("paths", wanted.len() + 1);
    let mut paths = Vec::with_capacity(wanted.len());
    for kind in wanted {
        let frames = FRAMES[usize::from(!args.quick)];
        paths.push(measured(&engine, kind, frames).with_context(|| format!("path {:?}", kind.name))?);
        progress.inc(1);
    }
    add_to(&mut report, &paths)?;
    if args.path.is_empty() {
        report.checks.push(still(&engine)?);
    }
    progress.finish_and_clear();
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
}

fn measured(engine: &Arc<GpuEngine>, kind: PathKind, frames: usize) -> anyhow::Result<Measured> {
    let conditions = Conditions { lighting: kind.lighting.to_owned(), ..Conditions::of_scene(kind.scene) };
    let planning = Subject::load(engine, &conditions)?.planning(Antialias::NONE, 0)?;
    let stand = Stand { engine: engine.as_ref(), subject: &planning.subject };
    stand.measure(Path::new(kind, &planning, frames)?)
}

fn still(engine: &Arc<GpuEngine>) -> anyhow::Result<Check> {
    let planning = Subject::load(engine, &Conditions::of_scene(STILL_SCENE))?.planning(Antialias::NONE, 0)?;
    let stand = Stand { engine: engine.as_ref(), subject: &planning.subject };
    let (differing, count) = differing_rows(&stand, &planning)?;
    let name = format!("still camera, still scene: rows of {count} that differ {}", differing.join("; "));
    Ok(Check::new(name.trim_end(), differing.len() as f64, "", Bar::AtMost(0.0)))
}
