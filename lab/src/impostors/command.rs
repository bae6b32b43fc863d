//! The command and its report.

use std::path::PathBuf;

use app_core::exit::Outcome;
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use depth_image::Aabb;
use engine::GpuEngine;
use node::Engine as _;
use render::Lighting;
use report::{Axis, Bar, Cell, Check, Report, Series, Table, XyChart};
use sampling::{Impostors, Mirror};
use scene::{Limits, MissingTextures, Scene, SceneSpec};

use super::candidates::{UNFILTERED, candidates};
use super::costs::{self, Costs};
use super::measure::{Answer, Figures, Hall, VIEW_PX, around};
use super::{orders, reflectance, single_rays};
use crate::failures::stand::Stand;

/// Views around a scene.
const VIEWS: [usize; 2] = [24, 6];
const VIEW_COUNTS: [f64; 7] = [1.0, 3.0, 10.0, 30.0, 100.0, 290.0, 1000.0];
/// Views that are also compared with a truth of several rays a pixel.
const SMOOTH: usize = 3;
const LIGHTING: [&str; 2] = ["soft 16, occlusion 16, reflections 1", "shadows, reflections 1"];

/// Follows the rays off a scene's mirrors in images of their surroundings, and compares the views with direct drawing.
/// Errors are those of the pixels in which a mirror shows the scene, and those in which it shows an object. Then follows single
/// rays in images of pinholes and of single-pole cameras, off a flat patch, off mirrors and within a bowl. Charts the gain by the
/// number of views, and the change of colours by the number of mirrors on a ray's way.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study impostors
  myriorama-lab study impostors --quick --strict   in hard shadows; exit status 1 if a bar is missed")]
#[allow(rustdoc::broken_intra_doc_links, reason = "help has optional parts in brackets")]
pub struct ImpostorsArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// A built-in scene with mirrors, or a file
    #[arg(long, default_value = "teapot-mirror", value_name = "SPEC")]
    scene: SceneSpec,
    /// Images as in a cluster: auto[:UNSEEN] (percent), pinhole[:N] or single_pole[:N]
    #[arg(long, default_value_t, value_name = "NAME")]
    impostors: Impostors,
    /// Six views in hard shadows, in place of 24 in soft light
    #[arg(long)]
    quick: bool,
    /// Exit status 1 if a bar is missed
    #[arg(long)]
    strict: bool,
    /// Where the report goes
    #[arg(long, default_value = "out/study/impostors", value_name = "DIR")]
    out: PathBuf,
}

/// Measures all candidates and writes the report.
///
/// # Errors
/// The scene cannot be used or has no mirrors, the device fails, or the folder cannot be written.
pub fn run(args: &ImpostorsArgs) -> anyhow::Result<Outcome> {
    let scene = args.scene.load(&Limits::default(), MissingTextures::Refuse)?;
    anyhow::ensure!(args.impostors != Impostors::None, "--impostors none leaves no images to measure");
    let (mirrors, _) = sampling::mirrors(&scene, args.impostors);
    anyhow::ensure!(!mirrors.is_empty(), "{} has no mirrors", args.scene);
    let engine = GpuEngine::shared(args.device.device)?;
    let stand = Stand::new(&engine, false);
    let lighting: Lighting = LIGHTING[usize::from(args.quick)].parse()?;
    let views = around(&scene.bounds(), VIEWS[usize::from(args.quick)]);
    let hall = Hall::new(&stand, &scene, (lighting, SMOOTH), &views)?;
    let mut report = Report::new("Myriorama study: impostors", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("scene", args.scene.to_string());
    report.parameter("lighting", lighting.to_string());
    report.parameter("mirrored pixels that show an object (%)", hall.object_share() * 100.0);
    report.checks.extend(mirrors.iter().filter_map(|mirror| mirror.unseen_ratio).map(unseen_check));
    report.tables.push(choice_table(&mirrors)?);
    let rows = compared(&hall, &scene, &mirrors)?;
    report.tables.push(table(&rows)?);
    report.checks.extend(error_checks(&rows));
    single_rays::measure(&stand, args.quick, &mut report)?;
    let costs = costs::measure(&hall, &mirrors)?;
    report.tables.push(cost_table(&costs)?);
    report.checks.extend(cost_checks(&costs));
    report.charts.push(gain_chart(&costs).into());
    let (orders, growth) = orders::measure(&stand, lighting, args.impostors)?;
    report.tables.push(orders);
    report.checks.push(growth);
    let (light, fall) = reflectance::measure(&stand, args.impostors)?;
    report.charts.push(light.into());
    report.checks.push(fall);
    report.tables.iter().for_each(|table| println!("{}", table.to_text()));
    let holds = report.finish(&args.out)?;
    Ok(Outcome::of(holds || !args.strict))
}

/// The figures of the environment alone, and of each candidate for all mirrors.
fn compared(hall: &Hall<'_>, scene: &Scene, mirrors: &[Mirror]) -> anyhow::Result<Vec<(&'static str, Figures)>> {
    let seen = scene.bounds().center();
    let bounds: Vec<Aabb> = mirrors.iter().map(|mirror| mirror.bounds).collect();
    let single_poles = [1, 2].map(|images| sampling::mirrors(scene, Impostors::SinglePoles { images }).0);
    let of_mirror = |(number, mirror): (usize, &Mirror)| {
        candidates(mirror, seen, single_poles.each_ref().map(|mirrors| &mirrors[number])).into_iter()
    };
    let mut columns: Vec<_> = mirrors.iter().enumerate().map(of_mirror).collect();
    let progress = bar("candidates", columns.first().map_or(0, ExactSizeIterator::len) + 1);
    let mut rows = vec![("the environment alone", hall.figures(&bounds, &[])?)];
    progress.inc(1);
    loop {
        let own: Vec<_> = columns.iter_mut().filter_map(Iterator::next).collect();
        let Some(name) = own.first().map(|candidate| candidate.name) else { break };
        rows.push((name, hall.figures(&bounds, &own)?));
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok(rows)
}

fn table(rows: &[(&str, Figures)]) -> anyhow::Result<Table> {
    let columns = [
        ("images of the surroundings", ""),
        ("images", ""),
        ("texels", ""),
        ("objects: FLIP", ""),
        ("objects: PSNR", "dB"),
        ("objects: guessed", "%"),
        ("FLIP", ""),
        ("PSNR", "dB"),
        ("guessed", "%"),
        ("64 rays: objects, FLIP", ""),
        ("64 rays: FLIP", ""),
        ("64 rays: PSNR", "dB"),
    ];
    let mut table = Table::new("Pixels in which a mirror shows an object, and in which it shows the scene", &columns);
    for (name, figures) in rows {
        let counts = [figures.images, figures.texels].map(Cell::from);
        let numbers = |answer: &Answer| [answer.flip, answer.psnr_db, answer.guessed_ratio * 100.0].map(Cell::from);
        let both = numbers(&figures.of_objects).into_iter().chain(numbers(&figures.of_scene));
        let [objects, scene] = figures.of_smooth;
        let smooth = [objects.flip, scene.flip, scene.psnr_db].map(Cell::from);
        table.push([Cell::from(*name)].into_iter().chain(counts).chain(both).chain(smooth))?;
    }
    Ok(table)
}

/// Of the rays by which images were chosen, and of others: what the choice promises is true.
fn unseen_check([chosen, fresh]: [f32; 2]) -> Check {
    println!("mirrored rays that are not seen all the way: {:.2} %, of others {:.2} %", chosen * 100.0, fresh * 100.0);
    let apart = f64::from((fresh - chosen).abs()) * 100.0;
    Check::new("rays that images do not see: other rays less those that chose", apart, "points", Bar::AtMost(1.0))
}

/// What the images of each mirror were chosen from.
fn choice_table(mirrors: &[Mirror]) -> anyhow::Result<Table> {
    let columns = [("mirror", ""), ("images", ""), ("rays that they do not see", "%"), ("chosen", "")];
    let mut table = Table::new("Images from which each mirror's were chosen, of equal texels", &columns);
    for (number, mirror) in mirrors.iter().enumerate() {
        for candidate in &mirror.candidates {
            let unseen = f64::from(candidate.unseen_ratio) * 100.0;
            let chosen = if candidate.is_chosen { "chosen" } else { "" };
            table.push([(number + 1).into(), candidate.name.as_str().into(), unseen.into(), Cell::from(chosen)])?;
        }
    }
    Ok(table)
}

fn error_checks(rows: &[(&str, Figures)]) -> Vec<Check> {
    let of = |wanted: &str| rows.iter().find(|(name, _)| *name == wanted).map(|(_, figures)| *figures);
    let (Some(one), Some(unfiltered), Some(chosen)) =
        (of("pinhole:1"), of(UNFILTERED), rows.last().map(|(_, figures)| *figures))
    else {
        return Vec::new();
    };
    let filtered = chosen.of_smooth[1].flip / unfiltered.of_smooth[1].flip;
    let over = |of: fn(&Figures) -> f64| of(&chosen) / of(&one);
    vec![
        Check::new("objects in mirrors: FLIP over one pinhole's", over(|f| f.of_objects.flip), "×", Bar::AtMost(0.75)),
        Check::new("objects in mirrors: FLIP", chosen.of_objects.flip, "", Bar::AtMost(0.1)),
        Check::new("objects in mirrors: guessed", chosen.of_objects.guessed_ratio * 100.0, "%", Bar::AtMost(2.0)),
        Check::new("mirrors: FLIP over one pinhole's", over(|f| f.of_scene.flip), "×", Bar::AtMost(1.0)),
        Check::new("mirrors against 64 rays: FLIP over the unfiltered", filtered, "×", Bar::AtMost(0.9)),
    ]
}

fn cost_table(costs: &Costs) -> anyhow::Result<Table> {
    let columns = [
        ("mirror", "%"),
        ("images of views", "ms"),
        ("images of mirrors", "ms"),
        ("load", "ms"),
        ("c without reflections", "ms"),
        ("c, reflections 1", "ms"),
        ("c, reflections 2", "ms"),
        ("ns a ray", ""),
        ("g_v, reflections 1", "ms"),
    ];
    let mut table = Table::new("Views of which the mirror fills two fifths, by images as in a cluster", &columns);
    let [views_s, mirrors_s] = costs.sample_s;
    let [plain_s, one_s, two_s] = costs.view_s;
    let rays = costs.mirror_ratio * f64::from(VIEW_PX.element_product());
    let milliseconds =
        [views_s, mirrors_s, costs.load_s.iter().sum(), plain_s, one_s, two_s].map(|seconds| seconds * 1e3);
    let last = [(one_s - plain_s) * 1e9 / rays, costs.direct_s[1] * 1e3];
    let numbers = [costs.mirror_ratio * 100.0].into_iter().chain(milliseconds).chain(last);
    table.push(numbers.map(Cell::from))?;
    Ok(table)
}

/// From one view to a thousand.
fn gain_chart(costs: &Costs) -> XyChart {
    let [x, y] = [Axis::log("views", ""), Axis::log("gain over direct that the parts allow", "×")];
    let chart = XyChart::new("Views that share the samples of a scene and of its mirrors", x, y);
    (0..=2).fold(chart, |chart, reflections| {
        let points = VIEW_COUNTS.map(|views| (views, costs.gain(views, reflections)));
        chart.with(Series::line(format!("reflections {reflections}"), points))
    })
}

fn cost_checks(costs: &Costs) -> Vec<Check> {
    let [plain_s, one_s, two_s] = costs.view_s;
    vec![
        Check::new("c with reflections 1 over c without", one_s / plain_s, "×", Bar::AtMost(2.0)),
        Check::new("c with reflections 2 over c without", two_s / plain_s, "×", Bar::AtMost(3.0)),
        Check::new("gain over direct that the parts allow, V = 290", costs.gain(290.0, 1), "×", Bar::AtLeast(10.0)),
        Check::new("gain over direct that the parts allow, V = 1000", costs.gain(1000.0, 1), "×", Bar::AtLeast(18.0)),
    ]
}
