//! The maze: what a mirror teapot meets in it, in graph images, in pinholes from above and in a layered cube (Rosen et al., section 5).

mod cameras;
mod footprints;
mod found;
mod geometry;
mod pictures;
mod rooms;
mod subject;
mod walk;

use anyhow::Context as _;
use fixtures::Maze;
use glam::UVec2;
use report::{Axis, Bar, Check, Mark, Point, Report, XyChart};

use self::found::{APART, Found, NESTED, PINHOLES};
use self::subject::Subject;
use crate::failures::stand::Stand;
use crate::graph::GraphImage;
use crate::study::{measure_rows, table, with_series};

/// Heights of walls that are not roofed, in full and in quick runs; corridors are 0.9 m wide.
const HEIGHTS_M: [&[f32]; 2] = [&[0.5, 1.0, 1.5, 2.0, 3.0], &[1.0, 3.0]];
const ROOFED_M: f32 = 1.0;
/// The views whose rays are followed, in full and in quick runs.
const VIEW_PX: [UVec2; 2] = [UVec2::new(96, 72), UVec2::new(48, 36)];

/// Adds the parts of the maze to a report.
///
/// # Errors
/// The device fails.
pub fn measure(stand: &Stand, is_quick: bool, report: &mut Report) -> anyhow::Result<()> {
    let size = usize::from(is_quick);
    let open = HEIGHTS_M[size].iter().map(|&height_m| Maze::new(height_m, false));
    let mazes: Vec<Maze> = open.chain([Maze::new(ROOFED_M, true)]).collect();
    geometry::measure(&mazes[0], report)?;
    let rows = measure_rows("mazes", mazes, |maze| {
        let subject = Subject::new(stand, maze)?;
        found::compare(&subject, &subject.mirrored_rays(VIEW_PX[size]))
    })?;
    let rows: Vec<Found> = rows.into_iter().flatten().collect();
    report.tables.push(table(found::TITLE, &found::COLUMNS, &rows)?);
    report.checks.extend(checks(&rows)?);
    report.charts.push(by_height(&rows));
    for height_m in [1.0, 3.0] {
        in_detail(&Subject::new(stand, Maze::new(height_m, false))?, VIEW_PX[size], report)?;
    }
    Ok(())
}

/// Steps, footprints and pictures of one maze.
fn in_detail(subject: &Subject<'_>, view_px: UVec2, report: &mut Report) -> anyhow::Result<()> {
    let name = subject.name();
    let [nested, apart] = [cameras::nested(&subject.maze)?, cameras::apart(&subject.maze)?];
    let [nested, apart] = [&nested, &apart].map(|camera| GraphImage::take(camera, |ray, span| subject.meet(ray, span)));
    walk::measure(&name, &nested, &subject.mirrored_rays(view_px), report)?;
    footprints::report(&name, &nested, &apart, report)?;
    let image = report::PictureRow {
        title: format!("{name}: the graph image"),
        pictures: vec![pictures::graph_image(&name, &nested)],
    };
    report.pictures.push(image);
    report.pictures.extend(pictures::reflections(subject, &nested, &apart)?);
    Ok(())
}

fn by_height(rows: &[Found]) -> XyChart {
    let chart = XyChart::new(
        "Found against the height of walls",
        Axis::linear("height over the corridor's width", ""),
        Axis::linear("found", "%"),
    );
    let open: Vec<AtHeight> = rows.iter().filter_map(AtHeight::of).collect();
    with_series(chart, &open, Mark::Line, |at| at.images.to_owned(), AtHeight::point)
}

/// A place in the chart of heights.
struct AtHeight {
    images: &'static str,
    height_m: f64,
    found_ratio: f64,
}

impl AtHeight {
    fn point(&self) -> Point {
        let width_m = 1.0 - f64::from(fixtures::MAZE_WALL_M);
        Point::from((self.height_m / width_m, self.found_ratio * 100.0))
    }

    /// `None` under a roof.
    fn of(row: &Found) -> Option<Self> {
        let height_m = row.scene.strip_prefix("maze:")?.parse().ok()?;
        Some(Self { images: row.images, height_m, found_ratio: row.found_ratio })
    }
}

fn checks(rows: &[Found]) -> anyhow::Result<Vec<Check>> {
    let bars = [
        ("maze:1", PINHOLES, Bar::AtLeast(0.99)),
        ("maze:3", PINHOLES, Bar::AtMost(0.75)),
        ("maze:3", NESTED, Bar::AtLeast(0.95)),
        ("maze:3", APART, Bar::AtLeast(0.95)),
    ];
    let checks = bars.into_iter().map(|(scene, images, bar)| {
        let row = rows.iter().find(|row| row.scene == scene && row.images == images);
        let row = row.with_context(|| format!("{images} of {scene} were not measured"))?;
        Ok(Check::new(format!("{scene}: rays found in {images}"), row.found_ratio, "", bar))
    });
    checks.collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::graph::Met;

    const HEIGHT_M: f32 = 2.0;

    #[test]
    fn every_cell_of_a_maze_lies_in_a_frustum() {
        let maze = Maze::new(HEIGHT_M, false);
        for camera in [cameras::nested(&maze).unwrap(), cameras::apart(&maze).unwrap()] {
            for cell in maze.corridors.iter().flat_map(fixtures::Corridor::cells) {
                for [x, z] in [[0.0, 0.0], [0.4, 0.4], [-0.4, 0.3], [-0.44, -0.1]] {
                    let point = Maze::middle(cell).as_dvec3() + DVec3::new(x, 1.0, z);
                    let frustum = camera.frustum_of(point).unwrap();
                    assert!(camera.frusta[frustum].depth_m(point) >= -1e-6, "{cell}");
                }
            }
        }
    }

    #[test]
    fn frusta_that_are_apart_have_as_many_texels_as_the_nested_image() {
        let maze = Maze::new(HEIGHT_M, true);
        let texels = [cameras::nested(&maze).unwrap(), cameras::apart(&maze).unwrap()].map(|camera| camera.texels());
        assert!(texels[0].abs_diff(texels[1]) * 100 < texels[0], "{texels:?}");
    }

    /// Texels of a nested image grow with the depth, those of frusta that are apart do not.
    #[test]
    fn nested_texels_grow_into_corridors_and_others_do_not() {
        use crate::graph::test_support::Zigzag;
        use crate::graph::{GraphImage, Layout};
        let zigzag = Zigzag::new(5, UVec2::new(240, 150));
        let sides_m = |layout: &Layout| -> Vec<f64> {
            let camera = zigzag.camera(layout);
            let meet = |ray: &depth_image::Ray, span| -> Option<Met> { zigzag.meet(ray, span) };
            let footprints = footprints::by_level(&GraphImage::take(&camera, meet));
            footprints.iter().map(|of| of.side_m.unwrap()).collect()
        };
        let nested = sides_m(&Layout::Nested);
        assert!(nested.windows(2).all(|pair| pair[1] > 1.2 * pair[0]), "{nested:?}");
        let apart = sides_m(&Layout::Apart(vec![UVec2::new(107, 67); 5]));
        assert!(apart[1..].windows(2).all(|pair| (pair[1] / pair[0] - 1.0).abs() < 0.3), "{apart:?}");
    }
}
