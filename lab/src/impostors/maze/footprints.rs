//! How coarse an image is, the deeper in the tree of frusta.

use glam::UVec2;
use report::{Axis, Cell, Point, Report, Series, Table, XyChart};

use crate::graph::{CORNERS, GraphImage};
use crate::statistics::median;

/// The median side of a texel on surfaces, in metres, by the faces on the way from the root; the texels that show something there.
pub fn by_level(image: &GraphImage<'_>) -> Vec<Footprint> {
    let levels = image.camera.frusta.iter().map(|frustum| frustum.level).max().unwrap_or(0);
    let mut sides_m = vec![Vec::new(); levels + 1];
    for part in &image.parts {
        let cells = (0..part.size_px.y - 1).flat_map(|y| (0..part.size_px.x - 1).map(move |x| UVec2::new(x, y)));
        for cell in cells.filter(|cell| part.is_connected(*cell)) {
            let [Some(first), Some(right), Some(below), _] = part.corners(cell) else { continue };
            let corners = [(first, CORNERS[0]), (right, CORNERS[1]), (below, CORNERS[2])];
            let [origin, right, below] = corners.map(|(sample, corner)| image.point(&sample, cell + corner));
            let area_m2 = (right - origin).cross(below - origin).length();
            sides_m[image.camera.frusta[first.frustum()].level].push(area_m2.sqrt());
        }
    }
    let levels = sides_m.into_iter().enumerate();
    let footprints = levels.map(|(level, sides_m)| {
        let texels = sides_m.len();
        Footprint { level, texels, side_m: if texels == 0 { None } else { Some(median(sides_m)) } }
    });
    footprints.collect()
}

/// The texels of one level.
#[derive(Debug, Clone, Copy)]
pub struct Footprint {
    pub level: usize,
    pub texels: usize,
    /// `None` without texels.
    pub side_m: Option<f64>,
}

/// Adds a table and a chart of both layouts.
///
/// # Errors
/// A row does not fit the table.
pub fn report(name: &str, nested: &GraphImage<'_>, apart: &GraphImage<'_>, report: &mut Report) -> anyhow::Result<()> {
    let both = [nested, apart].map(by_level);
    let columns =
        [("faces", ""), ("nested: texel", "mm"), ("nested: texels", ""), ("apart: texel", "mm"), ("apart: texels", "")];
    let mut table = Table::new(format!("Median side of texels by the depth into {name}"), &columns);
    for (nested, apart) in both[0].iter().zip(&both[1]) {
        let cells = [nested, apart].into_iter().flat_map(|of| [of.side_m.map(|m| m * 1e3).into(), of.texels.into()]);
        table.push([Cell::from(nested.level)].into_iter().chain(cells))?;
    }
    report.tables.push(table);
    let chart = XyChart::new(
        format!("Texels against the depth into {name}"),
        Axis::linear("faces", ""),
        Axis::log("side of a texel", "mm"),
    );
    let series = [("nested", &both[0]), ("apart", &both[1])].map(|(layout, levels)| {
        Series::line(layout, levels.iter().filter_map(|of| Some(Point::from((of.level as f64, of.side_m? * 1e3)))))
    });
    report.charts.push(series.into_iter().fold(chart, XyChart::with));
    Ok(())
}
