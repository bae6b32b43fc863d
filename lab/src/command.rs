//! Subcommands of the lab.

use app_core::exit::Outcome;
use clap::Subcommand;

use crate::bench::{self, BenchArgs};
use crate::budgets::command::{self as planner, PlannerArgs};
use crate::compare::command::{self as compare, CompareArgs};
use crate::failures::command::{self as failures, FailuresArgs};
use crate::impostors::command as impostors;
use crate::lages::{self, LagesArgs};
use crate::layered::command as layered;
use crate::lit::fronts_command::{self as fronts, FrontsArgs};
use crate::lit::light_cache::{self, LightCacheArgs};
use crate::sampling_study::command::{self as sampling, SamplingArgs};
use crate::scene_file::{self, SceneFileArgs};
use crate::shadows::command as shadows;
use crate::stability::command::{self as stability, StabilityArgs};
use crate::study::RunArgs;

/// A subcommand that measures.
#[derive(Debug, Subcommand)]
pub enum LabCommand {
    /// Measures speed and accuracy against bars and writes a report
    Bench(Box<BenchArgs>),
    /// Repeats the experiments of a paper, or draws how methods fail, and writes a report
    #[command(subcommand)]
    Study(Box<StudyCommand>),
    /// Writes a scene as a GLB file, for the program
    Scene(SceneFileArgs),
}

/// A study.
#[derive(Debug, Subcommand)]
pub enum StudyCommand {
    /// Repeats the experiment of Lages et al.: total time against the number of views, the time of each stage, and K
    Lages(Box<LagesArgs>),
    /// Measures how well methods sample four kinds of scene: Tables 1 and 2, Fig. 6 and 7 of Xie et al., and more
    Sampling(SamplingArgs),
    /// Draws how methods fail, as curves, and checks their shapes
    ///
    /// A curve is a figure over what makes a method fail, such as the error against the number of steps, with the shape
    /// that it must have: "falls, then is flat". The report has a chart of each curve, and a table of shapes with the
    /// reasons. A curve that has lost its shape names the first value that is off. docs/failures.md lists all curves.
    ///
    /// Errors of pictures are those of the foreground: of the pixels that show a surface.
    Failures(FailuresArgs),
    /// Charts cost against error of shared and of direct light
    ///
    /// The rows are qualities of light_cache with sample sets of several sizes, joint_carve, and direct drawing with 1 to 64
    /// rays, under expensive light. docs/fronts.md explains how to read the charts.
    Fronts(FrontsArgs),
    /// Measures how well images of a mirror's surroundings answer its rays
    ///
    /// Views of a teapot before a dented mirror are made with images of the mirror's surroundings, pinhole and single-pole images of
    /// equal texels, and compared with direct drawing. Then single rays off the mirror are followed towards the teapot. At last a
    /// mirror teapot stands in a maze, which graph cameras, pinholes and a layered cube take images of. --quick
    /// takes six views in hard shadows, in place of 24 in soft light.
    Impostors(RunArgs),
    /// Repeats Table 1 of Lischinski and Rappoport: layered depth cubes, light fields, and both baselines
    ///
    /// Views of the paper's kinds of scene walk through a layered depth cube. Beside them stand the paper's own ways to primary
    /// rays, projecting all samples and quadtrees of depths, and direct drawing. Mirrors and glossy surfaces are followed by
    /// rays, or gathered in layered light fields.
    Layered(RunArgs),
    /// Measures views with light from samples against direct drawing with few rays, at equal error
    ///
    /// For each scene the report has the time and the errors of direct drawing with few and many rays, and of each quality of
    /// light_cache, and the gain: the time of direct drawing with the fewest rays that reaches a quality's FLIP, over the
    /// quality's time. docs/benchmarks.md says how they are measured.
    #[command(name = "light_cache")]
    LightCache(LightCacheArgs),
    /// Repeats Tables 3 to 5 and Figs 8 and 9 of Xie et al.: soft shadows from samples of what a lamp sees
    ///
    /// Four scenes under a lamp of 16×16 places, by four samplings, sizes of images and lamps, and numbers of triangles. Errors are
    /// those against shadow maps of the scene and against rays, from 0 to 255. Charts have error against time for rays, maps and
    /// samples. docs/methods/lamp_samples.md says when to use which.
    Shadows(RunArgs),
    /// Measures how errors change from frame to frame, and the jump where samples change
    Stability(StabilityArgs),
    /// Compares the plans of budgets with tables of all rows
    ///
    /// For each scene the report has cost and error of every row among which a budget chooses, on views that no plan sees, and plans
    /// for budgets that the seed draws: the price of each choice over that of the cheapest row that keeps the budget, and whether
    /// the budget is kept. docs/planner.md has figures.
    Planner(PlannerArgs),
    /// Compares two reports of `study planner`
    Compare(CompareArgs),
}

impl LabCommand {
    /// Runs the subcommand to its end.
    ///
    /// # Errors
    /// Input that cannot be used, or a failure of the device, the cluster or the report's folder.
    pub fn run(&self) -> anyhow::Result<Outcome> {
        match self {
            Self::Bench(args) => bench::run(args),
            Self::Study(study) => study.run(),
            Self::Scene(args) => scene_file::run(args),
        }
    }
}

impl StudyCommand {
    fn run(&self) -> anyhow::Result<Outcome> {
        match self {
            Self::Lages(args) => lages::run(args),
            Self::Sampling(args) => sampling::run(args),
            Self::Failures(args) => failures::run(args),
            Self::Fronts(args) => fronts::run(args),
            Self::Impostors(args) => impostors::run(args),
            Self::Layered(args) => layered::run(args),
            Self::Shadows(args) => shadows::run(args),
            Self::LightCache(args) => light_cache::run(args),
            Self::Stability(args) => stability::run(args),
            Self::Planner(args) => planner::run(args),
            Self::Compare(args) => compare::run(args),
        }
    }
}
