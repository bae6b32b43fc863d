//! The cost of sampling over that of conventional sampling, in time and in bytes.

use std::time::Instant;

use codec::{PlaneSet, encode_depth_image};
use depth_image::DepthImage;
use glam::UVec2;
use render::SamplePlanes;
use report::{Bar, Cell, Check, Report, Table};
use sampling::{SamplingMethod, scalar};

use super::extent::Extent;
use super::methods::{IMAGES, METHODS};
use super::subject::Subject;
use crate::statistics::median;

const RUNS: usize = 3;
/// Milliseconds after which a measurement is not repeated.
const ENOUGH_MS: f64 = 2000.0;
/// The side of the images whose rays are counted.
const COUNTED_PX: u32 = 96;

/// Costs of one method on one scene.
#[derive(Debug, Clone, Copy)]
pub struct Times {
    /// Milliseconds of a set.
    pub set_ms: f64,
    /// Milliseconds of the depths at texel corners, of a set.
    pub corners_ms: f64,
    /// Bytes of depth and colour of a set, packed.
    pub bytes: usize,
    /// Bytes of depths at corners and of normals, packed.
    pub corner_bytes: usize,
    /// The number of samples; holes do not count.
    pub samples: usize,
    /// Rays a pixel of later images, where a test traces rays.
    pub rays_a_pixel: f64,
}

/// Measures all methods.
///
/// # Errors
/// The device fails.
pub fn times(subject: &Subject, extent: Extent) -> anyhow::Result<Vec<Times>> {
    METHODS.iter().map(|&method| of_method(subject, method, UVec2::splat(extent.side_px))).collect()
}

fn of_method(subject: &Subject, method: SamplingMethod, size_px: UVec2) -> anyhow::Result<Times> {
    let hybrid = SamplePlanes { normal: true, corners: true, ..SamplePlanes::default() };
    let mut ms = [Vec::new(), Vec::new()];
    for (ms, planes) in ms.iter_mut().zip([SamplePlanes::default(), hybrid]) {
        // The first run builds pipelines, and chooses between rays and triangles.
        subject.sample(method, size_px, planes)?;
        while ms.len() < RUNS && ms.iter().sum::<f64>() < ENOUGH_MS {
            let start = Instant::now();
            subject.sample(method, size_px, planes)?;
            ms.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    let images = subject.sample(method, size_px, hybrid)?;
    let bytes = |planes: PlaneSet| -> anyhow::Result<usize> {
        let packed = images.iter().map(|image| Ok(encode_depth_image(image, planes)?.payload.len()));
        packed.sum()
    };
    let [set_ms, with_corners_ms] = ms.map(median);
    let plain = bytes(PlaneSet::DEPTH_COLOR)?;
    let samples = |image: &DepthImage| image.inverse_depth_per_m.iter().filter(|&&d| d > 0.0).count();
    Ok(Times {
        set_ms,
        corners_ms: with_corners_ms - set_ms,
        bytes: plain,
        corner_bytes: bytes(PlaneSet::ALL)? - plain,
        samples: images.iter().map(samples).sum(),
        rays_a_pixel: rays_a_pixel(subject, method)?,
    })
}

fn rays_a_pixel(subject: &Subject, method: SamplingMethod) -> anyhow::Result<f64> {
    if method.redundancy_test().is_none_or(|test| !test.traces_rays()) {
        return Ok(f64::NAN);
    }
    let cameras = subject.cameras(method, UVec2::splat(COUNTED_PX));
    let rays = scalar::rays_of_visibility(&render::scalar::rays::Scene::of(&subject.scene, 0.0)?, &cameras);
    Ok(rays as f64 / f64::from((IMAGES as u32 - 1) * COUNTED_PX * COUNTED_PX))
}

impl Times {
    /// Milliseconds of an image after the first, which is conventional.
    fn later_image_ms(&self, conventional: &Self) -> f64 {
        (self.set_ms - conventional.image_ms()) / (IMAGES - 1) as f64
    }

    fn image_ms(&self) -> f64 {
        self.set_ms / IMAGES as f64
    }

    fn bits_a_sample(&self) -> f64 {
        8.0 * self.bytes as f64 / self.samples as f64
    }
}

/// Adds a table and checks of all scenes.
///
/// # Errors
/// A row does not fit its table.
pub fn times_report(rows: &[(String, Vec<Times>)], extent: Extent, report: &mut Report) -> anyhow::Result<()> {
    let columns = [
        ("scene", ""),
        ("sampling", ""),
        ("a set", "ms"),
        ("a later image over a conventional one", "×"),
        ("corner depths and normals, a set", "ms"),
        ("depth and colour", "kB"),
        ("corner depths and normals", "kB"),
        ("samples", ""),
        ("bits a sample", ""),
        ("rays a pixel", ""),
        ("million rays a second", ""),
    ];
    let mut table = Table::new(format!("Sampling, {0}×{0}", extent.side_px), &columns);
    for (scene, times) in rows {
        for (method, t) in METHODS.iter().zip(times) {
            let later_ms = t.later_image_ms(&times[0]);
            let rays_m_s = t.rays_a_pixel * f64::from(extent.side_px).powi(2) / later_ms * 1e-3;
            let numbers = [t.set_ms, later_ms / times[0].image_ms(), t.corners_ms, t.bytes as f64 / 1e3];
            let rest = [t.corner_bytes as f64 / 1e3, t.samples as f64, t.bits_a_sample(), t.rays_a_pixel, rays_m_s];
            let head = [scene.clone().into(), method.to_string().into()];
            table.push(head.into_iter().chain(numbers.into_iter().chain(rest).map(Cell::from)))?;
        }
    }
    report.tables.push(table);
    for (place, most) in [(1, 1.5), (3, 2.5)] {
        let ratios = rows.iter().map(|(_, times)| times[place].later_image_ms(&times[0]) / times[0].image_ms());
        let name = format!("a later image of {} over a conventional one, mean of the scenes", METHODS[place]);
        report.checks.push(Check::new(name, ratios.sum::<f64>() / rows.len() as f64, "×", Bar::AtMost(most)));
    }
    for (scene, times) in rows {
        for place in [1, 3, 5] {
            let method = METHODS[place];
            let more = times[place].bits_a_sample() - times[0].bits_a_sample();
            report.checks.push(Check::new(
                format!("{scene}: bits a sample, {method} less conventional"),
                more,
                "bits",
                Bar::AtMost(3.0),
            ));
            if ["bird-nest", "urban"].contains(&scene.as_str()) {
                let ratio = times[place].bytes as f64 / times[0].bytes as f64;
                report.checks.push(Check::new(
                    format!("{scene}: bytes, {method} over conventional"),
                    ratio,
                    "×",
                    Bar::AtMost(1.0),
                ));
            }
        }
    }
    Ok(())
}
