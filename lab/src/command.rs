//! `myriorama study`: what a paper's experiments give here, its figures beside ours.

mod sampling;

use clap::Subcommand;

use crate::exit::Outcome;

/// Which.
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// How well sampling methods sample four kinds of scene: Tables 1 and 2, Fig. 6 and 7 of Xie et al., and more
    Sampling(sampling::SamplingArgs),
}

impl StudyCommand {
    /// Runs it to its end.
    ///
    /// # Errors
    /// The device's, or a folder that cannot be written.
    pub fn run(&self) -> anyhow::Result<Outcome> {
        match self {
            Self::Sampling(args) => sampling::run(args),
        }
    }
}
