//! `myriorama-lab bench`: measured values against bars, as ratios of one run.

mod adaptive;
mod animation;
mod antialias;
mod args;
mod codec;
mod convergence;
pub(crate) mod fronts;
mod light;
mod loaded;
mod peer;
mod plane_bits;
mod rays;
mod run;
mod sampling;
mod throughput;
pub(crate) mod timing;
mod view_cost;

pub use args::BenchArgs;
pub use run::run;
