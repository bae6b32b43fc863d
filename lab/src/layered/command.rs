//! The command and its report.

use std::path::PathBuf;

use app_core::exit::Outcome;
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::GpuEngine;
use node::Engine as _;
use render::{Direct, Lighting, Rate};
use report::{Bar, Check, Report, Table};

use super::subject::Subject;
use super::views::{self, Figures};
use super::{base, baselines, cubes, glossy, light_fields, mirrors, table_one, triangles, viewpoints};
use crate::failures::stand::Stand;

/// Sides of cubes, in texels of the longest edge. The one that holds and costs are measured of is the second.
const SIDES: [u32; 3] = [256, 512, 1024];
const SCENES: [&str; 6] = ["courtyard", "tree", "tree-terrain-500k", "grass", "urban", "bird-nest"];
/// Scenes of a quick run.
const QUICK: usize = 3;
const VIEWS: [usize; 2] = [24, 6];
const LIGHTING: Lighting =
    Lighting { direct: Direct::Phong, ambient: None, reflections: None, glossy: None, rate: Rate::Full };
/// Scenes in which a cube is compared with view cells, by the number of viewpoints.
const AMONG_VIEWPOINTS: [&str; 2] = ["courtyard", "tree-terrain-500k"];
/// The bound of bytes sent a sample, in the mean of the scenes.
const MOST_SENT_B: f64 = 5.5;
/// PSNR of the views around `courtyard` from a cube of 1024², and of the worst of them.
const LEAST_PSNR_DB: [f64; 2] = [33.0, 31.5];

/// Samples scenes on the lines along three axes, all surfaces behind one another, and walks through these samples for views from
/// all around. Compares the views with direct drawing, and with those of joint_carve from depth images near each view. Then follows
/// rays off mirrors through a cube, up to seven mirrors on a ray's way, and says after how many views the cube is repaid. Also compares
/// what a compositor pulls for viewers in many places: one cube, or the images of their view cells. Then come the paper's own ways to
/// primary rays: projecting all samples, and quadtrees of depths. Then come a cube as a base beside depth images, and mirrors and
/// glossy pixels that are gathered in layered light fields, beside rays. Last comes the paper's Table 1, its figures beside ours. Charts
/// show accuracy over time, and pictures what the paper's figures show.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study layered
  myriorama-lab study layered --quick --strict   fewer scenes and views; exit status 1 if a bar is missed")]
pub struct LayeredArgs {
    #[command(flatten)]
    device: DeviceArgs,
    /// Three scenes in place of six, and six views of each in place of 24
    #[arg(long)]
    quick: bool,
    /// Exit status 1 if a bar is missed
    #[arg(long)]
    strict: bool,
    /// Where the report goes
    #[arg(long, default_value = "out/study/layered", value_name = "DIR")]
    out: PathBuf,
}

/// Measures all scenes and writes the report.
///
/// # Errors
/// The device fails, or the folder cannot be written.
pub fn run(args: &LayeredArgs) -> anyhow::Result<Outcome> {
    let engine = GpuEngine::shared(args.device.device)?;
    let stand = Stand::new(&engine, false);
    let mut report = Report::new("Myriorama study: layered depth cubes", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("lighting", LIGHTING.to_string());
    let scenes = &SCENES[..if args.quick { QUICK } else { SCENES.len() }];
    let (among, counts) = match args.quick {
        true => (&AMONG_VIEWPOINTS[..1], &viewpoints::COUNTS[..4]),
        false => (&AMONG_VIEWPOINTS[..], &viewpoints::COUNTS[..]),
    };
    let progress = bar("scenes", scenes.len() * (SIDES.len() + 1) + among.len());
    let (mut held, mut seen, mut pulled) = (cubes::table(), views::table(), viewpoints::table());
    let mut sent_b = Vec::new();
    for &name in scenes {
        let subject = Subject::new(&stand, name, LIGHTING, VIEWS[usize::from(args.quick)])?;
        let images = views::of_images(&subject)?;
        seen.push(images.row(name, "joint_carve"))?;
        progress.inc(1);
        for side in SIDES {
            let checks = of_side(&subject, side, &images, (&mut held, &mut seen, &mut sent_b))?;
            report.checks.extend(checks);
            progress.inc(1);
        }
        if among.contains(&name) {
            let (chart, check) = viewpoints::measure(&subject, counts, &mut pulled)?;
            report.charts.push(chart.into());
            report.checks.extend(check);
            progress.inc(1);
        }
    }
    let mean_b = sent_b.iter().sum::<f64>() / sent_b.len() as f64;
    report.checks.push(Check::new("bytes sent a sample, mean of the scenes", mean_b, "B", Bar::AtMost(MOST_SENT_B)));
    progress.finish_and_clear();
    if !args.quick {
        report.checks.push(triangles::measure(&stand, LIGHTING, &mut seen)?);
    }
    report.tables.extend([held, seen, pulled]);
    mirrors::measure(&stand, &mut report)?;
    baselines::measure(&stand, LIGHTING, args.quick, &mut report)?;
    base::measure(&stand, LIGHTING, args.quick, &mut report)?;
    light_fields::measure(&stand, args.quick, &mut report)?;
    glossy::measure(&stand, args.quick, &mut report)?;
    table_one::measure(&stand, LIGHTING, &mut report)?;
    report.tables.iter().for_each(|table| println!("{}", table.to_text()));
    let holds = report.finish(&args.out)?;
    Ok(Outcome::of(holds || !args.strict))
}

/// The rows and checks of a cube of one side.
fn of_side(
    subject: &Subject<'_>,
    side: u32,
    images: &Figures,
    (held, seen, sent_b): (&mut Table, &mut Table, &mut Vec<f64>),
) -> anyhow::Result<Vec<Check>> {
    let (cube, mut checks) = match side == SIDES[1] {
        true => cubes::measure(subject, side, (held, &mut *seen))?,
        false => (subject.cube((side, render::LayerSelection::Dominant), subject.lighting, 1)?, Vec::new()),
    };
    if side == SIDES[1] {
        sent_b.push(cube.encoded_bytes()? as f64 / cube.samples() as f64);
    }
    let walk = views::of_cube(subject, &subject.upload(&cube)?.0)?;
    seen.push(walk.row(subject.name, &format!("layered, {side}²")))?;
    checks.extend(views::cost_check(subject.name, side, &walk, images));
    let name = subject.name;
    if (name, side) == ("courtyard", SIDES[2]) {
        let [mean, worst] = LEAST_PSNR_DB;
        checks.push(Check::new(
            format!("{name}: PSNR of views around, {side}²"),
            walk.psnr_db,
            "dB",
            Bar::AtLeast(mean),
        ));
        checks.push(Check::new(format!("{name}: the worst of them"), walk.worst_psnr_db, "dB", Bar::AtLeast(worst)));
    }
    Ok(checks)
}
