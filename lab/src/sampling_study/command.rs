//! `myriorama-lab study sampling`.

use std::path::PathBuf;

use app_core::exit::Outcome;
use clap::Args;

use super::distances::{distances, distances_report};
use super::extent::Extent;
use super::scene::SceneRow;
use super::sizes::{sizes, sizes_report};
use super::subject::{SCENES, Subject};
use super::tables::tables;
use super::times::{times, times_report};
use crate::failures::stand::Stand;
use crate::lit::sampling as shared_light;
use crate::study::RunArgs;

/// Samples a bird's nest, grass, a city and a tree from three viewpoints by every method. Reports redundant,
/// disoccluded and useful samples, their availability in output frames, also against the distance of the viewpoints, and the
/// costs of sampling. Then compares conventional images with those without covered pixels for shared light.
#[derive(Debug, Args)]
pub struct SamplingArgs {
    #[command(flatten)]
    study: RunArgs,
    /// Only these scenes: bird-nest, grass, urban, tree
    #[arg(long = "scene", value_name = "NAME", value_parser = SCENES)]
    scenes: Vec<String>,
    /// A folder that has FlightHelmet or whose subfolders have it, for shared light
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
}

/// Measures all scenes and writes the report.
///
/// # Errors
/// The device fails, or the folder cannot be written.
pub fn run(args: &SamplingArgs) -> anyhow::Result<Outcome> {
    let engine = args.study.engine()?;
    let extent = Extent::of(args.study.quick);
    let mut report = args.study.report("sampling", &engine);
    report.parameter("sample images", format!("3 of {0}×{0}", extent.side_px));
    report.parameter("views between them", extent.views);
    report.parameter("seeded samples an image", extent.seeds);
    let wanted =
        SCENES.into_iter().filter(|name| args.scenes.is_empty() || args.scenes.iter().any(|wanted| wanted == name));
    let mut rows = Vec::new();
    let mut costs = Vec::new();
    let mut by_distance = Vec::new();
    for name in wanted {
        let subject = Subject::load(&engine, name)?;
        // Times come first: they need the machine as it is.
        costs.push((subject.name.clone(), times(&subject, extent)?));
        rows.push(SceneRow::measure(&subject, extent, &mut report)?);
        sizes_report(&subject.name, &sizes(&subject, extent)?, &mut report)?;
        by_distance.extend(distances(&subject, extent)?);
    }
    tables(&rows, &mut report)?;
    distances_report(&by_distance, extent, &mut report)?;
    times_report(&costs, extent, &mut report)?;
    if args.scenes.is_empty() {
        shared_light::measure(&Stand::new(&engine, false), args.study.quick, args.models.as_deref(), &mut report)?;
    }
    args.study.finish("out/study/sampling", &report)
}
