//! Light sampled once and shared: its gain, highlights, still scenes, and reference views beside converged light.

use std::sync::Arc;

use app_core::experiment::{DeliverySettings, Experiment, PAPER_VIEWS, VIEW_SIZE_PX};
use app_core::progress::bar;
use app_core::setup::{SceneArgs, Setup};
use cluster::PolicyChoice;
use depth_image::ViewCell;
use engine::GpuEngine;
use render::Lighting;
use report::{Bar, Check, Report, Table};

use super::args::BenchArgs;
use crate::evaluation::mean_errors;
use crate::lighting_study::{self, Extent, FINE};
use crate::reference_views::ReferenceViews;
use crate::statistics::median;

/// The lighting whose picture counts as converged.
const CONVERGED: &str = "soft 256, occlusion 256";
/// The number of views that are compared with converged light.
const CONVERGED_VIEWS: usize = 4;
/// Repeats of two nearly equal times.
const RUNS_OF_NEAR_TIMES: usize = 5;
/// The perceptual roughness of the glossy scene.
const GLOSSY: f32 = 0.3;

/// Measures every lighting on the scene.
pub fn qualities(args: &BenchArgs, experiment: &Experiment, report: &mut Report) -> anyhow::Result<()> {
    let rows = lighting_study::measure(experiment, Extent::bench(args.quick))?;
    lighting_study::report(&rows, experiment.setup.scene.illumination.lights.len(), report)?;
    report.checks.extend(lighting_study::checks(&rows));
    still(args, experiment, report)
}

/// Measures a second set of a still scene: only c and e are spent on it.
fn still(args: &BenchArgs, experiment: &Experiment, report: &mut Report) -> anyhow::Result<()> {
    let views = if args.quick { 64 } else { PAPER_VIEWS };
    let settings =
        DeliverySettings { lighting: FINE.parse()?, sets: 2, ..experiment.delivery(PolicyChoice::Pipeline, views) };
    let mut waited_s = 0.0_f64;
    let delivered = experiment.deliver(settings, |frame| {
        if frame.request.set_index == 1 {
            waited_s = waited_s.max(frame.header.stage_times.set_wait_s);
        }
    })?;
    let set_s = experiment.setup.samples.len() as f64 * delivered.plan.costs.sample_image_s;
    let name = "still scene: longest wait of a second frame for its samples, over sampling them";
    report.checks.push(Check::new(name, waited_s / set_s, "", Bar::AtMost(0.01)));
    Ok(())
}

/// The errors of views against converged light: from shared samples, and drawn with as many rays.
pub fn reference(args: &BenchArgs, experiment: &Experiment, report: &mut Report) -> anyhow::Result<()> {
    let views = experiment.views(if args.quick { 1 } else { CONVERGED_VIEWS })?;
    let progress = bar("converged light", 3);
    let take = |lighting: Lighting| {
        let lit = SceneArgs { lighting, ..experiment.args.clone() };
        let reference = ReferenceViews::draw(&experiment.engine, &experiment.setup, &lit, views.clone());
        progress.inc(1);
        reference
    };
    let (unlit, fine) = (take(Lighting::UNLIT)?, take(FINE.parse()?)?);
    let converged = fine.drawn(&experiment.setup, CONVERGED.parse()?)?;
    progress.finish_and_clear();
    let reconstructed = |reference: &ReferenceViews| reference.reconstruct(args.scene.method(), Default::default());
    let shared = mean_errors(&converged, &reconstructed(&fine)?)?;
    let drawn = mean_errors(&converged, &fine.views)?;
    let geometry = mean_errors(&unlit.views, &reconstructed(&unlit)?)?;
    let mut table = Table::new("Light beside converged light", &[("views", ""), ("foreground FLIP", ""), ("FLIP", "")]);
    let rows = [
        (format!("pipeline, {FINE}"), shared),
        (format!("direct, {FINE}"), drawn),
        ("pipeline beside direct, unlit".to_owned(), geometry),
    ];
    for (name, [foreground, whole]) in rows {
        table.push([name.into(), foreground.flip.into(), whole.flip.into()])?;
    }
    report.tables.push(table);
    let [plain, lit] = ms_in_turn(args, [&unlit, &fine])?;
    let name = format!("c with {FINE} over c unlit");
    report.checks.push(Check::new(name, lit / plain, "×", Bar::AtMost(1.25)));
    let name = "FLIP to converged light: the pipeline's over direct's plus the unlit pipeline's";
    let [foreground, whole] = [0, 1].map(|part| shared[part].flip / (drawn[part].flip + geometry[part].flip));
    report.checks.push(Check::new(name, whole, "×", Bar::AtMost(1.0)).with_foreground(foreground));
    Ok(())
}

/// Milliseconds a view of both, as medians. Both take turns, so that neither has the quieter machine.
fn ms_in_turn(args: &BenchArgs, both: [&ReferenceViews; 2]) -> anyhow::Result<[f64; 2]> {
    let mut ms = [Vec::new(), Vec::new()];
    for _ in 0..args.runs().max(RUNS_OF_NEAR_TIMES) {
        for (ms, reference) in ms.iter_mut().zip(both) {
            ms.push(reference.ms_a_view(args.scene.method(), PAPER_VIEWS, 1)?);
        }
    }
    Ok(ms.map(median))
}

/// Measures c where every surface has a highlight.
pub fn glossy(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let scene = glossy_scene(args)?;
    engine.put_scene(scene.offer.hash.as_str(), &scene.scene)?;
    let cell = ViewCell::between(&scene.around).ok_or_else(|| anyhow::anyhow!("no sample cameras"))?;
    let take = |lighting: Lighting| {
        let lit = SceneArgs { lighting, ..args.scene.clone() };
        ReferenceViews::draw(engine, &scene, &lit, cell.spread(args.compared_views(), VIEW_SIZE_PX))
    };
    let both = [take(Lighting::UNLIT)?, take("shadows".parse()?)?];
    let [unlit, lit] = ms_in_turn(args, [&both[0], &both[1]])?;
    let mut table = Table::new("Highlights everywhere", &[("lighting", ""), ("c a view", "ms")]);
    table.push(["unlit".into(), unlit.into()])?;
    table.push(["shadows, with highlights".into(), lit.into()])?;
    report.tables.push(table);
    let name = format!("{} made glossy: c with highlights over c unlit", args.scene.scene);
    report.checks.push(Check::new(name, lit / unlit, "×", Bar::AtMost(1.25)));
    Ok(())
}

fn glossy_scene(args: &BenchArgs) -> anyhow::Result<Setup> {
    args.scene.load_changed(|scene| scene.materials.iter_mut().for_each(|material| material.roughness = GLOSSY))
}
