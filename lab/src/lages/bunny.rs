//! Figure 11 of the paper: the Stanford bunny from few images beside direct drawing, and the pixels that differ perceptibly.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context as _;
use app_core::experiment::VIEW_SIZE_PX;
use app_core::setup::{SceneArgs, Setup};
use depth_image::{View, ViewCell, ViewPlanes};
use engine::GpuEngine;
use image::Rgb;
use metrics::pdiff_map;
use reconstruction::ReconstructionMethod;
use report::{Bar, Check, Picture, PictureRow, Report};
use scene::SceneSpec;

use super::timing::Errors;
use crate::models::model_named;
use crate::reference_views::ReferenceViews;
use crate::study::{Column, measure_rows, table};

const MODEL: &str = "stanford-bunny";
/// Numbers of images. The paper has four.
const IMAGES: [usize; 3] = [2, 4, 8];
const VIEWS: usize = 10;
const DIFFERENT: [u8; 3] = [255, 0, 0];

/// Views from a number of images.
struct BunnyRow {
    images: usize,
    errors: Errors,
    pictures: Vec<Picture>,
}

const COLUMNS: [Column<BunnyRow>; 6] = [
    Column::new("images", |row| row.images.into()),
    Column::with_unit("pdiff", "px a view", |row| row.errors.different_px.into()),
    Column::with_unit("pdiff", "% of pixels", |row| {
        (100.0 * row.errors.different_px / f64::from(VIEW_SIZE_PX.element_product())).into()
    }),
    Column::new("FLIP", |row| row.errors.flip.into()),
    Column::with_unit("PSNR", "dB", |row| row.errors.psnr_db.into()),
    Column::new("paper, Fig. 11", |row| if row.images == 4 { "a picture without numbers".into() } else { "–".into() }),
];

/// Adds views of the bunny from each number of images, and checks that errors fall. Without a folder of models nothing is measured.
///
/// # Errors
/// The folder has no bunny, or the device fails.
pub fn figure_11(engine: &Arc<GpuEngine>, models: Option<&Path>, report: &mut Report) -> anyhow::Result<()> {
    let Some(folder) = models else {
        let reason = "no --models";
        report.checks.push(Check::not_run(
            "bunny: pdiff and FLIP over those of fewer images",
            "×",
            Bar::AtMost(1.0),
            reason,
        ));
        return Ok(());
    };
    let args = SceneArgs::new(SceneSpec::File(model_named(folder, MODEL)?));
    let setup = args.load()?;
    let rows = measure_rows("bunny", IMAGES, |images| BunnyRow::measure(engine, &args, &setup, images))?;
    report.tables.push(table(format!("Fig. 11, {MODEL}: views beside direct drawing"), &COLUMNS, &rows)?);
    for pair in rows.windows(2) {
        let [fewer, more] = [&pair[0], &pair[1]];
        let images = format!("of {} images over {} images", more.images, fewer.images);
        let pdiff_ratio = more.errors.different_px / fewer.errors.different_px;
        let flip_ratio = more.errors.flip / fewer.errors.flip;
        report.checks.push(Check::new(format!("bunny: pdiff {images}"), pdiff_ratio, "×", Bar::AtMost(1.0)));
        report.checks.push(Check::new(format!("bunny: FLIP {images}"), flip_ratio, "×", Bar::AtMost(1.0)));
    }
    let pictures = rows.into_iter().flat_map(|row| row.pictures).collect();
    report
        .pictures
        .push(PictureRow { title: "Fig. 11: direct drawing, views from images, differences".to_owned(), pictures });
    Ok(())
}

impl BunnyRow {
    fn measure(engine: &Arc<GpuEngine>, args: &SceneArgs, setup: &Setup, images: usize) -> anyhow::Result<Self> {
        let cell = ViewCell::between(&setup.around).context("no sample cameras")?;
        let samples = cell.nested_cameras(images, setup.samples[0].size_px);
        let setup = Setup { samples, ..setup.clone() };
        let reference = ReferenceViews::draw(engine, &setup, args, cell.spread(VIEWS, VIEW_SIZE_PX))?;
        let made = reference.reconstruct(ReconstructionMethod::default(), ViewPlanes::COLOR)?;
        let errors = Errors::new(&reference.views, &made)?;
        let pictures = pictures(images, &reference.views[0], &made[0])?;
        Ok(Self { images, errors, pictures })
    }
}

/// The first view as in the paper: drawn directly, made from images, and with the pixels in red that differ perceptibly.
fn pictures(images: usize, direct: &View, made: &View) -> anyhow::Result<Vec<Picture>> {
    let drawn = pictures::rgb(direct).context("the size of a drawn view")?;
    let from_images = pictures::rgb(made).context("the size of a view from images")?;
    let mut different = from_images.clone();
    for (pixel, differs) in different.pixels_mut().zip(pdiff_map(direct, made)?) {
        if differs {
            *pixel = Rgb(DIFFERENT);
        }
    }
    let parts = [("direct", drawn), ("from images", from_images), ("pdiff", different)];
    let pictures = parts.map(|(caption, image)| {
        Picture::new(format!("bunny {images} {caption}"), format!("{images} images, {caption}"), image)
    });
    Ok(pictures.to_vec())
}
