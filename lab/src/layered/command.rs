//! The study and its report.

use app_core::exit::Outcome;

use super::{baselines, glossy, light_fields, table_one};
use crate::failures::stand::Stand;
use crate::study::RunArgs;

/// Measures the paper's scenes and writes the report.
///
/// # Errors
/// The device fails, or the folder cannot be written.
pub fn run(args: &RunArgs) -> anyhow::Result<Outcome> {
    let engine = args.engine()?;
    let stand = Stand::new(&engine, false);
    let mut report = args.report("layered depth cubes", &engine);
    baselines::measure(&stand, args.quick, &mut report)?;
    light_fields::measure(&stand, args.quick, &mut report)?;
    glossy::measure(&stand, args.quick, &mut report)?;
    table_one::measure(&stand, &mut report)?;
    args.finish("out/study/layered", &report)
}
