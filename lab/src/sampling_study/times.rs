//! The cost of sampling over that of conventional sampling, in time and in bytes.

use std::time::Instant;

use codec::encode_depth_image;
use depth_image::DepthImage;
use glam::UVec2;
use render::SamplePlanes;
use report::Report;
use sampling::SamplingMethod;

use super::extent::Extent;
use super::methods::{IMAGES, METHODS};
use super::subject::Subject;
use crate::failures::measures::samples;
use crate::statistics::median;
use crate::study::{Column, table};

const RUNS: usize = 3;
/// Milliseconds after which a measurement is not repeated.
const ENOUGH_MS: f64 = 2000.0;

/// Costs of one method on one scene.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    /// Milliseconds of a set.
    set_ms: f64,
    /// Bytes of depth and colour of a set, packed.
    bytes: usize,
    /// The number of samples; holes do not count.
    samples: usize,
}

/// Costs beside those of conventional sampling.
struct TimesRow {
    scene: String,
    method: SamplingMethod,
    times: Times,
    conventional: Times,
}

const COLUMNS: [Column<TimesRow>; 7] = [
    Column::new("scene", |row| row.scene.as_str().into()),
    Column::new("sampling", |row| row.method.to_string().into()),
    Column::with_unit("a set", "ms", |row| row.times.set_ms.into()),
    Column::with_unit("a later image over a conventional one", "×", |row| row.later_image_ratio().into()),
    Column::with_unit("depth and colour", "kB", |row| (row.times.bytes as f64 / 1e3).into()),
    Column::new("samples", |row| row.times.samples.into()),
    Column::new("bits a sample", |row| (8.0 * row.times.bytes as f64 / row.times.samples as f64).into()),
];

impl TimesRow {
    /// The first image of each set is conventional.
    fn later_image_ratio(&self) -> f64 {
        let image_ms = self.conventional.set_ms / IMAGES as f64;
        (self.times.set_ms - image_ms) / (IMAGES - 1) as f64 / image_ms
    }
}

/// Measures all methods, in the order of [`METHODS`].
///
/// # Errors
/// The device fails.
pub fn times(subject: &Subject, extent: Extent) -> anyhow::Result<Vec<Times>> {
    METHODS.iter().map(|&method| of_method(subject, method, UVec2::splat(extent.side_px))).collect()
}

fn of_method(subject: &Subject, method: SamplingMethod, size_px: UVec2) -> anyhow::Result<Times> {
    let planes = SamplePlanes::default();
    // The first run builds pipelines, and chooses between rays and triangles.
    let images = subject.sample(method, size_px, planes)?;
    let mut ms = Vec::new();
    while ms.len() < RUNS && ms.iter().sum::<f64>() < ENOUGH_MS {
        let start = Instant::now();
        subject.sample(method, size_px, planes)?;
        ms.push(start.elapsed().as_secs_f64() * 1e3);
    }
    let mut bytes = 0;
    for image in &images {
        // Depth and colour, without what some methods of reconstruction need beside them.
        let image =
            DepthImage { normal_oct16: None, surface_id: None, corner_inverse_depth_per_m: None, ..image.clone() };
        bytes += encode_depth_image(&DepthImage { specular: None, ..image })?.payload.len();
    }
    Ok(Times { set_ms: median(ms), bytes, samples: images.iter().map(samples).sum() })
}

/// Adds a table of all scenes, each with the costs of all methods.
///
/// # Errors
/// A row does not fit its table.
pub fn times_report(scenes: &[(String, Vec<Times>)], extent: Extent, report: &mut Report) -> anyhow::Result<()> {
    let rows = scenes.iter().flat_map(|(scene, all)| {
        METHODS.into_iter().zip(all).map(|(method, &times)| TimesRow {
            scene: scene.clone(),
            method,
            times,
            conventional: all[0],
        })
    });
    let rows: Vec<TimesRow> = rows.collect();
    report.tables.push(table(format!("Sampling, {0}×{0}", extent.side_px), &COLUMNS, &rows)?);
    Ok(())
}
