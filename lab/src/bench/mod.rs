//! `myriorama-lab bench`: measured values against bars, as ratios of one run.

mod args;
mod errors;
mod light;
mod loaded;
mod run;
mod throughput;

pub use args::BenchArgs;
pub use run::run;
