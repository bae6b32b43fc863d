//! The command and its report.

use anyhow::Context as _;
use app_core::exit::Outcome;
use render::Lighting;
use report::{Bar, Check};
use sampling::Impostors;

use super::glass;
use super::horizons;
use super::maze;
use super::measure::{Figures, Hall, around};
use super::reliefs;
use super::single_rays::{self, Teapot};
use super::walk;
use crate::failures::stand::Stand;
use crate::study::{Column, RunArgs, measure_rows, table};

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

const TITLE: &str = "Pixels in which a mirror shows an object, and in which it shows the scene";
const COLUMNS: [Column<Figures>; 8] = [
    Column::new("images of the surroundings", |row| row.impostors.to_string().into()),
    Column::new("texels", |row| row.texels.into()),
    Column::new("objects: FLIP", |row| row.of_objects.flip.into()),
    Column::with_unit("objects: PSNR", "dB", |row| row.of_objects.psnr_db.into()),
    Column::with_unit("objects: guessed", "%", |row| (row.of_objects.guessed_ratio * 100.0).into()),
    Column::new("FLIP", |row| row.of_scene.flip.into()),
    Column::with_unit("PSNR", "dB", |row| row.of_scene.psnr_db.into()),
    Column::with_unit("guessed", "%", |row| (row.of_scene.guessed_ratio * 100.0).into()),
];

/// Measures everything and writes the report.
///
/// # Errors
/// The device fails, or the folder cannot be written.
pub fn run(args: &RunArgs) -> anyhow::Result<Outcome> {
    let scene = fixtures::teapot_mirror();
    let engine = args.engine()?;
    let stand = Stand::new(&engine, false);
    let lighting: Lighting = LIGHTING[usize::from(args.quick)].parse()?;
    let views = around(&scene.bounds(), VIEWS[usize::from(args.quick)]);
    let mut report = args.report("impostors", &engine);
    report.parameter("lighting", lighting.to_string());

    let hall = Hall::new(&stand, &scene, lighting, &views)?;
    let rows = measure_rows("images", IMPOSTORS, |impostors| hall.figures(impostors))?;
    report.tables.push(table(TITLE, &COLUMNS, &rows)?);
    report.checks.extend(checks(&rows)?);

    let teapot = Teapot::new(&stand, &scene, &views)?;
    let rows = single_rays::compare(&teapot)?;
    report.tables.push(table(single_rays::TITLE, &single_rays::COLUMNS, &rows)?);
    report.checks.extend(single_rays::checks(&rows)?);
    walk::measure(&teapot, &mut report)?;
    maze::measure(&stand, args.quick, &mut report)?;
    horizons::measure(&stand, args.quick, &mut report)?;
    glass::measure(&stand, args.quick, &mut report)?;
    reliefs::measure(&stand, args.quick, &mut report)?;
    args.finish("out/study/impostors", &report)
}

fn checks(rows: &[Figures]) -> anyhow::Result<Vec<Check>> {
    let none = figures_of(rows, Impostors::None)?;
    let single_pole = figures_of(rows, Impostors::SinglePoles { images: 1 })?;
    let pinhole = figures_of(rows, Impostors::Pinholes { images: 1 })?;
    let pinholes = figures_of(rows, Impostors::Pinholes { images: 8 })?;
    let gain_db = single_pole.of_objects.psnr_db - pinhole.of_objects.psnr_db;
    let flip_ratio = pinholes.of_scene.flip / none.of_scene.flip;
    let guessed_percent = pinholes.of_scene.guessed_ratio * 100.0;
    Ok(vec![
        Check::new("objects: PSNR of one single-pole image less one pinhole's", gain_db, "dB", Bar::AtLeast(1.0)),
        Check::new("mirrors: FLIP of eight pinholes over that without images", flip_ratio, "×", Bar::AtMost(0.4)),
        Check::new("mirrors: guessed by eight pinholes", guessed_percent, "%", Bar::AtMost(2.0)),
    ])
}

fn figures_of(rows: &[Figures], impostors: Impostors) -> anyhow::Result<&Figures> {
    rows.iter().find(|row| row.impostors == impostors).with_context(|| format!("{impostors} was not measured"))
}
