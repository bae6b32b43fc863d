//! `myriorama demo`: the paper's experiment on this machine.

mod args;
mod beside;
mod charts;
mod light;
mod pictures;
mod run;
mod timing;

pub use args::DemoArgs;
pub use run::run;
