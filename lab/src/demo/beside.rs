//! The sampling asked for, with conventional sampling beside it.

use anyhow::Context as _;
use app_core::setup::{SceneArgs, Setup};
use depth_image::ViewPlanes;
use metrics::{Rgb8Image, flip_map};
use sampling::SamplingMethod;
use study::{Cell, Report, Table, comparison_row};

use super::args::COMPARED_VIEWS;
use crate::experiment::Experiment;
use crate::reference_views::ReferenceViews;

/// The rows of pictures of each sampling.
const SIDE_BY_SIDE: usize = 2;

/// Adds a table and pictures; nothing where sampling is conventional.
pub fn conventional(experiment: &Experiment, report: &mut Report) -> anyhow::Result<()> {
    let args = &experiment.args;
    if args.sampling() == SamplingMethod::CONVENTIONAL {
        return Ok(());
    }
    let columns = [
        ("sampling", ""),
        ("reconstruction", ""),
        ("samples", ""),
        ("time a view", "ms"),
        ("foreground PSNR", "dB"),
        ("foreground FLIP", ""),
        ("PSNR", "dB"),
        ("FLIP", ""),
        ("FLIP of covered pixels", ""),
        ("unknown", "%"),
    ];
    let mut table = Table::new("Conventional sampling beside it", &columns);
    for sampling in [args.sampling(), SamplingMethod::CONVENTIONAL] {
        let reference = taken(experiment, sampling)?;
        let row = reference.evaluate(args.method(), 1)?;
        let depths = reference.images.iter().flat_map(|image| &image.inverse_depth_per_m);
        let samples = depths.filter(|&&depth| depth > 0.0).count();
        let whole = [row.psnr_db, row.flip, row.flip_covered, 100.0 * row.unknown];
        let numbers = [row.ms_a_view, row.foreground_psnr_db, row.foreground_flip].into_iter().chain(whole);
        let head = [sampling.to_string().into(), args.method().to_string().into(), samples.into()];
        table.push(head.into_iter().chain(numbers.map(Cell::from)))?;
        show(&reference, sampling, args, report)?;
    }
    report.tables.push(table);
    Ok(())
}

fn taken(experiment: &Experiment, sampling: SamplingMethod) -> anyhow::Result<ReferenceViews> {
    let Setup { scene, around, offer, .. } = &experiment.setup;
    let (around, samples) = (around.clone(), sampling.cameras(around.clone()));
    let setup = Setup { scene: scene.clone(), around, samples, offer: offer.clone() };
    let args = SceneArgs { sampling: Some(sampling), ..experiment.args.clone() };
    ReferenceViews::draw(&experiment.engine, &setup, &args, experiment.views(COMPARED_VIEWS)?)
}

fn show(
    reference: &ReferenceViews,
    sampling: SamplingMethod,
    args: &SceneArgs,
    report: &mut Report,
) -> anyhow::Result<()> {
    let views = reference.reconstruct(args.method(), ViewPlanes::ALL)?;
    for (index, (direct, view)) in reference.views.iter().zip(&views).take(SIDE_BY_SIDE).enumerate() {
        let flip = flip_map(&Rgb8Image::of_view(direct)?, &Rgb8Image::of_view(view)?)?;
        let images = pictures::rgb(direct).zip(pictures::rgb(view)).context("a view is not of its size")?;
        let title = format!("{sampling}, view {index}");
        report.pictures.push(comparison_row(&title, images.0, images.1, &flip, pictures::provenance(view, 0)));
    }
    Ok(())
}
