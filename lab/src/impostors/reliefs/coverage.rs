//! The share of a car that its images show, by the elevation of the viewer.

use depth_image::{PinholeCamera, Ray};
use fixtures::car;
use glam::{Affine3A, UVec2, Vec3};
use rayon::prelude::*;
use report::{Axis, Bar, Check, Mark, Point, Report, XyChart};

use super::placements::Placements;
use super::relief::{NEAR_M, Relief, ReliefImages};
use crate::failures::stand::Stand;
use crate::impostors::rays::unit_rays;
use crate::impostors::surfaces::Surfaces;
use crate::study::{Column, measure_rows, table, with_series};

/// The distortions of single poles, in half sides.
const DISTORTIONS: [f32; 5] = [0.15, 0.3, 0.45, 0.6, 0.75];
/// The distortion of reliefs.
pub const DISTORTION: f32 = 0.75;
const ELEVATIONS_DEG: [f32; 5] = [5.0, 15.0, 30.0, 45.0, 70.0];
/// The elevation of the bar.
const BAR_DEG: f32 = 15.0;
const VIEWS: u32 = 6;
const VIEW_PX: [UVec2; 2] = [UVec2::new(640, 480), UVec2::new(320, 240)];
const DISTANCE_M: f32 = 14.0;
const FOV_RAD: f32 = 0.32;
/// Ends within this share of the car's length are right.
const RIGHT: f32 = 0.01;

const PINHOLE: &str = "a pinhole from above";
pub const SINGLE_POLE: &str = "a single pole from above";
const TWO: &str = "two single poles";
const FOUR: &str = "four pinholes";
pub const IMAGES: [(&str, ReliefImages); 4] = [
    (PINHOLE, ReliefImages::Pinhole),
    (SINGLE_POLE, ReliefImages::SinglePole(DISTORTION)),
    (TWO, ReliefImages::TwoSinglePoles(DISTORTION)),
    (FOUR, ReliefImages::FourPinholes),
];

/// What images show of the car from one elevation.
struct CoverageRow {
    images: String,
    texels: usize,
    elevation_deg: f32,
    found_ratio: f64,
    wrong_ratio: f64,
}

impl CoverageRow {
    fn point(&self) -> Point {
        Point::from((f64::from(self.elevation_deg), self.found_ratio * 100.0))
    }
}

const COLUMNS: [Column<CoverageRow>; 5] = [
    Column::new("images", |row| row.images.as_str().into()),
    Column::new("texels", |row| row.texels.into()),
    Column::with_unit("elevation", "°", |row| row.elevation_deg.into()),
    Column::with_unit("found", "%", |row| (row.found_ratio * 100.0).into()),
    Column::with_unit("wrong", "%", |row| (row.wrong_ratio * 100.0).into()),
];

/// A car at the origin, and its rays from one elevation that meet it.
struct CarRays {
    rays: Vec<Ray>,
    ways_m: Vec<f32>,
}

impl CarRays {
    fn from_elevation(surfaces: &Surfaces, elevation_deg: f32, size_px: UVec2) -> Self {
        let mut from_all = Self { rays: Vec::new(), ways_m: Vec::new() };
        let middle = car().bounds().center();
        for view in 0..VIEWS {
            let azimuth = std::f32::consts::TAU * (view as f32 + 0.3) / VIEWS as f32;
            let elevation = elevation_deg.to_radians();
            let out = Vec3::Z.rotate_y(azimuth) * elevation.cos() + Vec3::Y * elevation.sin();
            let camera = PinholeCamera::looking_at(middle + out * DISTANCE_M, middle, Vec3::Y, FOV_RAD, size_px);
            let met = unit_rays(&camera).filter_map(|ray| {
                let met = surfaces.meet(&ray, [NEAR_M, 2.0 * DISTANCE_M])?;
                Some((ray, met.t))
            });
            let (rays, ways_m): (Vec<Ray>, Vec<f32>) = met.unzip();
            from_all.rays.extend(rays);
            from_all.ways_m.extend(ways_m);
        }
        from_all
    }
}

fn row(name: &str, relief: &Relief<'_>, elevation_deg: f32, rays: &CarRays) -> anyhow::Result<CoverageRow> {
    let placements = Placements::new(&[Affine3A::IDENTITY], relief.bounds)?;
    let hits = relief.follow(&placements, &rays.rays, &placements.entries_of(&rays.rays))?;
    let tolerance_m = RIGHT * relief.bounds.size().max_element();
    let ends = hits.iter().zip(&rays.ways_m);
    let errors_m = ends.filter_map(|(hit, way_m)| hit.map(|hit| (hit.t - way_m).abs()));
    let found = errors_m.clone().filter(|error_m| *error_m <= tolerance_m).count();
    let count = rays.rays.len().max(1) as f64;
    Ok(CoverageRow {
        images: name.to_owned(),
        texels: relief.texels,
        elevation_deg,
        found_ratio: found as f64 / count,
        wrong_ratio: (errors_m.count() - found) as f64 / count,
    })
}

/// Adds tables, charts and checks to a report.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let size_px = VIEW_PX[usize::from(is_quick)];
    let surfaces = Surfaces::new(&stand.upload(&car())?)?;
    let from_elevations =
        ELEVATIONS_DEG.map(|elevation_deg| (elevation_deg, CarRays::from_elevation(&surfaces, elevation_deg, size_px)));
    let rows = measure_rows("images of a car", IMAGES, |(name, images)| {
        let relief = Relief::take(stand, &car(), images)?;
        let rows = from_elevations.iter().map(|(elevation_deg, rays)| row(name, &relief, *elevation_deg, rays));
        rows.collect::<anyhow::Result<Vec<CoverageRow>>>()
    })?;
    let rows: Vec<CoverageRow> = rows.into_iter().flatten().collect();
    report.tables.push(table("The share of a car that its images show", &COLUMNS, &rows)?);
    let chart = XyChart::new(
        "What images show of a car, by the viewer's elevation",
        Axis::linear("elevation", "°"),
        Axis::linear("found", "%"),
    );
    report.charts.push(with_series(chart, &rows, Mark::Line, |row| row.images.clone(), CoverageRow::point));
    report.checks.extend(checks(&rows));
    by_distortion(stand, &from_elevations[1].1, report)
}

fn by_distortion(stand: &Stand, rays: &CarRays, report: &mut Report) -> anyhow::Result<()> {
    let rows = measure_rows("distortions", DISTORTIONS, |distortion| {
        let relief = Relief::take(stand, &car(), ReliefImages::SinglePole(distortion))?;
        row(&format!("distortion {distortion}"), &relief, BAR_DEG, rays)
    })?;
    report.tables.push(table("A single pole from above by its distortion in half sides, at 15°", &COLUMNS, &rows)?);
    Ok(())
}

fn found_at_bar(rows: &[CoverageRow], images: &str) -> f64 {
    let row = rows.iter().find(|row| row.images == images && row.elevation_deg == BAR_DEG);
    row.map_or(f64::NAN, |row| row.found_ratio)
}

fn checks(rows: &[CoverageRow]) -> Vec<Check> {
    let single_pole = found_at_bar(rows, SINGLE_POLE);
    vec![
        Check::new("a car from 15°: found in a single pole", single_pole, "", Bar::AtLeast(0.85)),
        Check::new(
            "a car from 15°: a single pole less a pinhole",
            single_pole - found_at_bar(rows, PINHOLE),
            "",
            Bar::AtLeast(0.12),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use engine::GpuEngine;
    use gpu::DevicePreference;

    use super::*;

    #[test]
    fn a_single_pole_shows_the_sides_of_a_car_and_a_pinhole_from_above_does_not() {
        let stand = Stand::new(&GpuEngine::shared(DevicePreference::Software).unwrap(), true);
        let surfaces = Surfaces::new(&stand.upload(&car()).unwrap()).unwrap();
        let rays = CarRays::from_elevation(&surfaces, BAR_DEG, UVec2::new(64, 48));
        let found = |images| {
            let relief = Relief::take(&stand, &car(), images).unwrap();
            row("", &relief, BAR_DEG, &rays).unwrap().found_ratio
        };
        let single_pole = found(ReliefImages::SinglePole(DISTORTION));
        let pinhole = found(ReliefImages::Pinhole);
        assert!(single_pole > 0.85 && single_pole > pinhole + 0.12, "{single_pole}, {pinhole}");
    }
}
