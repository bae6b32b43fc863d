//! Directions of rays that have gone through a ball, against their closed form.

use anyhow::Context as _;
use depth_image::Ray;
use fixtures::{clear_glass, uv_sphere};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use render::scalar::sequence::point_of;
use report::{Axis, Bar, Check, Point, Report, Series, XyChart};
use scene::Volume;

use super::body::{Body, Emerged, Entry};
use super::inside::{InsideImages, cameras};
use crate::failures::stand::Stand;
use crate::graph::GraphCamera;
use crate::statistics::quantile;
use crate::study::{Column, measure_rows, table};

const IOR: f32 = 1.5;
/// The refractive indices of the curve.
const IORS: [f32; 6] = [1.05, 1.2, 1.33, 1.5, 2.0, 2.4];
/// The angles of incidence of the other curve, in degrees.
const INCIDENCES_DEG: [f32; 12] = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 85.0, 88.0, 89.5];
/// Rays around the axis at one angle.
const AROUND: u32 = 64;
const SEGMENTS: u32 = 512;
const RAYS: u32 = 4000;
/// Rays of the bar lie within this share of the radius.
const WITHIN: f32 = 0.95;
/// The viewer is so far away that its rays are parallel.
const EYE_M: f32 = 1000.0;

/// Ways to find the second surface of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SecondSurface {
    /// There is none: the ray goes on as the first surface bends it.
    OneInterface,
    /// The paper's guess (Wyman 2005).
    Wyman,
    InsideImages,
}

impl SecondSurface {
    pub const ALL: [Self; 3] = [Self::OneInterface, Self::Wyman, Self::InsideImages];

    pub fn name(self) -> &'static str {
        match self {
            Self::OneInterface => "one interface",
            Self::Wyman => "Wyman",
            Self::InsideImages => "inside images",
        }
    }
}

/// Errors of one way through a ball.
struct BallRow {
    ior: f32,
    method: SecondSurface,
    /// Errors in degrees, of rays within [`WITHIN`].
    median_deg: f64,
    most_deg: f64,
    /// The share of all rays that are totally reflected, which a ball does to none.
    reflected_ratio: f64,
}

const COLUMNS: [Column<BallRow>; 5] = [
    Column::new("n", |row| row.ior.into()),
    Column::new("the second surface", |row| row.method.name().into()),
    Column::with_unit("median", "°", |row| row.median_deg.into()),
    Column::with_unit("95 %", "°", |row| row.most_deg.into()),
    Column::with_unit("totally reflected", "%", |row| (row.reflected_ratio * 100.0).into()),
];

/// A ball of glass around the origin, seen along −z.
struct Ball<'c> {
    body: &'c Body,
    inside: InsideImages<'c>,
}

fn body(stand: &Stand, ior: f32) -> anyhow::Result<Body> {
    let mut scene = uv_sphere(1.0, SEGMENTS);
    scene.materials = vec![clear_glass("ball", ior, Some(Volume::CLEAR))];
    Body::new(stand, &scene)
}

impl<'c> Ball<'c> {
    fn new(body: &'c Body, cameras: &'c [GraphCamera]) -> Self {
        Self { body, inside: InsideImages::take(cameras, body) }
    }

    fn emerged(&self, method: SecondSurface, entries: &[Entry]) -> Vec<Emerged> {
        emerged(self.body, &self.inside, method, entries)
    }

    /// The entries of parallel rays beside the axis.
    fn entries(&self, places: &[Vec2]) -> Vec<Entry> {
        let entries = places.iter().filter_map(|place| {
            let eye = place.extend(EYE_M);
            // The triangles begin near the surface: parameters stay small.
            let ray = Ray { origin_in_world: place.extend(2.0), direction_in_world: Vec3::NEG_Z };
            self.body.entry(&ray).map(|entry| Entry { eye, ..entry })
        });
        entries.collect()
    }

    /// The angle to the direction in closed form, in degrees.
    fn error_deg(&self, entry: &Entry, emerged: &Emerged) -> f64 {
        let place = entry.eye.truncate();
        let beside = place.length().min(1.0);
        let turn = 2.0 * (beside.asin() - (beside / self.body.ior).asin());
        let expected = Vec3::NEG_Z * turn.cos() - place.normalize_or_zero().extend(0.0) * turn.sin();
        let found = emerged.ray.direction_in_world;
        // The tangent is exact for small angles.
        f64::from(found.cross(expected).length().atan2(found.dot(expected)).to_degrees())
    }

    fn row(&self, method: SecondSurface) -> BallRow {
        let places = (0..RAYS).map(|number| point_of(number, 3) * 2.0 - 1.0).filter(|place| place.length() < 1.0);
        let entries = self.entries(&places.collect::<Vec<Vec2>>());
        let emerged = self.emerged(method, &entries);
        let reflected = emerged.iter().filter(|emerged| emerged.is_reflected).count();
        let pairs = entries.iter().zip(&emerged).filter(|(entry, _)| entry.eye.truncate().length() < WITHIN);
        let errors: Vec<f64> = pairs.map(|(entry, emerged)| self.error_deg(entry, emerged)).collect();
        BallRow {
            ior: self.body.ior,
            method,
            median_deg: quantile(errors.clone(), 0.5),
            most_deg: quantile(errors, 0.95),
            reflected_ratio: reflected as f64 / emerged.len().max(1) as f64,
        }
    }

    /// Mean errors at the angles of incidence.
    fn by_incidence(&self, method: SecondSurface) -> Series {
        let mut points = Vec::new();
        for incidence_deg in INCIDENCES_DEG {
            let places = (0..AROUND).map(|number| {
                let azimuth = std::f32::consts::TAU * (number as f32 + 0.5) / AROUND as f32;
                Vec2::from_angle(azimuth) * incidence_deg.to_radians().sin()
            });
            let entries = self.entries(&places.collect::<Vec<Vec2>>());
            let emerged = self.emerged(method, &entries);
            let errors = entries.iter().zip(&emerged).map(|(entry, emerged)| self.error_deg(entry, emerged));
            let mean_deg = errors.sum::<f64>() / entries.len().max(1) as f64;
            points.push(Point::from((f64::from(incidence_deg), mean_deg)));
        }
        Series::line(method.name(), points)
    }
}

/// Follows rays through a body by one way.
pub fn emerged(body: &Body, inside: &InsideImages<'_>, method: SecondSurface, entries: &[Entry]) -> Vec<Emerged> {
    match method {
        SecondSurface::InsideImages => inside.emerged(body, entries),
        SecondSurface::Wyman => entries.par_iter().map(|entry| body.by_wyman(entry)).collect(),
        SecondSurface::OneInterface => entries.par_iter().map(|entry| body.by_one_interface(entry)).collect(),
    }
}

/// Adds table, charts and checks to a report.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, report: &mut Report) -> anyhow::Result<()> {
    let rows = measure_rows("balls of glass", IORS, |ior| {
        let body = body(stand, ior)?;
        let cameras = cameras(&body)?;
        let ball = Ball::new(&body, &cameras);
        Ok(SecondSurface::ALL.map(|method| ball.row(method)))
    })?;
    let rows: Vec<BallRow> = rows.into_iter().flatten().collect();
    report.tables.push(table(
        "Rays through a ball of glass within 0.95 of its radius: error of their direction",
        &COLUMNS,
        &rows,
    )?);
    report.charts.push(by_ior(&rows));
    report.checks.extend(checks(&rows)?);
    let body = body(stand, IOR)?;
    let cameras = cameras(&body)?;
    let ball = Ball::new(&body, &cameras);
    report.parameter("texels of images of a body's inside", ball.inside.texels());
    let chart = XyChart::new(
        "Error of the direction by the angle of incidence, n = 1.5",
        Axis::linear("incidence", "°"),
        Axis::linear("error", "°"),
    );
    report
        .charts
        .push(SecondSurface::ALL.map(|method| ball.by_incidence(method)).into_iter().fold(chart, XyChart::with));
    Ok(())
}

fn by_ior(rows: &[BallRow]) -> XyChart {
    let chart = XyChart::new(
        "Error of the direction by the refractive index, median",
        Axis::linear("n", ""),
        Axis::log("error", "°"),
    );
    SecondSurface::ALL.into_iter().fold(chart, |chart, method| {
        let of_method = rows.iter().filter(|row| row.method == method);
        chart.with(Series::line(
            method.name(),
            of_method.map(|row| Point::from((f64::from(row.ior), row.median_deg.max(1e-3)))),
        ))
    })
}

fn find(rows: &[BallRow], method: SecondSurface) -> anyhow::Result<&BallRow> {
    let row = rows.iter().find(|row| row.ior == IOR && row.method == method);
    row.with_context(|| format!("{} was not measured", method.name()))
}

fn checks(rows: &[BallRow]) -> anyhow::Result<Vec<Check>> {
    let inside = find(rows, SecondSurface::InsideImages)?;
    let wyman = find(rows, SecondSurface::Wyman)?;
    Ok(vec![
        Check::new("ball, n = 1.5, inside images: median", inside.median_deg, "°", Bar::AtMost(0.5)),
        Check::new("ball, n = 1.5, inside images: 95 %", inside.most_deg, "°", Bar::AtMost(2.0)),
        Check::new("ball, n = 1.5, Wyman: median, at least", wyman.median_deg, "°", Bar::AtLeast(1.3)),
        Check::new("ball, n = 1.5, Wyman: median, at most", wyman.median_deg, "°", Bar::AtMost(2.7)),
    ])
}

#[cfg(test)]
mod tests {
    use engine::GpuEngine;
    use gpu::DevicePreference;

    use super::*;

    /// The paper's guess is the worse the more glass bends, and images of the inside are right.
    #[test]
    fn guesses_fail_with_the_refractive_index_and_inside_images_do_not() {
        let stand = Stand::new(&GpuEngine::shared(DevicePreference::Software).unwrap(), true);
        let mut guesses_deg = Vec::new();
        for ior in [1.2, 1.5, 2.0] {
            let body = body(&stand, ior).unwrap();
            let cameras = cameras(&body).unwrap();
            let ball = Ball::new(&body, &cameras);
            let [one, wyman, inside] = SecondSurface::ALL.map(|method| ball.row(method));
            assert!(
                inside.median_deg < 0.05 && inside.most_deg < 0.2,
                "{ior}: {} {}",
                inside.median_deg,
                inside.most_deg
            );
            assert!(one.median_deg > 2.0 * wyman.median_deg, "{ior}: {} {}", one.median_deg, wyman.median_deg);
            assert!(inside.reflected_ratio < 0.01 && wyman.reflected_ratio > 0.05, "{ior}");
            guesses_deg.push(wyman.median_deg);
            let by_incidence = ball.by_incidence(SecondSurface::InsideImages);
            let mut below_grazing = by_incidence.points.iter().filter(|point| point.x <= 85.0);
            assert!(below_grazing.all(|point| point.y < 1.0), "{ior}: {:?}", by_incidence.points);
        }
        assert!(guesses_deg.windows(2).all(|pair| pair[1] > 2.0 * pair[0]), "{guesses_deg:?}");
    }

    #[test]
    fn grazing_rays_have_directions() {
        let stand = Stand::new(&GpuEngine::shared(DevicePreference::Software).unwrap(), true);
        let body = body(&stand, IOR).unwrap();
        let cameras = cameras(&body).unwrap();
        let ball = Ball::new(&body, &cameras);
        let places = [0.0, 0.999, 0.9999, 1.0].map(|beside| Vec2::new(0.0, beside));
        let entries = ball.entries(&places);
        for method in SecondSurface::ALL {
            let emerged = ball.emerged(method, &entries);
            assert!(emerged.iter().all(|end| end.ray.direction_in_world.is_finite()), "{method:?}");
            assert!(emerged.iter().all(|end| end.throughput_linear.is_finite()), "{method:?}");
        }
    }
}
