//! `myriorama-lab study light_cache`: views whose light comes from samples, against direct drawing at equal error.

mod measure;
mod subjects;

use std::path::PathBuf;

use anyhow::Context as _;
use app_core::exit::{BadInput, Outcome};
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::GpuEngine;
use node::Engine as _;
use render::Lighting;
use report::{Axis, Bar, Cell, Check, Report, Series, Table, XyChart};

use crate::failures::stand::Stand;
use crate::lit_views::light::{Light, SAMPLES_A_PIXEL};
use crate::lit_views::subject::{Subject, VIEW_PX};
use crate::section;
use crate::statistics::{geometric_mean, mean_and_variation, quantile};
use measure::{Measuring, Row, SHARED, SceneResult, check, measure};
use subjects::{CONDITIONS, Condition, LIGHTING, OUTSIDE_SCENES, scene_names};

const RUNS: usize = 3;
/// The scene that gains most.
const EXPENSIVE_SCENE: &str = "tree-terrain-500k";
/// Scenes whose look-ups are compared with their surfaces.
const LOOK_UP_SCENES: [&str; 4] = ["FlightHelmet", EXPENSIVE_SCENE, "courtyard", "urban"];

/// Measures views with light from samples against direct drawing with few rays, at equal error.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study light_cache --models models/ --strict   exit status 1 when a check falls short
  myriorama-lab study light_cache --models models/ --views 1  the figures of docs/benchmarks.md
  myriorama-lab study light_cache --quick --subject courtyard
  myriorama-lab study light_cache --lighting \"soft 16, indirect 64\" --views 1   the gain of sharing indirect light")]
pub struct LightCacheArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// Where the report goes
    #[arg(long, default_value = "out/study/light_cache", value_name = "DIR")]
    out: PathBuf,
    /// A folder with the models FlightHelmet, lamborghini, ingenuity and threejs-shaderball, or with subfolders that have them
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// The lighting, with occlusion or with indirect light; its rays are those of samples
    #[arg(long, default_value = LIGHTING, value_name = "TERMS")]
    lighting: Lighting,
    /// Measures a few scenes once, in two views unless --views is given
    #[arg(long)]
    quick: bool,
    /// Views of a scene, from the first of eight places on an orbit
    #[arg(long, default_value_t = 8, default_value_if("quick", "true", "2"), value_name = "N",
        value_parser = clap::value_parser!(u8).range(1..=8))]
    pub views: u8,
    /// Only subjects whose names contain this text, in any case
    #[arg(long = "subject", value_name = "TEXT", default_value = "")]
    subject: String,
    /// Exit status 1 when a check falls short
    #[arg(long)]
    strict: bool,
}

/// Measures all subjects and writes the report.
///
/// # Errors
/// There is no such subject, the folder of models lacks one, the device fails, or the report cannot be written.
pub fn run(args: &LightCacheArgs) -> anyhow::Result<Outcome> {
    let is_wanted = |name: &str| name.to_lowercase().contains(&args.subject.to_lowercase());
    let models = args.models.as_deref();
    let mut subjects = Vec::new();
    if args.lighting.ambient.is_none() || args.lighting.shadow_rays() == 0 {
        let reason = "the study needs rays to lamps, and occlusion or indirect light";
        return Err(BadInput(format!("--lighting \"{}\": {reason}", args.lighting)).into());
    }
    let light = Light::of(&args.lighting);
    for name in scene_names(light, args.quick).into_iter().filter(|name| is_wanted(name)) {
        subjects.extend(Subject::new(name, models)?);
    }
    let has_conditions = !args.quick && light == Light::Occlusion;
    let conditions = CONDITIONS.iter().filter(|condition| has_conditions && is_wanted(condition.name));
    let conditions: Vec<&Condition> = conditions.collect();
    if subjects.is_empty() && conditions.is_empty() {
        return Err(BadInput(format!("no subject's name contains {:?}", args.subject)).into());
    }
    let engine = GpuEngine::shared(args.device.device)?;
    let stand = Stand::new(&engine, false);
    let progress = bar("scenes", subjects.len() + conditions.len());
    let mut report = Report::new("Myriorama study: light_cache", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("views", format!("{} of {VIEW_PX}, {SAMPLES_A_PIXEL} samples a pixel", args.views));
    report.parameter("lighting", args.lighting.to_string());
    let runs = if args.quick { 1 } else { RUNS };
    let plan = Measuring { lighting: args.lighting, view_count: args.views.into(), runs };
    let mut results = Vec::new();
    for subject in subjects {
        progress.set_message(subject.name);
        results.push(measure(&stand, &subject, plan).context(subject.name)?);
        progress.inc(1);
    }
    if !results.is_empty() {
        add_to(&mut report, light, results)?;
    }
    for condition in conditions {
        progress.set_message(condition.name);
        check(&stand, condition, models, &mut report).context(condition.name)?;
        progress.inc(1);
    }
    progress.finish_and_clear();
    section::finish(report, Vec::new(), &args.out, args.strict)
}

fn add_to(report: &mut Report, light: Light, results: Vec<SceneResult>) -> anyhow::Result<()> {
    let columns = [
        ("scene", ""),
        ("light", ""),
        ("a view", "ms"),
        ("PSNR", "dB"),
        ("FLIP", ""),
        ("FLIP against the truth", ""),
        ("unknown", "%"),
        ("gain at equal FLIP", "×"),
    ];
    let mut rows = Table::new("Views of each scene", &columns);
    let mut look_ups = Table::new("`draft`, 1 sample a pixel", &[("scene", ""), ("look-up over surfaces", "×")]);
    for result in &results {
        let curve = result.curve();
        for row in result.direct.iter().chain(&result.qualities) {
            let gain = row.unknown.map(|_| curve.gain(&row.point()));
            let unknown_percent = row.unknown.map(|share| share * 100.0);
            let numbers = [row.ms, row.psnr_db, row.flip, row.truth_flip].map(Cell::from);
            let names = [result.name.into(), row.name.as_str().into()];
            rows.push(names.into_iter().chain(numbers).chain([unknown_percent.into(), gain.into()]))?;
        }
        look_ups.push([result.name.into(), result.look_up_ratio.into()])?;
    }
    report.tables = vec![rows, look_ups];
    report.charts = results.iter().map(|result| chart(result).into()).collect();
    report.checks = match light {
        Light::Occlusion => [quality_checks(&results), gain_checks(&results), time_checks(&results)].concat(),
        Light::Indirect => results.iter().flat_map(indirect_checks).collect(),
    };
    report.pictures = results.into_iter().map(|result| result.pictures).collect();
    Ok(())
}

fn chart(result: &SceneResult) -> XyChart {
    let name = format!("FLIP over time, {}", result.name);
    let mut chart = XyChart::new(name, Axis::log("a view", "ms"), Axis::log("FLIP", ""));
    chart = chart.with(Series::line("direct", result.direct.iter().map(Row::point)));
    for row in &result.qualities {
        chart = chart.with(Series::points(row.name.clone(), [row.point()]));
    }
    chart.note = "Errors over the foreground against a truth with other noise.".to_owned();
    chart
}

fn quality_checks(results: &[SceneResult]) -> Vec<Check> {
    let mut checks = Vec::new();
    for (quality, mean_db, least_db, most_flip) in [("balanced", 43.0, 38.0, 0.022), ("fast", 39.0, 34.0, 0.033)] {
        let rows = results.iter().flat_map(|result| &result.qualities).filter(|row| row.name == quality);
        let (psnr_db, flip): (Vec<f64>, Vec<f64>) = rows.map(|row| (row.psnr_db, row.flip)).unzip();
        let name = |what: &str| format!("`{quality}`, {} scenes: {what}", results.len());
        let (mean, _) = mean_and_variation(&psnr_db);
        checks.push(Check::new(name("mean PSNR"), mean, "dB", Bar::AtLeast(mean_db)));
        checks.push(Check::new(name("least PSNR"), quantile(psnr_db, 0.0), "dB", Bar::AtLeast(least_db)));
        checks.push(Check::new(name("greatest FLIP"), quantile(flip, 1.0), "", Bar::AtMost(most_flip)));
    }
    checks
}

/// Those of `balanced` in a scene with indirect light: error, gain, and the time over that of surfaces without light.
fn indirect_checks(result: &SceneResult) -> Vec<Check> {
    let name = |what: &str| format!("`balanced`, indirect light, {}: {what}", result.name);
    let Some(row) = result.qualities.iter().find(|row| row.name == "balanced") else { return Vec::new() };
    let gain = result.gain(row);
    let over_unlit = row.ms / result.unlit_ms;
    let (least_gain, most_over_unlit) = match result.name {
        "courtyard, inside" => (20.0, Some(4.0)),
        "gallery" => (10.0, None),
        "urban, inside" => (4.0, Some(3.0)),
        _ => (5.0, None),
    };
    let flicker = "change of error from frame to frame over direct drawing with 4 rays";
    let mut checks = vec![
        Check::new(name("gain at equal FLIP"), gain, "×", Bar::AtLeast(least_gain)),
        Check::maybe(name(flicker), result.flicker_ratio, "×", Bar::AtMost(0.3), "not measured"),
    ];
    if result.name != EXPENSIVE_SCENE {
        checks.push(Check::new(name("FLIP"), row.flip, "", Bar::AtMost(0.017)));
    }
    if let Some(most) = most_over_unlit {
        checks.push(Check::new(name("time over unlit"), over_unlit, "×", Bar::AtMost(most)));
    }
    checks
}

fn gain_checks(results: &[SceneResult]) -> Vec<Check> {
    let best = |result: &SceneResult| {
        let gains = result.qualities.iter().map(|row| result.gain(row));
        gains.fold(0.0, f64::max)
    };
    let outside = || results.iter().filter(|result| !result.name.contains(", inside"));
    let gains: Vec<f64> = outside().map(best).collect();
    let expensive = outside().find(|result| result.name == EXPENSIVE_SCENE).map(best);
    let all = (gains.len() == OUTSIDE_SCENES).then(|| geometric_mean(&gains)).flatten();
    let not_all = format!("{} of {OUTSIDE_SCENES} outside scenes are measured", gains.len());
    let least = gains.into_iter().reduce(f64::min);
    let name = |what: &str| format!("gain of the best quality at equal FLIP, {what}");
    vec![
        Check::maybe(name(EXPENSIVE_SCENE), expensive, "×", Bar::AtLeast(2.5), "the scene is not measured"),
        Check::maybe(name("geometric mean"), all, "×", Bar::AtLeast(1.3), not_all),
        Check::maybe(name("least"), least, "×", Bar::AtLeast(0.8), "no outside scene is measured"),
    ]
}

fn time_checks(results: &[SceneResult]) -> Vec<Check> {
    let compared = results.iter().filter(|result| LOOK_UP_SCENES.contains(&result.name));
    let look_ups: Vec<f64> = compared.map(|result| result.look_up_ratio).collect();
    let all = (look_ups.len() == LOOK_UP_SCENES.len()).then(|| geometric_mean(&look_ups)).flatten();
    let missing = format!("{} of {} are measured", look_ups.len(), LOOK_UP_SCENES.join(", "));
    let shared = results.iter().map(|result| result.direct[SHARED].ms / result.reference().ms);
    let shared = geometric_mean(&shared.collect::<Vec<_>>());
    let least_db = quantile(results.iter().map(|result| result.direct[SHARED].psnr_db).collect(), 0.0);
    vec![
        Check::maybe("`draft`, 1 sample a pixel: time of look-up over surfaces", all, "×", Bar::AtMost(0.9), missing),
        Check::maybe("direct: time with rays a pixel over rays a position", shared, "×", Bar::AtMost(0.45), "no scene"),
        Check::new("direct with rays a pixel: least PSNR", least_db, "dB", Bar::AtLeast(40.0)),
    ]
}
