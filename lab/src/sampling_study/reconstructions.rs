//! Views from each sampling by each reconstruction: from as many images, and from as many samples.

use app_core::progress::bar;
use app_core::setup::{SceneArgs, Setup};
use glam::UVec2;
use reconstruction::ReconstructionMethod;
use report::{Axis, Bar, Cell, Check, Point, Report, Series, Table, XyChart};
use sampling::SamplingMethod;

use super::methods::METHODS;
use super::subject::Subject;
use crate::evaluation::Evaluation;
use crate::reference_views::ReferenceViews;

const SAMPLE_PX: UVec2 = UVec2::new(400, 300);
const VIEW_PX: UVec2 = UVec2::new(200, 150);
const VIEWS: usize = 8;
/// Settings that are compared in place of a method's default.
const SETTINGS: [(&str, &[&str]); 2] =
    [("light_field_search", &["light_field_search:128"]), ("hybrid_mesh", &["hybrid_mesh", "hybrid_mesh:0.5"])];

/// A sampling, and its views by each reconstruction.
pub struct Reconstructed {
    sampling: SamplingMethod,
    size_px: UVec2,
    samples: usize,
    /// The share of the views' pixels with a surface whose surface no image holds.
    unheld: f64,
    rows: Vec<Evaluation>,
}

/// Measures all pairs on a scene, then again with about as few samples as the sampling with the fewest.
pub fn reconstructions(subject: &Subject, quick: bool) -> anyhow::Result<Vec<Reconstructed>> {
    let progress = bar(format!("{}: views", subject.name), 2 * METHODS.len() - 1);
    let mut all = Vec::with_capacity(2 * METHODS.len() - 1);
    for method in METHODS {
        all.push(of_method(subject, method, SAMPLE_PX, quick)?);
        progress.inc(1);
    }
    let fewest = all.iter().map(|r: &Reconstructed| r.samples).min().unwrap_or(0);
    for place in 0..METHODS.len() {
        let scale = (fewest as f32 / all[place].samples as f32).sqrt();
        let smaller = (SAMPLE_PX.as_vec2() * scale).round().as_uvec2();
        if smaller != SAMPLE_PX {
            all.push(of_method(subject, METHODS[place], smaller, quick)?);
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    Ok(all)
}

fn of_method(
    subject: &Subject,
    sampling: SamplingMethod,
    size_px: UVec2,
    quick: bool,
) -> anyhow::Result<Reconstructed> {
    let setup = Setup {
        scene: subject.setup.scene.clone(),
        around: subject.cameras(SamplingMethod::CONVENTIONAL, size_px),
        samples: subject.cameras(sampling, size_px),
        offer: subject.setup.offer.clone(),
    };
    let views = subject.between(if quick { 2 } else { VIEWS }, VIEW_PX);
    // The planes of the hybrid mesh are enough for all reconstructions.
    let args = SceneArgs {
        sampling: Some(sampling),
        method: Some(ReconstructionMethod::HybridMesh { merged: None }),
        ..subject.args.clone()
    };
    let reference = ReferenceViews::draw(&subject.engine, &setup, &args, views)?;
    let samples = reference.images.iter().flat_map(|image| &image.inverse_depth_per_m).filter(|&&d| d > 0.0).count();
    let rows = reconstruction_names()
        .map(|name| reference.evaluate_timed_on(name.parse()?, VIEWS, 1))
        .collect::<anyhow::Result<_>>()?;
    Ok(Reconstructed { sampling, size_px, samples, unheld: reference.unheld()?, rows })
}

/// All methods that make views from depth images, with the settings that are compared.
fn reconstruction_names() -> impl Iterator<Item = &'static str> {
    reconstruction::METHODS.iter().filter(|row| !row.method.walks_cube()).flat_map(|row| {
        let settings = SETTINGS.iter().find(|(name, _)| *name == row.name);
        settings.map_or_else(|| vec![row.name], |(_, settings)| settings.to_vec())
    })
}

impl Reconstructed {
    fn name(&self) -> String {
        match self.size_px == SAMPLE_PX {
            true => self.sampling.to_string(),
            false => format!("{}, {}×{}", self.sampling, self.size_px.x, self.size_px.y),
        }
    }

    fn best_foreground_flip(&self) -> f64 {
        self.rows.iter().map(|row| row.foreground_flip).fold(f64::INFINITY, f64::min)
    }

    fn best_flip(&self) -> f64 {
        self.rows.iter().map(|row| row.flip).fold(f64::INFINITY, f64::min)
    }

    fn covered_flip(&self) -> f64 {
        self.rows.iter().map(|row| row.flip_covered).fold(f64::INFINITY, f64::min)
    }
}

/// Adds a table, charts and checks over all scenes.
pub fn reconstructions_report(scenes: &[(String, Vec<Reconstructed>)], report: &mut Report) -> anyhow::Result<()> {
    let columns = [
        ("scene", ""),
        ("sampling", ""),
        ("reconstruction", ""),
        ("samples", ""),
        ("time a view", "ms"),
        ("foreground PSNR", "dB"),
        ("foreground FLIP", ""),
        ("PSNR", "dB"),
        ("FLIP", ""),
        ("FLIP of covered pixels", ""),
        ("wrong hits", "%"),
        ("unknown", "%"),
        ("not held by any image", "%"),
    ];
    let mut table = Table::new("Sampling and reconstruction", &columns);
    for (scene, all) in scenes {
        for of_sampling in all {
            for row in &of_sampling.rows {
                let head = [scene.clone().into(), of_sampling.name().into(), row.method.to_string().into()];
                let shares = [row.wrong_hits, row.unknown, of_sampling.unheld].map(|share| 100.0 * share);
                let errors = [row.foreground_psnr_db, row.foreground_flip, row.psnr_db, row.flip, row.flip_covered];
                let numbers = [of_sampling.samples as f64, row.ms_a_view].into_iter().chain(errors);
                table.push(head.into_iter().chain(numbers.chain(shares).map(Cell::from)))?;
            }
        }
        report.charts.push(chart("Foreground FLIP", scene, all, |row| row.foreground_flip).into());
        report.charts.push(chart("FLIP", scene, all, |row| row.flip).into());
    }
    report.tables.push(table);
    report.checks.extend(checks(scenes));
    Ok(())
}

fn chart(what: &str, scene: &str, all: &[Reconstructed], flip: fn(&Evaluation) -> f64) -> XyChart {
    let axes = (Axis::log("samples", ""), Axis::linear(what, ""));
    reconstruction_names().enumerate().fold(
        XyChart::new(format!("{what} against samples, {scene}"), axes.0, axes.1),
        |chart, (place, reconstruction)| {
            let points = all.iter().map(|r| Point::labelled(r.samples as f64, flip(&r.rows[place]), r.name()));
            chart.with(Series::points(reconstruction, points))
        },
    )
}

fn checks(scenes: &[(String, Vec<Reconstructed>)]) -> Vec<Check> {
    let apart = |all: &[Reconstructed], of: fn(&Reconstructed) -> f64| {
        let non_redundant = all[..METHODS.len()]
            .iter()
            .filter(|r| !matches!(r.sampling, SamplingMethod::Conventional(_) | SamplingMethod::DepthPeeling { .. }));
        non_redundant.map(of).fold(f64::INFINITY, f64::min)
    };
    let mut checks = Vec::new();
    let unheld = |all: &[Reconstructed]| apart(all, |r| r.unheld) / all[0].unheld;
    let mean = scenes.iter().map(|(_, all)| unheld(all)).sum::<f64>() / scenes.len() as f64;
    checks.push(Check::new(
        "pixels of views that no image holds, non_redundant over conventional, mean of the scenes",
        mean,
        "×",
        Bar::AtMost(0.75),
    ));
    for (scene, all) in scenes {
        checks.push(Check::new(
            format!("{scene}: pixels of views that no image holds, non_redundant over conventional"),
            unheld(all),
            "×",
            Bar::AtMost(1.0),
        ));
        let ratio = apart(all, Reconstructed::covered_flip) / all[0].covered_flip();
        checks.push(Check::new(
            format!("{scene}: FLIP of covered pixels, non_redundant over conventional"),
            ratio,
            "×",
            Bar::AtMost(1.02),
        ));
        let ratio = |best: fn(&Reconstructed) -> f64| apart(all, best) / best(&all[0]);
        let check = Check::new(
            format!("{scene}: FLIP, non_redundant over conventional, each with its best reconstruction"),
            ratio(Reconstructed::best_flip),
            "×",
            Bar::AtMost(1.0),
        );
        checks.push(check.with_foreground(ratio(Reconstructed::best_foreground_flip)));
    }
    checks
}
