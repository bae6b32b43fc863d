//! Samples that sets leave unavailable, conventional and by pixel, against the distance of the viewpoints.
//!
//! The paper does not state its distances. They are taken to be those at which conventional images are as redundant here as there.
//! An image by pixel omits a sample whose triangle an earlier image has at that pixel. A frame sees the triangle at other points, which
//! may fall on the pixel beside it. The paper's metric counts such samples as unavailable, though the set has their triangle. So
//! availability is also measured with neighbouring pixels.

use glam::{FloatExt as _, UVec2};
use report::{Axis, Bar, Cell, Check, Limit, Report, Series, XyChart};

use super::availability::Availability;
use super::counts::{image_counts, percent};
use super::extent::Extent;
use super::held::ImageSurfaces;
use super::methods::METHODS;
use super::paper::{paper_available, paper_image};
use super::sizes::mean_of_later;
use super::subject::{Subject, WITH_IDS};
use crate::statistics::mean_of;
use crate::study::{Column, measure_rows, table};

/// The side of sample images, as in the paper: what `pixel` loses depends on the size of triangles in pixels.
const IMAGE_PX: u32 = 1024;
/// The most that `pixel` leaves unavailable over conventional sampling, where redundancy is the paper's and neighbours count.
const MOST_RATIO_AT_PAPER: f64 = 0.8;

/// One distance of the viewpoints, with frames of one size.
pub struct DistanceRow {
    scene: String,
    frame_px: u32,
    /// The distance of two viewpoints, in diagonals of the scene.
    distance: f64,
    /// Redundant samples of conventional images 1 and 2, per cent.
    redundant: f64,
    /// By the paper's metric: the same triangle at the same pixel.
    exact: Unavailable,
    /// The same triangle at the same pixel or one next to it.
    nearby: Unavailable,
}

/// Samples of frames that the images of a set do not hold, per cent.
struct Unavailable {
    conventional: f64,
    pixel: f64,
}

/// A scene's rows with frames of one size, beside the paper's figures.
struct Summary {
    scene: String,
    frame_px: u32,
    /// The least and the greatest measured distance at which `pixel` leaves fewer samples unavailable.
    wins: Option<[f64; 2]>,
    paper_redundant: f64,
    at_paper: Place,
    paper_ratio: Option<f64>,
}

/// A place on the curve of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    distance: f64,
    ratio: f64,
    nearby_ratio: f64,
}

const COLUMNS: [Column<DistanceRow>; 8] = [
    Column::new("scene", |row| row.scene.as_str().into()),
    Column::with_unit("frames", "px", |row| row.frame_px.into()),
    Column::with_unit("distance", "diagonals", |row| row.distance.into()),
    Column::with_unit("redundant", "%", |row| row.redundant.into()),
    Column::with_unit("unavailable, conventional", "%", |row| row.exact.conventional.into()),
    Column::with_unit("unavailable, pixel", "%", |row| row.exact.pixel.into()),
    Column::with_unit("pixel over conventional", "×", |row| row.exact.ratio().into()),
    Column::with_unit("the same, neighbours count", "×", |row| row.nearby.ratio().into()),
];

const SUMMARY: [Column<Summary>; 8] = [
    Column::new("scene", |row| row.scene.as_str().into()),
    Column::with_unit("frames", "px", |row| row.frame_px.into()),
    Column::with_unit("pixel leaves fewer unavailable from … to", "diagonals", |row| match row.wins {
        Some([least, greatest]) => Cell::from(format!("{least:.2} to {greatest:.2}")),
        None => Cell::from("none up to the scene's size"),
    }),
    Column::with_unit("paper: redundant", "%", |row| row.paper_redundant.into()),
    Column::with_unit("as redundant here at", "diagonals", |row| row.at_paper.distance.into()),
    Column::with_unit("pixel over conventional there", "×", |row| row.at_paper.ratio.into()),
    Column::with_unit("the same, neighbours count", "×", |row| row.at_paper.nearby_ratio.into()),
    Column::with_unit("paper: pixel over conventional", "×", |row| row.paper_ratio.into()),
];

/// Measures a scene at all distances.
///
/// # Errors
/// The device fails.
pub fn distances(subject: &Subject, extent: Extent) -> anyhow::Result<Vec<DistanceRow>> {
    let mut factors = extent.distances.to_vec();
    // The last distance is the scene's size.
    factors.push(1.0 / subject.viewpoint_distance());
    let name = format!("{}: distances of viewpoints", subject.name);
    let measured = measure_rows(&name, factors, |factor| at_distance(&subject.spread_by(factor), extent))?;
    Ok(measured.into_iter().flatten().collect())
}

/// The rows of all sizes of frames.
fn at_distance(subject: &Subject, extent: Extent) -> anyhow::Result<Vec<DistanceRow>> {
    let size_px = UVec2::splat(IMAGE_PX);
    let methods = &METHODS[..2];
    let sets =
        methods.iter().map(|&method| subject.sample(method, size_px, WITH_IDS)).collect::<Result<Vec<_>, _>>()?;
    let held: Vec<Vec<ImageSurfaces<'_>>> =
        sets.iter().map(|set| set.iter().filter_map(ImageSurfaces::of).collect()).collect();
    let redundant = mean_of_later(&image_counts(&sets)[0], |image| percent(image.redundant, image.samples));
    let mut rows = Vec::new();
    for &frame_px in extent.distance_frames_px {
        let mut exact = [Availability::default(), Availability::default()];
        let mut nearby = [Availability::within(1), Availability::within(1)];
        subject.each_frame(&subject.between(extent.distance_views, UVec2::splat(frame_px)), |frames| {
            for frame in frames {
                exact.iter_mut().zip(&held).for_each(|(available, set)| available.add(frame, set));
                nearby.iter_mut().zip(&held).for_each(|(available, set)| available.add(frame, set));
            }
            Ok(())
        })?;
        rows.push(DistanceRow {
            scene: subject.name.clone(),
            frame_px,
            distance: subject.viewpoint_distance().into(),
            redundant,
            exact: Unavailable::new(&exact),
            nearby: Unavailable::new(&nearby),
        });
    }
    Ok(rows)
}

impl Unavailable {
    fn new(available: &[Availability; 2]) -> Self {
        Self { conventional: 100.0 - available[0].mean(), pixel: 100.0 - available[1].mean() }
    }

    fn ratio(&self) -> f64 {
        self.pixel / self.conventional
    }
}

impl DistanceRow {
    /// The place between this row and another, at this share of the way.
    fn place_towards(&self, other: &Self, share: f64) -> Place {
        Place {
            distance: self.distance.lerp(other.distance, share),
            ratio: self.exact.ratio().lerp(other.exact.ratio(), share),
            nearby_ratio: self.nearby.ratio().lerp(other.nearby.ratio(), share),
        }
    }

    fn series(&self) -> String {
        format!("{}, {}²", self.scene, self.frame_px)
    }
}

impl Summary {
    /// Summarizes the rows of one scene and one size of frames, from the shortest distance on.
    fn new(rows: &[&DistanceRow]) -> Self {
        let first = rows[0];
        let [later, last] = [1, 2].map(|image| paper_image(&first.scene, METHODS[0], image).redundant);
        let paper_redundant = (later.unwrap_or(f64::NAN) + last.unwrap_or(f64::NAN)) / 2.0;
        let [conventional, pixel] = [0, 1].map(|method| paper_available(&first.scene, METHODS[method])[0]);
        let paper_ratio = conventional.zip(pixel).map(|(conventional, pixel)| (100.0 - pixel) / (100.0 - conventional));
        let winning: Vec<f64> = rows.iter().filter(|row| row.exact.ratio() < 1.0).map(|row| row.distance).collect();
        let wins = winning.first().zip(winning.last()).map(|(&least, &greatest)| [least, greatest]);
        Self {
            scene: first.scene.clone(),
            frame_px: first.frame_px,
            wins,
            paper_redundant,
            at_paper: where_redundant(rows, paper_redundant),
            paper_ratio,
        }
    }
}

/// The place at which conventional images are this redundant, between two rows; the nearest row's where no two rows enclose it.
fn where_redundant(rows: &[&DistanceRow], redundant: f64) -> Place {
    for pair in rows.windows(2) {
        let [near, far] = [pair[0], pair[1]];
        let share = (near.redundant - redundant) / (near.redundant - far.redundant);
        if (0.0..=1.0).contains(&share) {
            return near.place_towards(far, share);
        }
    }
    let first_is_nearer = (rows[0].redundant - redundant).abs() < (rows[rows.len() - 1].redundant - redundant).abs();
    let nearest = if first_is_nearer { rows[0] } else { rows[rows.len() - 1] };
    nearest.place_towards(nearest, 0.0)
}

/// Adds tables, curves and checks of all scenes.
///
/// # Errors
/// A row does not fit its table.
pub fn distances_report(rows: &[DistanceRow], extent: Extent, report: &mut Report) -> anyhow::Result<()> {
    let mut curves: Vec<Vec<&DistanceRow>> = Vec::new();
    for row in rows {
        match curves.iter_mut().find(|curve| curve[0].series() == row.series()) {
            Some(curve) => curve.push(row),
            None => curves.push(vec![row]),
        }
    }
    let summaries: Vec<Summary> = curves.iter().map(|curve| Summary::new(curve)).collect();
    report.tables.push(table("Distance of the viewpoints", &COLUMNS, rows)?);
    report.tables.push(table("Distance of the viewpoints, beside the paper", &SUMMARY, &summaries)?);
    let axis = Axis::log("distance of viewpoints", "diagonals of the scene");
    let y = Axis::linear("pixel over conventional", "×");
    let mut exact = XyChart::new("Unavailable samples", axis.clone(), y.clone());
    exact.limits.push(Limit { name: "as many as conventional".to_owned(), y: 1.0 });
    let mut nearby = XyChart::new("Unavailable samples, neighbouring pixels count", axis.clone(), y);
    nearby.limits = exact.limits.clone();
    let mut redundant = XyChart::new("Redundant samples of conventional images", axis, Axis::linear("redundant", "%"));
    for curve in &curves {
        let name = curve[0].series();
        exact = exact.with(Series::line(&name, curve.iter().map(|row| (row.distance, row.exact.ratio()))));
        nearby = nearby.with(Series::line(&name, curve.iter().map(|row| (row.distance, row.nearby.ratio()))));
        redundant = redundant.with(Series::line(&name, curve.iter().map(|row| (row.distance, row.redundant))));
    }
    report.charts.extend([exact, nearby, redundant]);
    for &frame_px in extent.distance_frames_px {
        let places: Vec<Place> =
            summaries.iter().filter(|row| row.frame_px == frame_px).map(|row| row.at_paper).collect();
        let name = format!("frames of {frame_px}²: unavailable at the paper's distances, pixel over conventional");
        report.parameter(name.clone(), mean_of(&places, |place| place.ratio));
        let nearby = mean_of(&places, |place| place.nearby_ratio);
        report.checks.push(Check::new(name + ", neighbours count", nearby, "×", Bar::AtMost(MOST_RATIO_AT_PAPER)));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(distance: f64, redundant: f64, ratio: f64) -> DistanceRow {
        DistanceRow {
            scene: "tree".to_owned(),
            frame_px: 512,
            distance,
            redundant,
            exact: Unavailable { conventional: 10.0, pixel: 10.0 * ratio },
            nearby: Unavailable { conventional: 10.0, pixel: 5.0 * ratio },
        }
    }

    #[test]
    fn the_papers_distance_lies_between_the_rows_that_enclose_its_redundancy() {
        let rows = [row(0.25, 60.0, 1.2), row(0.5, 40.0, 1.0), row(1.0, 18.0, 0.5)];
        let summary = Summary::new(&rows.iter().collect::<Vec<_>>());
        assert_eq!(summary.paper_redundant, 29.0);
        assert_eq!(summary.at_paper, Place { distance: 0.75, ratio: 0.75, nearby_ratio: 0.375 });
        assert!((summary.paper_ratio.unwrap() - 41.0 / 45.0).abs() < 1e-9);
        let nearest = where_redundant(&rows.iter().collect::<Vec<_>>(), 70.0);
        assert_eq!(nearest, Place { distance: 0.25, ratio: 1.2, nearby_ratio: 0.6 });
    }

    #[test]
    fn pixel_wins_between_the_first_and_the_last_ratio_below_1() {
        let wins = |ratios: [f64; 3]| {
            let rows = [row(0.25, 60.0, ratios[0]), row(0.5, 40.0, ratios[1]), row(1.0, 18.0, ratios[2])];
            Summary::new(&rows.iter().collect::<Vec<_>>()).wins
        };
        assert_eq!(wins([1.3, 0.9, 0.8]), Some([0.5, 1.0]));
        assert_eq!(wins([1.1, 0.8, 1.0]), Some([0.5, 0.5]));
        assert_eq!(wins([1.2, 1.1, 1.0]), None);
    }
}
