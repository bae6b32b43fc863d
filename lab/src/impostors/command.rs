//! The command and its report.

use std::path::PathBuf;

use app_core::exit::Outcome;
use app_core::progress::bar;
use app_core::setup::DeviceArgs;
use clap::Args;
use engine::GpuEngine;
use node::Engine as _;
use render::Lighting;
use report::{Bar, Cell, Check, Report, Table};
use sampling::Impostors;

use super::measure::{Errors, Figures, Hall, around};
use super::single_rays::{self, Teapot};
use super::walk;
use crate::failures::stand::Stand;

/// Views around the scene, and their light, in full and in quick runs.
const VIEWS: [usize; 2] = [24, 6];
const LIGHTING: [&str; 2] = ["soft 16, occlusion 16, reflections 1", "shadows, reflections 1"];
/// The images that are compared; mirrors without images show the environment.
const IMPOSTORS: [Impostors; 6] = [
    Impostors::None,
    Impostors::SinglePoles { images: 1 },
    Impostors::SinglePoles { images: 2 },
    Impostors::Pinholes { images: 1 },
    Impostors::Pinholes { images: 4 },
    Impostors::Pinholes { images: 8 },
];

/// Compares views of a teapot before a dented mirror by images of the mirror's surroundings with direct drawing: pinhole and
/// single-pole images of equal texels. Then follows single rays off the mirror towards the teapot.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  myriorama-lab study impostors
  myriorama-lab study impostors --quick --strict   in hard shadows; exit status 1 if a bar is missed")]
pub struct ImpostorsArgs {
    #[command(flatten)]
    device: DeviceArgs,
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

/// Measures everything and writes the report.
///
/// # Errors
/// The device fails, or the folder cannot be written.
pub fn run(args: &ImpostorsArgs) -> anyhow::Result<Outcome> {
    let scene = fixtures::teapot_mirror();
    let engine = GpuEngine::shared(args.device.device)?;
    let stand = Stand::new(&engine, false);
    let lighting: Lighting = LIGHTING[usize::from(args.quick)].parse()?;
    let views = around(&scene.bounds(), VIEWS[usize::from(args.quick)]);
    let mut report = Report::new("Myriorama study: impostors", engine.device_name());
    report.version("myriorama", env!("CARGO_PKG_VERSION"));
    report.parameter("lighting", lighting.to_string());

    let hall = Hall::new(&stand, &scene, lighting, &views)?;
    let rows = compared(&hall)?;
    report.tables.push(table(&rows)?);
    report.checks.extend(checks(&rows)?);

    let teapot = Teapot::new(&stand, &scene, &views)?;
    let rows = single_rays::compare(&teapot)?;
    report.tables.push(single_rays::table(&rows)?);
    report.checks.extend(single_rays::checks(&rows)?);
    walk::measure(&teapot, &mut report)?;

    report.tables.iter().for_each(|table| println!("{}", table.to_text()));
    let holds = report.finish(&args.out)?;
    Ok(Outcome::of(holds || !args.strict))
}

fn compared(hall: &Hall<'_>) -> anyhow::Result<Vec<(Impostors, Figures)>> {
    let progress = bar("images", IMPOSTORS.len());
    let mut rows = Vec::new();
    for impostors in IMPOSTORS {
        rows.push((impostors, hall.figures(impostors)?));
        progress.inc(1);
    }
    progress.finish_and_clear();
    Ok(rows)
}

fn table(rows: &[(Impostors, Figures)]) -> anyhow::Result<Table> {
    let columns = [
        ("images of the surroundings", ""),
        ("texels", ""),
        ("objects: FLIP", ""),
        ("objects: PSNR", "dB"),
        ("objects: guessed", "%"),
        ("FLIP", ""),
        ("PSNR", "dB"),
        ("guessed", "%"),
    ];
    let mut table = Table::new("Pixels in which a mirror shows an object, and in which it shows the scene", &columns);
    for (impostors, figures) in rows {
        let numbers = |errors: &Errors| [errors.flip, errors.psnr_db, errors.guessed_ratio * 100.0].map(Cell::from);
        let named = [impostors.to_string().into(), Cell::from(figures.texels)];
        let errors = numbers(&figures.of_objects).into_iter().chain(numbers(&figures.of_scene));
        table.push(named.into_iter().chain(errors))?;
    }
    Ok(table)
}

fn checks(rows: &[(Impostors, Figures)]) -> anyhow::Result<Vec<Check>> {
    let of = |wanted: Impostors| {
        let row = rows.iter().find(|(impostors, _)| *impostors == wanted);
        row.map(|(_, figures)| figures).ok_or_else(|| anyhow::anyhow!("{wanted} was not measured"))
    };
    let none = of(Impostors::None)?;
    let single_pole = of(Impostors::SinglePoles { images: 1 })?;
    let pinhole = of(Impostors::Pinholes { images: 1 })?;
    let pinholes = of(Impostors::Pinholes { images: 8 })?;
    let gain_db = single_pole.of_objects.psnr_db - pinhole.of_objects.psnr_db;
    let flip_ratio = pinholes.of_scene.flip / none.of_scene.flip;
    let guessed_percent = pinholes.of_scene.guessed_ratio * 100.0;
    Ok(vec![
        Check::new("objects: PSNR of one single-pole image less one pinhole's", gain_db, "dB", Bar::AtLeast(1.0)),
        Check::new("mirrors: FLIP of eight pinholes over that without images", flip_ratio, "×", Bar::AtMost(0.4)),
        Check::new("mirrors: guessed by eight pinholes", guessed_percent, "%", Bar::AtMost(2.0)),
    ])
}
