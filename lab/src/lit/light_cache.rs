//! `myriorama-lab study light_cache`: views whose light comes from samples, against direct drawing at equal error.

use std::path::PathBuf;

use anyhow::Context as _;
use app_core::exit::{BadInput, Outcome};
use clap::Args;
use depth_image::LightCacheQuality::{self, Balanced, Draft, Fast, Fine};
use render::Lighting;
use report::{Bar, Check};

use super::light::{DIRECT_RAYS, Light, SAMPLES_A_PIXEL};
use super::measure::{LightFront, LitRows};
use super::report::add_to;
use super::subject::{OrbitViews, SetOptions, Subject, VIEW_PX};
use crate::failures::stand::Stand;
use crate::statistics::geometric_mean;
use crate::study::{RunArgs, check_if_measured, is_named};

/// The lighting of samples and of views that use them, unless another is given.
const LIGHTING: &str = "soft 16, occlusion 16";
const RUNS: usize = 3;
const QUALITIES: [LightCacheQuality; 4] = [Draft, Fast, Balanced, Fine];
/// Scenes under occlusion: models of a folder, built-in ones, and views inside. Quick runs measure others.
const OCCLUSION: [&str; 10] = [
    "FlightHelmet",
    "lamborghini",
    "ingenuity",
    "threejs-shaderball",
    "urban",
    "courtyard",
    "bird-nest",
    EXPENSIVE_SCENE,
    "urban, inside",
    "courtyard, inside",
];
const QUICK_OCCLUSION: [&str; 3] = ["lamborghini", "courtyard", "tree-terrain-125k"];
/// Scenes under indirect light; the quick ones come first.
const INDIRECT: [&str; 4] = ["courtyard, inside", "gallery", "urban, inside", EXPENSIVE_SCENE];
const QUICK_INDIRECT: usize = 2;
/// Numbers of rays of direct drawing under occlusion: more than 16 rays change little.
const OCCLUSION_RAYS: usize = 5;
/// The scene that gains most.
const EXPENSIVE_SCENE: &str = "tree-terrain-500k";

/// Measures views with light from samples against direct drawing with few rays, at equal error.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study light_cache --models models/ --strict   exit status 1 when a check falls short
  myriorama-lab study light_cache --models models/ --views 1  the figures of docs/benchmarks.md
  myriorama-lab study light_cache --quick --subject courtyard
  myriorama-lab study light_cache --lighting \"soft 16, indirect 64\" --views 1   the gain of sharing indirect light")]
pub struct LightCacheArgs {
    #[command(flatten)]
    study: RunArgs,
    /// A folder that has, or whose subfolders have, FlightHelmet, lamborghini, ingenuity and threejs-shaderball
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// The lighting, with occlusion or with indirect light; its rays are those of samples
    #[arg(long, default_value = LIGHTING, value_name = "TERMS")]
    lighting: Lighting,
    /// Views of a scene, from the first of eight places on an orbit
    #[arg(long, default_value_t = 8, default_value_if("quick", "true", "2"), value_name = "N",
        value_parser = clap::value_parser!(u8).range(1..=8))]
    pub views: u8,
    /// Only subjects whose names contain this text, in any case
    #[arg(long = "subject", value_name = "TEXT")]
    subjects: Vec<String>,
}

/// Measures all subjects and writes the report.
///
/// # Errors
/// There is no such subject, the folder of models lacks one, the device fails, or the report cannot be written.
pub fn run(args: &LightCacheArgs) -> anyhow::Result<Outcome> {
    let lighting = args.lighting;
    if lighting.ambient.is_none() || lighting.shadow_rays() == 0 {
        let reason = "the study needs rays to lamps, and occlusion or indirect light";
        return Err(BadInput(format!("--lighting \"{lighting}\": {reason}")).into());
    }
    let light = Light::of(&lighting);
    let mut subjects = Vec::new();
    for &name in scene_names(light, args.study.quick).iter().filter(|name| is_named(name, &args.subjects)) {
        subjects.extend(Subject::new(name, args.models.as_deref())?);
    }
    if subjects.is_empty() {
        return Err(BadInput(format!("no subject's name contains {:?}", args.subjects)).into());
    }
    let engine = args.study.engine()?;
    let stand = Stand::new(&engine, false);
    let mut report = args.study.report("light_cache", &engine);
    report.parameter("views", format!("{} of {VIEW_PX}, {SAMPLES_A_PIXEL} samples a pixel", args.views));
    let rows = LitRows {
        direct: &DIRECT_RAYS[..if light == Light::Occlusion { OCCLUSION_RAYS } else { DIRECT_RAYS.len() }],
        qualities: &QUALITIES,
        sets: vec![SetOptions::DEFAULT],
        has_joint_carve: false,
        views: OrbitViews { count: args.views.into(), size_px: VIEW_PX },
        runs: if args.study.quick { 1 } else { RUNS },
    };
    let mut fronts = Vec::new();
    for subject in subjects {
        let front = rows.measure(&stand, &subject, lighting).context(subject.name)?;
        add_to(&mut report, &front)?;
        fronts.push(front);
    }
    report.checks.extend(match light {
        Light::Occlusion => occlusion_checks(&fronts),
        Light::Indirect => fronts.iter().flat_map(indirect_checks).collect(),
    });
    args.study.finish("out/study/light_cache", &report)
}

/// The scenes that are compared with direct drawing.
fn scene_names(light: Light, is_quick: bool) -> &'static [&'static str] {
    match (light, is_quick) {
        (Light::Indirect, true) => &INDIRECT[..QUICK_INDIRECT],
        (Light::Indirect, false) => &INDIRECT,
        (Light::Occlusion, true) => &QUICK_OCCLUSION,
        (Light::Occlusion, false) => &OCCLUSION,
    }
}

fn occlusion_checks(fronts: &[LightFront]) -> Vec<Check> {
    let outside = fronts.iter().filter(|front| !front.is_interior);
    let gains: Vec<f64> = outside.map(best_gain).collect();
    let expensive = fronts.iter().find(|front| front.subject == EXPENSIVE_SCENE).map(best_gain);
    let least = gains.iter().copied().reduce(f64::min);
    let missing = "no scene outside is measured";
    let gained = [
        (EXPENSIVE_SCENE, expensive, 2.5, "the scene is not measured"),
        ("geometric mean", geometric_mean(&gains), 1.0, missing),
        ("least", least, 0.8, missing),
    ]
    .map(|(what, gain, bar, missing)| {
        let name = format!("gain of the best quality at equal FLIP, {what}");
        check_if_measured(name, gain, "×", Bar::AtLeast(bar), missing)
    });
    [(Balanced, 0.022), (Fast, 0.033)]
        .into_iter()
        .map(|(quality, most)| {
            let flips = fronts.iter().filter_map(|front| Some(front.at_quality(quality)?.flip));
            let name = format!("`{quality}`, {} scenes: greatest FLIP", fronts.len());
            check_if_measured(name, flips.reduce(f64::max), "", Bar::AtMost(most), "no scene")
        })
        .chain(gained)
        .collect()
}

fn best_gain(front: &LightFront) -> f64 {
    front.rows.iter().filter(|row| row.is_shared()).map(|row| front.gain(row)).fold(0.0, f64::max)
}

/// The gain of `balanced` in a scene with indirect light.
fn indirect_checks(front: &LightFront) -> Option<Check> {
    let least = match front.subject {
        "courtyard, inside" => 20.0,
        "gallery" => 10.0,
        "urban, inside" => 4.0,
        _ => 5.0,
    };
    let gain = front.gain(front.at_quality(Balanced)?);
    let name = format!("`balanced`, indirect light, {}: gain at equal FLIP", front.subject);
    Some(Check::new(name, gain, "×", Bar::AtLeast(least)))
}
