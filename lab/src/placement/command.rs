//! The command, its measurement and its report.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context as _;
use app_core::exit::Outcome;
use app_core::planning::Planning;
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use depth_image::{Antialias, Camera, SampleImage, ViewPlanes, nested_places};
use engine::GpuEngine;
use metrics::holding_images;
use node::{Engine as _, Turn, WorkClass};
use probe::{Light, Representation};
use report::{Cell, Report, Table};

use super::coverage::Coverage;
use crate::fronts::conditions::{self, Conditions};
use crate::fronts::row::default_place;
use crate::fronts::subject::Subject;
use crate::statistics::geometric_mean;

/// Views of a subject, and those that are drawn at once.
const VIEWS: usize = 32;
const VIEWS_A_CALL: usize = 8;
/// Numbers of sample cameras.
const CAMERA_COUNTS: [usize; 6] = [1, 2, 3, 4, 6, 8];
/// All places of a view cell.
const PLACES: usize = 9;
/// The row whose size of images is taken.
const DEFAULT_CAMERAS: u32 = 4;

/// Measures the disocclusion of views by sample cameras at places in the fixed order of the ladder, at places that are chosen
/// for the scene one after another, and at the best of all.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study placement
  myriorama-lab study placement --subject urban")]
pub struct PlacementArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// Where the report goes
    #[arg(long, default_value = "out/study/placement", value_name = "DIR")]
    out: PathBuf,
    /// Only subjects whose names contain this text, in any case
    #[arg(long = "subject", value_name = "TEXT")]
    subjects: Vec<String>,
}

/// The disocclusion of one subject with a number of cameras.
#[derive(Debug, Clone, Copy)]
struct Placed {
    fixed: f64,
    greedy: f64,
    best: f64,
}

/// Measures all subjects and writes the report.
///
/// # Errors
/// A subject cannot be used, the device fails, or the folder cannot be written.
pub fn run(args: &PlacementArgs) -> anyhow::Result<Outcome> {
    let engine = GpuEngine::shared(args.device.device)?;
    let all = conditions::read(None)?;
    let wanted = if args.subjects.is_empty() { all } else { conditions::named(all, &args.subjects)? };
    let progress = bar("subjects", wanted.len());
    let mut subjects = Vec::with_capacity(wanted.len());
    for conditions in wanted {
        let coverage = coverage(&engine, &conditions).with_context(|| format!("subject {:?}", conditions.name))?;
        subjects.push((conditions.name, CAMERA_COUNTS.map(|count| placed(&coverage, count))));
        progress.inc(1);
    }
    progress.finish_and_clear();
    let mut report = Report::new("Myriorama study: placement", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("views", VIEWS);
    let means = means_table(&subjects)?;
    println!("{}", means.to_text());
    report.tables.extend([subjects_table(&subjects)?, means]);
    Ok(Outcome::of(report.finish(&args.out)?))
}

fn placed(coverage: &Coverage, count: usize) -> Placed {
    // One camera stands in the middle; more stand in the order of the places.
    let fixed = nested_places(count).iter().filter_map(|place| nested_places(PLACES).iter().position(|at| at == place));
    let fixed = fixed.fold(0, |set, place| set | 1 << place);
    let [fixed, greedy, best] =
        [fixed, coverage.greedy(count), coverage.best(count)].map(|set| coverage.disocclusion(set));
    Placed { fixed, greedy, best }
}

/// The surfaces of a subject's views, by the places that see them.
fn coverage(engine: &Arc<GpuEngine>, conditions: &Conditions) -> anyhow::Result<Coverage> {
    let planning = Subject::load(engine, conditions)?.planning(Antialias::NONE, conditions.seed)?;
    let turn = Turn::of(WorkClass::Batch);
    let of = all_places(&planning)?;
    let work = planning.subject.sample_work(engine.as_ref(), &of, Light::Screening)?;
    let images = SampleImage::depth_images(engine.sample(&work, turn)?)?;
    let mut coverage = Coverage::new(PLACES);
    for cameras in planning.viewpoints.first(VIEWS).chunks(VIEWS_A_CALL) {
        let work = planning.subject.direct_work(cameras.to_vec(), Light::Screening, ViewPlanes::WITH_DEPTH);
        for (camera, view) in cameras.iter().zip(engine.draw_direct(&work, turn)?) {
            let depth = view.inverse_depth_per_m.context("a view without depth")?;
            coverage.add(holding_images(camera, &depth, &images)?);
        }
    }
    Ok(coverage)
}

/// A conventional image from every place, as large as those of the default row.
fn all_places(planning: &Planning) -> anyhow::Result<Representation> {
    let usual = &planning.representations[default_place(&planning.ladder, DEFAULT_CAMERAS)?];
    let sample = usual.sample_cameras.first().context("no sample cameras")?.reference();
    let cameras = planning.viewpoints.cell.nested_cameras(PLACES, sample.size_px);
    Ok(Representation { sample_cameras: cameras.into_iter().map(Camera::Pinhole).collect(), ..usual.clone() })
}

fn subjects_table(subjects: &[(String, [Placed; CAMERA_COUNTS.len()])]) -> anyhow::Result<Table> {
    let columns = [("subject", ""), ("S", ""), ("fixed order", "%"), ("one after another", "%"), ("best of all", "%")];
    let mut table = Table::new("Disocclusion by places of sample cameras", &columns);
    for (name, placed) in subjects {
        for (count, Placed { fixed, greedy, best }) in CAMERA_COUNTS.iter().zip(placed) {
            let figures = [fixed, greedy, best].map(|ratio| Cell::from(100.0 * ratio));
            table.push([Cell::from(name.clone()), (*count).into()].into_iter().chain(figures))?;
        }
    }
    Ok(table)
}

/// Ratios to the fixed order, over the subjects that it leaves with disocclusion.
fn means_table(subjects: &[(String, [Placed; CAMERA_COUNTS.len()])]) -> anyhow::Result<Table> {
    let columns = [("S", ""), ("subjects", ""), ("one after another over fixed", ""), ("best of all over fixed", "")];
    let mut table = Table::new("Geometric means of ratios to the fixed order", &columns);
    for (place, &count) in CAMERA_COUNTS.iter().enumerate() {
        let of: Vec<Placed> = subjects.iter().map(|(_, placed)| placed[place]).filter(|of| of.best > 0.0).collect();
        let ratio = |figure: fn(&Placed) -> f64| {
            let ratios: Vec<f64> = of.iter().map(|of| figure(of) / of.fixed).collect();
            geometric_mean(&ratios).map_or(Cell::Missing, Cell::from)
        };
        table.push([count.into(), of.len().into(), ratio(|of| of.greedy), ratio(|of| of.best)])?;
    }
    Ok(table)
}
