//! `myriorama-lab study failures`.

use app_core::exit::{BadInput, Outcome};
use clap::Args;

use super::curves;
use super::report::{Result as CurveResult, add_to};
use super::stand::Stand;
use crate::study::{RunArgs, is_named, measure_rows};

/// Measures the curves of docs/failures.md; `cargo test -p lab failures` measures the same at a small size, as --quick does: pictures of
/// 64×48 and fewer values.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study failures                    all curves
  myriorama-lab study failures --quick --strict   in small pictures; exit status 1 if a shape is lost
  myriorama-lab study failures --curve steps      only the curves whose names contain \"steps\"")]
pub struct FailuresArgs {
    #[command(flatten)]
    study: RunArgs,
    /// Only curves whose names contain this text, in any case
    #[arg(long = "curve", value_name = "TEXT")]
    curves: Vec<String>,
}

/// Measures the curves and writes the report.
///
/// # Errors
/// No curve has such a name, or the folder cannot be written. A curve that cannot be measured is one that does not hold.
pub fn run(args: &FailuresArgs) -> anyhow::Result<Outcome> {
    let wanted: Vec<_> = curves::all().filter(|curve| is_named(curve.name, &args.curves)).collect();
    if wanted.is_empty() {
        return Err(BadInput(format!("no curve's name contains {:?}", args.curves)).into());
    }
    let engine = args.study.engine()?;
    let stand = Stand::new(&engine, args.study.quick);
    let mut report = args.study.report("failures", &engine);
    report.parameter("views", format!("{}×{}", stand.view_px.x, stand.view_px.y));
    report.parameter("sample images", format!("{}×{}", stand.sample_px.x, stand.sample_px.y));
    let results = measure_rows("curves", wanted, |curve| Ok(CurveResult::of(curve, &stand)))?;
    add_to(&mut report, &results)?;
    args.study.finish("out/study/failures", &report)
}
