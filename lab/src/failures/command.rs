//! `myriorama-lab study failures`.

use std::path::PathBuf;

use app_core::exit::{BadInput, Outcome};
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::GpuEngine;
use node::Engine as _;
use report::Report;

use super::curves;
use super::report::{Result as CurveResult, add_to};
use super::stand::Stand;

/// Measures the curves of docs/failures.md; `cargo test -p lab failures` measures the same at a small size.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study failures                    all curves
  myriorama-lab study failures --quick --strict   in small pictures; exit status 1 if a shape is lost
  myriorama-lab study failures --curve steps      only the curves whose names contain \"steps\"")]
pub struct FailuresArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// Where the report goes
    #[arg(long, default_value = "out/study/failures", value_name = "DIR")]
    out: PathBuf,
    /// Measures at the tests' size: pictures of 64×48 and fewer values
    #[arg(long)]
    quick: bool,
    /// Only curves whose names contain this text, in any case
    #[arg(long = "curve", value_name = "TEXT")]
    curves: Vec<String>,
    /// Exit status 1 when a curve has lost its shape
    #[arg(long)]
    strict: bool,
}

impl FailuresArgs {
    fn wants(&self, name: &str) -> bool {
        let name = name.to_lowercase();
        self.curves.is_empty() || self.curves.iter().any(|text| name.contains(&text.to_lowercase()))
    }
}

/// Measures the curves and writes the report.
///
/// # Errors
/// No curve has such a name, or the folder cannot be written. A curve that cannot be measured is one that does not hold.
pub fn run(args: &FailuresArgs) -> anyhow::Result<Outcome> {
    let wanted: Vec<_> = curves::all().filter(|curve| args.wants(curve.name)).collect();
    if wanted.is_empty() {
        return Err(BadInput(format!("no curve's name contains {:?}", args.curves)).into());
    }
    let engine = GpuEngine::shared(args.device.device)?;
    let stand = Stand::new(&engine, args.quick);
    let mut report = Report::new("Myriorama study: failures", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("views", format!("{}×{}", stand.view_px.x, stand.view_px.y));
    report.parameter("sample images", format!("{}×{}", stand.sample_px.x, stand.sample_px.y));
    let progress = bar("curves", wanted.len());
    let mut results = Vec::with_capacity(wanted.len());
    for curve in wanted {
        progress.set_message(curve.name);
        results.push(CurveResult::of(curve, &stand));
        progress.inc(1);
    }
    progress.finish_and_clear();
    add_to(&mut report, &results)?;
    report.tables.iter().for_each(|table| println!("{}\n", table.to_text()));
    let ok = report.finish(&args.out)?;
    Ok(Outcome::of(ok || !args.strict))
}
