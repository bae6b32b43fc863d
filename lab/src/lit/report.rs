//! The table and the chart of a subject.

use report::{Axis, Cell, Mark, Point, Report, Series, XyChart};

use super::measure::{Drawing, LightFront, LightRow};
use crate::pareto::{Better, with_front};
use crate::study::{Column, table, with_series};

/// A row beside direct drawing.
struct ComparedRow<'f> {
    row: &'f LightRow,
    is_on_front: bool,
    /// `None` in direct drawing, as all that follows.
    gain: Option<Cell>,
    /// The number of views from which sampling and all views take less time than direct drawing.
    faster_from: Option<f64>,
}

fn columns<'f>() -> [Column<ComparedRow<'f>>; 12] {
    [
        Column::new("representation", |row| row.row.drawing.to_string().into()),
        Column::new("samples", |row| row.row.set.map(|set| set.sampling.to_string()).into()),
        Column::new("S", |row| row.row.set.map(|set| set.images).into()),
        Column::new("density", |row| row.row.set.map(|set| set.density).into()),
        Column::with_unit("a view", "ms", |row| row.row.view_ms.into()),
        Column::with_unit("sampling", "s", |row| row.row.set.map(|_| row.row.sampled.seconds).into()),
        Column::new("FLIP", |row| row.row.flip.into()),
        Column::with_unit("PSNR", "dB", |row| row.row.psnr_db.into()),
        Column::with_unit("unknown", "%", |row| row.row.unknown.map(|share| share * 100.0).into()),
        Column::new("on the front", |row| row.is_on_front.into()),
        Column::with_unit("gain at equal FLIP", "×", |row| row.gain.clone().unwrap_or(Cell::Missing)),
        Column::with_unit("faster than direct from", "views", |row| row.faster_from.into()),
    ]
}

/// Adds a subject's table and chart.
///
/// # Errors
/// A row that does not fit its table.
pub fn add_to(report: &mut Report, front: &LightFront) -> anyhow::Result<()> {
    report.parameter(format!("{}: truth", front.name()), front.truth.as_str());
    let rows: Vec<ComparedRow<'_>> = front.rows.iter().map(|row| ComparedRow::new(front, row)).collect();
    report.tables.push(table(format!("Expensive light, {}", front.name()), &columns(), &rows)?);
    report.charts.push(chart(front));
    Ok(())
}

impl<'f> ComparedRow<'f> {
    fn new(front: &LightFront, row: &'f LightRow) -> Self {
        let direct = front.direct();
        let saved_s = (direct.least_ms_at(row.flip) - row.view_ms) * 1e-3;
        let faster_from = (saved_s > 0.0).then(|| (row.sampled.seconds / saved_s).floor() + 1.0);
        Self {
            row,
            is_on_front: front.is_on_front(row),
            gain: row.set.map(|_| direct.gain(&row.point())),
            faster_from: row.set.and(faster_from),
        }
    }
}

fn chart(front: &LightFront) -> XyChart {
    let title = format!("FLIP against time, {}", front.name());
    let chart = XyChart::new(title, Axis::log("a view", "ms"), Axis::log("Foreground FLIP", ""));
    let direct: Vec<Point> = front.rows.iter().filter(|row| row.is_direct()).map(point).collect();
    let others: Vec<LightRow> = front.rows.iter().filter(|row| !row.is_direct()).cloned().collect();
    let chart = chart.with(Series::line("direct", direct));
    let mut chart = with_series(chart, &others, Mark::Points, |row| row.drawing.to_string(), point);
    chart = with_front(chart, [Better::Low, Better::Low]);
    chart.note =
        "Sampling is not part of the time of a view. Labels: rays of occlusion or of indirect light a position, in \
        direct drawing."
            .to_owned();
    chart
}

fn point(row: &LightRow) -> Point {
    let label = match row.drawing {
        Drawing::Direct(rays) => rays.ambient.to_string(),
        Drawing::LightCache(_) | Drawing::JointCarve => String::new(),
    };
    Point::labelled(row.view_ms, row.flip, label)
}
