//! Sampling for shared light, part of `study sampling`: conventional images beside those without covered pixels, by the time of all
//! light at equal FLIP.
//!
//! All light of a set is that of its samples and that of the points of its views that no sample knows.

use std::path::Path;

use anyhow::Context as _;
use depth_image::LightCacheQuality::{self, Balanced, Draft};
use report::{Axis, Bar, Check, Mark, Point, Report, XyChart};
use sampling::{Redundancy, SamplingMethod};

use super::light::{DIRECT_RAYS, Light, LightRays};
use super::measure::{Drawing, LightFront, LightRow, LitRows};
use super::subject::{OrbitViews, SetOptions, Subject, VIEW_PX};
use crate::failures::stand::Stand;
use crate::statistics::geometric_mean;
use crate::study::{Column, check_if_measured, table, with_series};

/// The views of a set, as in the paper.
const VIEWS_A_SET: f64 = 290.0;
const SAMPLINGS: [SamplingMethod; 2] =
    [SamplingMethod::CONVENTIONAL, SamplingMethod::NonRedundant(Redundancy::Coverage)];
const SCENES: [&str; 6] = ["tree-terrain-500k", "urban", "courtyard", "bird-nest", "FlightHelmet", "gallery"];
const QUICK_SCENES: [&str; 2] = ["tree-terrain-125k", "courtyard"];
const IMAGES: [usize; 2] = [2, 4];
const DENSITIES: [f32; 2] = [0.71, 1.0];
/// The most that the default of a light takes over the other.
const MOST_DEFAULT_RATIO: f64 = 1.15;
/// Bytes of the set without covered pixels over those of the conventional one.
const MOST_BYTES_RATIO: f64 = 0.8;

/// A sample set with the views that are made from it.
struct SetRow {
    scene: String,
    set: SetOptions,
    row: LightRow,
    /// Of views at the quality `draft`, which leaves fewest points unknown.
    draft_ms: f64,
}

/// Both samplings on one scene.
struct Comparison {
    scene: String,
    light: Light,
    /// The least error that both reach.
    flip: f64,
    /// Times of all light at that error, and bytes, without covered pixels over those of conventional images.
    time_ratio: f64,
    bytes_ratio: f64,
}

const COLUMNS: [Column<SetRow>; 11] = [
    Column::new("scene", |row| row.scene.as_str().into()),
    Column::new("sampling", |row| row.set.sampling.to_string().into()),
    Column::new("S", |row| row.set.images.into()),
    Column::new("density", |row| row.set.density.into()),
    Column::new("samples", |row| row.row.sampled.samples.into()),
    Column::with_unit("a set", "kB", |row| (row.row.sampled.bytes as f64 / 1e3).into()),
    Column::with_unit("sampling", "s", |row| row.row.sampled.seconds.into()),
    Column::with_unit("unknown", "%", |row| row.row.unknown.map(|share| share * 100.0).into()),
    Column::with_unit("a view", "ms", |row| row.row.view_ms.into()),
    Column::with_unit("all light of 290 views", "s", |row| row.all_light_s().into()),
    Column::new("FLIP", |row| row.row.flip.into()),
];

const RATIOS: [Column<Comparison>; 4] = [
    Column::new("scene", |row| row.scene.as_str().into()),
    Column::new("FLIP that both reach", |row| row.flip.into()),
    Column::with_unit("time of all light", "×", |row| row.time_ratio.into()),
    Column::with_unit("bytes, S = 4, density 1", "×", |row| row.bytes_ratio.into()),
];

impl SetRow {
    fn all_light_s(&self) -> f64 {
        self.row.sampled.seconds + VIEWS_A_SET * (self.row.view_ms - self.draft_ms).max(0.0) * 1e-3
    }

    fn point(&self) -> Point {
        (self.all_light_s(), self.row.flip).into()
    }
}

/// Adds tables, charts and checks of all scenes; those of models only with a folder of models.
///
/// # Errors
/// A scene cannot be used, or the device fails.
pub fn measure(stand: &Stand, is_quick: bool, models: Option<&Path>, report: &mut Report) -> anyhow::Result<()> {
    let sets = SAMPLINGS.into_iter().flat_map(|sampling| {
        IMAGES.into_iter().flat_map(move |images| DENSITIES.map(|density| SetOptions { sampling, images, density }))
    });
    let rows = LitRows {
        direct: &DIRECT_RAYS[..5],
        qualities: &[Draft, Balanced],
        sets: sets.collect(),
        has_joint_carve: false,
        views: OrbitViews { count: 1, size_px: VIEW_PX },
        runs: 3,
    };
    let mut all = Vec::new();
    let mut comparisons = Vec::new();
    for &name in if is_quick { &QUICK_SCENES[..] } else { &SCENES } {
        let Some(subject) = Subject::new(name, models)? else { continue };
        for (light, rays) in [(Light::Occlusion, LightRays::new(16, 16)), (Light::Indirect, LightRays::new(16, 64))] {
            let front = rows.measure(stand, &subject, light.lighting(rays).parse()?).context(name)?;
            let measured = set_rows(&front);
            comparisons.push(Comparison::of(&front, &measured));
            report.charts.push(chart(&front.name(), &measured));
            all.extend(measured);
        }
    }
    report.tables.push(table("Sampling for shared light", &COLUMNS, &all)?);
    report.tables.push(table("Coverage over conventional sampling", &RATIOS, &comparisons)?);
    report.checks.extend(checks(&comparisons));
    Ok(())
}

fn set_rows(front: &LightFront) -> Vec<SetRow> {
    let rows = of_quality(front, Balanced).zip(of_quality(front, Draft)).filter_map(|(row, draft)| {
        Some(SetRow { scene: front.name(), set: row.set?, row: row.clone(), draft_ms: draft.view_ms })
    });
    rows.collect()
}

fn of_quality(front: &LightFront, quality: LightCacheQuality) -> impl Iterator<Item = &LightRow> {
    front.rows.iter().filter(move |row| row.drawing == Drawing::LightCache(quality))
}

fn chart(scene: &str, rows: &[SetRow]) -> XyChart {
    let title = format!("Sampling for shared light, {scene}");
    let chart = XyChart::new(title, Axis::log("all light of 290 views", "s"), Axis::log("Foreground FLIP", ""));
    with_series(chart, rows, Mark::Points, |row| row.set.sampling.to_string(), SetRow::point)
}

impl Comparison {
    fn of(front: &LightFront, rows: &[SetRow]) -> Self {
        let [old, new] = SAMPLINGS.map(|sampling| {
            rows.iter().filter(|row| row.set.sampling == sampling).map(SetRow::point).collect::<Vec<Point>>()
        });
        let flip = least(old.iter().map(|row| row.y)).max(least(new.iter().map(|row| row.y)));
        let [old_s, new_s] = [old, new].map(|rows| least(rows.iter().filter(|row| row.y <= flip).map(|row| row.x)));
        let [old_bytes, new_bytes] = SAMPLINGS.map(|sampling| {
            let dense = SetOptions { sampling, images: 4, density: 1.0 };
            rows.iter().find(|row| row.set == dense).map_or(f64::NAN, |row| row.row.sampled.bytes as f64)
        });
        let light = front.light;
        Self { scene: front.name(), light, flip, time_ratio: new_s / old_s, bytes_ratio: new_bytes / old_bytes }
    }
}

fn least(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

/// Under indirect light images omit covered pixels where none is named ([`SamplingMethod::suited_to`]).
fn checks(comparisons: &[Comparison]) -> [Check; 3] {
    let [indirect, occlusion] = [Light::Indirect, Light::Occlusion].map(|light| {
        let of_light = comparisons.iter().filter(|scene| scene.light == light);
        geometric_mean(&of_light.map(|scene| scene.time_ratio).collect::<Vec<f64>>())
    });
    let bytes: Vec<f64> = comparisons.iter().map(|scene| scene.bytes_ratio).collect();
    [
        ("time of all light at equal FLIP, indirect light, coverage over conventional", indirect, MOST_DEFAULT_RATIO),
        (
            "time of all light at equal FLIP, occlusion, conventional over coverage",
            occlusion.map(f64::recip),
            MOST_DEFAULT_RATIO,
        ),
        ("bytes of a set, coverage over conventional", geometric_mean(&bytes), MOST_BYTES_RATIO),
    ]
    .map(|(what, ratio, most)| {
        check_if_measured(format!("{what}, geometric mean"), ratio, "×", Bar::AtMost(most), "no scene is measured")
    })
}
