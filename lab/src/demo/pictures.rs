//! Pictures of the views.

use anyhow::Context as _;
use client::Frame;
use depth_image::View;
use image::imageops;
use metrics::{Rgb8Image, flip_map};
use render::Lighting;
use study::{Picture, PictureRow, Report, comparison_row};

use crate::reference_views::ReferenceViews;

/// The number of views beside their reference.
const SIDE_BY_SIDE: usize = 6;
const SHEET_COLUMNS: u32 = 20;

/// Adds all delivered views, at half their size.
pub fn contact_sheet(frames: &[Frame], lighting: &Lighting, report: &mut Report) {
    let small = |view: &View| {
        pictures::rgb(view)
            .map(|image| imageops::thumbnail(&image, (image.width() / 2).max(1), (image.height() / 2).max(1)))
    };
    let images: Vec<_> = frames.iter().filter_map(|frame| small(&frame.view)).collect();
    let sheet = study::contact_sheet(&images, SHEET_COLUMNS, 2);
    let picture = Picture::new(
        "contact sheet",
        format!("{} delivered views, {lighting}, at half their size", images.len()),
        sheet,
    );
    report.pictures.insert(0, PictureRow { title: "All views".to_owned(), pictures: vec![picture] });
}

/// Adds rows of direct, reconstructed, error map and provenance.
pub fn comparisons(reference: &ReferenceViews, views: &[View], report: &mut Report) -> anyhow::Result<()> {
    for (index, (direct, view)) in reference.views.iter().zip(views).take(SIDE_BY_SIDE).enumerate() {
        let flip = flip_map(&Rgb8Image::of_view(direct)?, &Rgb8Image::of_view(view)?)?;
        let images = pictures::rgb(direct).zip(pictures::rgb(view)).context("a view is not of its size")?;
        report.pictures.push(comparison_row(
            &format!("View {index}"),
            images.0,
            images.1,
            &flip,
            pictures::provenance(view, 0),
        ));
    }
    Ok(())
}
