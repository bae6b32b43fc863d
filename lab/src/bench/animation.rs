//! A scene that moves: trees refitted or rebuilt, and sampling through them.

use std::sync::Arc;
use std::time::Instant;

use app_core::progress::bar;
use app_core::setup::{SceneArgs, Setup};
use depth_image::Camera;
use engine::GpuEngine;
use render::{AccelerationReport, DrawWork, GpuScene, Lighting, Refinement, SamplePlanes, Visibility};
use report::{Axis, Bar, Check, Report, Series, Table, XyChart};

use super::args::BenchArgs;
use super::timing::in_turn;
use crate::statistics::median;

const WINDY: &str = "tree-terrain-500k-wind";
const WINDY_QUICK: &str = "tree-terrain-30k-wind";
/// Moments in tenths of a second. All other trees are refitted from that of moment 0.
const TENTHS: [u32; 6] = [1, 2, 3, 4, 5, 6];
const QUICK: usize = 3;
/// A skinned model of 50,000 triangles.
const SKINNED: &str = "snake";
/// Its frames, a thirtieth of a second apart: one round of its clip.
const FRAMES: u32 = 60;
const FRAMES_QUICK: u32 = 6;
/// Least share of its frames whose trees are refitted.
const LEAST_REFITTED: f64 = 0.8;
/// Most of a new tree's time that a frame may take until rays are ready.
const MOST_OF_A_BUILD: f64 = 0.5;
/// The lighting of the samples: all rays go through the tree.
const LIGHTING: &str = "shadows";
/// The cost ratio at which the renderer gives up a refitted tree.
const WORST_REFIT: f64 = 1.3;

/// A tree, and the time of sampling with it.
#[derive(Clone, Copy)]
struct Tree {
    report: AccelerationReport,
    /// Seconds until the tree is ready for rays, upload included.
    ready_s: f64,
    sample_set_s: f64,
}

/// The trees of one moment.
struct Moment {
    scene_time_s: f32,
    /// The renderer's choice.
    chosen: Tree,
    rebuilt: Tree,
}

/// Adds a table, a chart and checks.
pub fn measure(args: &BenchArgs, engine: &Arc<GpuEngine>, report: &mut Report) -> anyhow::Result<()> {
    let name = if args.quick { WINDY_QUICK } else { WINDY };
    let tenths = if args.quick { &TENTHS[..QUICK] } else { &TENTHS[..] };
    let times_s: Vec<f32> = tenths.iter().map(|&tenth| tenth as f32 * 0.1).collect();
    let windy = show(args, engine, (name, &times_s), report)?;
    report.checks.extend(checks(name, &windy));
    let frames = if args.quick { FRAMES_QUICK } else { FRAMES };
    let times_s: Vec<f32> = (1..=frames).map(|frame| frame as f32 / 30.0).collect();
    let skinned = show(args, engine, (SKINNED, &times_s), report)?;
    report.checks.extend(checks_of_frames(SKINNED, &skinned));
    Ok(())
}

/// Adds a scene's table and chart.
fn show(
    args: &BenchArgs,
    engine: &Arc<GpuEngine>,
    (name, times_s): (&str, &[f32]),
    report: &mut Report,
) -> anyhow::Result<Vec<Moment>> {
    let spec = fixtures::spec(name)?;
    let setup = SceneArgs::new(spec).load()?;
    engine.put_scene(setup.offer.hash.as_str(), &setup.scene)?;
    let scene = engine.scene(setup.offer.hash.as_str())?;
    let moments = moments(args, engine, &scene, (&setup, times_s))?;
    report.tables.push(table(name, &moments)?);
    report.charts.push(chart(name, &moments).into());
    Ok(moments)
}

fn moments(
    args: &BenchArgs,
    engine: &GpuEngine,
    scene: &GpuScene,
    (setup, times_s): (&Setup, &[f32]),
) -> anyhow::Result<Vec<Moment>> {
    let progress = bar("trees that move", 2 * times_s.len());
    let tree = |time_s: f32, made: fn(&GpuScene, f32) -> Result<AccelerationReport, render::RenderError>| {
        let start = Instant::now();
        let report = made(scene, time_s)?;
        let ready_s = start.elapsed().as_secs_f64();
        let sample_set_s = sample_set_s(args, engine, scene, setup, time_s)?;
        progress.inc(1);
        anyhow::Ok(Tree { report, ready_s, sample_set_s })
    };
    scene.forget_acceleration();
    scene.acceleration(0.0)?;
    // Trees are refitted one after the other, as in an animation, and then all rebuilt.
    let chosen = times_s.iter().map(|&t| tree(t, GpuScene::acceleration)).collect::<anyhow::Result<Vec<_>>>()?;
    let new = |scene: &GpuScene, time_s: f32| {
        scene.forget_acceleration();
        scene.acceleration(time_s)
    };
    let rebuilt = times_s.iter().map(|&t| tree(t, new)).collect::<anyhow::Result<Vec<_>>>()?;
    progress.finish_and_clear();
    let pairs = times_s.iter().copied().zip(chosen.into_iter().zip(rebuilt));
    Ok(pairs.map(|(scene_time_s, (chosen, rebuilt))| Moment { scene_time_s, chosen, rebuilt }).collect())
}

fn sample_set_s(
    args: &BenchArgs,
    engine: &GpuEngine,
    scene: &GpuScene,
    setup: &Setup,
    scene_time_s: f32,
) -> anyhow::Result<f64> {
    let cameras: Vec<Camera> = setup.samples.iter().copied().map(Camera::Pinhole).collect();
    let lighting: Lighting = LIGHTING.parse()?;
    let (visibility, refinement) = (Visibility::Measured, Refinement::default());
    let work = DrawWork { scene, lighting, scene_time_s, visibility, refinement, turn: Default::default() };
    let draw = |()| {
        engine.renderer.draw_depth_images(work, &cameras, SamplePlanes::default())?;
        Ok(())
    };
    Ok(in_turn(&[()], args.runs(), draw)?.into_iter().sum())
}

impl Moment {
    /// The ratio of the expected visits and tests of a random ray.
    fn cost_ratio(&self) -> f64 {
        f64::from(self.chosen.report.cost) / f64::from(self.rebuilt.report.cost)
    }
}

const COLUMNS: [(&str, &str); 8] = [
    ("scene time", "s"),
    ("way", ""),
    ("boxes", "ms"),
    ("upload", "ms"),
    ("ready after", "ms"),
    ("sample set", "ms"),
    ("expected visits and tests of a random ray", ""),
    ("over built anew", "×"),
];

fn table(scene: &str, moments: &[Moment]) -> anyhow::Result<Table> {
    let mut table = Table::new(format!("Trees that move, {scene}, samples with {LIGHTING}"), &COLUMNS);
    for moment in moments {
        let ways = [(&moment.chosen, Some(moment.cost_ratio())), (&moment.rebuilt, None)];
        for (tree, ratio) in ways {
            let way = if tree.report.refitted { "refitted" } else { "built anew" };
            let ms = [tree.report.build_s, tree.report.upload_s, tree.ready_s, tree.sample_set_s].map(|s| s * 1e3);
            let head = [f64::from(moment.scene_time_s).into(), way.into()];
            let tail = [tree.report.cost.into(), ratio.into()];
            table.push(head.into_iter().chain(ms.map(Into::into)).chain(tail))?;
        }
    }
    Ok(table)
}

fn chart(scene: &str, moments: &[Moment]) -> XyChart {
    let points = |tree: fn(&Moment) -> &Tree| {
        moments.iter().map(move |moment| (f64::from(moment.scene_time_s), f64::from(tree(moment).report.cost)))
    };
    let (x, y) = (Axis::linear("scene time", "s"), Axis::linear("expected visits and tests of a random ray", ""));
    XyChart::new(format!("Refitted trees, {scene}"), x, y)
        .with(Series::line("refitted from 0 s", points(|moment| &moment.chosen)))
        .with(Series::line("built anew", points(|moment| &moment.rebuilt)))
}

fn checks(scene: &str, moments: &[Moment]) -> [Check; 2] {
    let refitted: Vec<&Moment> = moments.iter().filter(|moment| moment.chosen.report.refitted).collect();
    let worst = refitted.iter().map(|moment| moment.cost_ratio()).fold(f64::NAN, f64::max);
    let none = "no tree was refitted";
    let found = |value: f64| Some(value).filter(|_| !refitted.is_empty());
    let way = format!("{scene}: time until rays are ready, the renderer's way over the other");
    let boxes = format!("{scene}: expected visits and tests, refitted tree over a new one, worst moment");
    [
        Check::maybe(way, found(chosen_over_other(moments, &refitted)), "×", Bar::AtMost(1.0), none),
        Check::maybe(boxes, found(worst), "×", Bar::AtMost(WORST_REFIT), none),
    ]
}

/// Frames in their order, as in a film.
fn checks_of_frames(scene: &str, moments: &[Moment]) -> [Check; 2] {
    let count = moments.iter().filter(|moment| moment.chosen.report.refitted).count();
    let ready_s = |tree: fn(&Moment) -> &Tree| moments.iter().map(|moment| tree(moment).ready_s).sum::<f64>();
    let ratio = ready_s(|moment| &moment.chosen) / ready_s(|moment| &moment.rebuilt);
    let share = count as f64 / moments.len() as f64;
    let all = format!("{scene}: share of {} frames whose tree is refitted", moments.len());
    let time = format!("{scene}: time until rays are ready, all frames, over a new tree each");
    [
        Check::new(all, share, "", Bar::AtLeast(LEAST_REFITTED)),
        Check::new(time, ratio, "×", Bar::AtMost(MOST_OF_A_BUILD)),
    ]
}

/// The first moment is refitted to measure a refit; the last moment shows the renderer's choice.
fn chosen_over_other(moments: &[Moment], refitted: &[&Moment]) -> f64 {
    let refit_s = median(refitted.iter().map(|moment| moment.chosen.ready_s).collect());
    let build_s = median(moments.iter().map(|moment| moment.rebuilt.ready_s).collect());
    match moments.last() {
        Some(last) if last.chosen.report.refitted => refit_s / build_s,
        _ => build_s / refit_s,
    }
}
