//! `myriorama-lab study stability`.

use std::sync::Arc;

use anyhow::Context as _;
use app_core::exit::{BadInput, Outcome};
use app_core::experiment::VIEW_SIZE_PX;
use clap::Args;
use engine::GpuEngine;
use report::{Bar, Check};

use super::measure::{Measured, Stand};
use super::paths::{PATHS, Path, PathKind};
use super::report::add_to;
use super::still::differing_methods;
use super::subject::Subject;
use crate::study::{RunArgs, measure_rows};

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
    study: RunArgs,
    /// Only paths whose names contain this text
    #[arg(long = "path", value_name = "TEXT", default_value = "")]
    path: String,
}

/// Measures all paths and writes the report.
///
/// # Errors
/// The device fails, or the folder cannot be written.
pub fn run(args: &StabilityArgs) -> anyhow::Result<Outcome> {
    let wanted: Vec<PathKind> = PATHS.into_iter().filter(|kind| kind.name.contains(&args.path)).collect();
    if wanted.is_empty() {
        return Err(BadInput(format!("no path's name contains {:?}", args.path)).into());
    }
    let engine = args.study.engine()?;
    let mut report = args.study.report("stability", &engine);
    let frames = FRAMES[usize::from(!args.study.quick)];
    let paths = measure_rows("paths", wanted, |kind| {
        measured(&engine, kind, frames).with_context(|| format!("path {:?}", kind.name))
    })?;
    add_to(&mut report, &paths)?;
    if args.path.is_empty() {
        report.checks.push(still(&engine)?);
    }
    args.study.finish("out/study/stability", &report)
}

fn measured(engine: &Arc<GpuEngine>, kind: PathKind, frames: usize) -> anyhow::Result<Measured> {
    let subject = Subject::load(engine, kind.scene, kind.lighting, VIEW_SIZE_PX)?;
    let stand = Stand { engine: engine.as_ref(), subject: &subject };
    stand.measure(Path::new(kind, &subject, frames)?)
}

fn still(engine: &Arc<GpuEngine>) -> anyhow::Result<Check> {
    let subject = Subject::load(engine, STILL_SCENE, "phong", VIEW_SIZE_PX)?;
    let stand = Stand { engine: engine.as_ref(), subject: &subject };
    let (differing, count) = differing_methods(&stand)?;
    let name = format!("still camera, still scene: methods of {count} that differ {}", differing.join("; "));
    Ok(Check::new(name.trim_end(), differing.len() as f64, "", Bar::AtMost(0.0)))
}
