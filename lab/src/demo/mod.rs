//! `myriorama demo`: the paper's experiment on this machine.

mod args;
mod beside;
mod charts;
mod light;
mod page;
mod pictures;
mod run;
mod showcase;
mod timing;
mod viewpoint;

pub use args::DemoArgs;
pub use run::run;
