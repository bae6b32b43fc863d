//! Charts of lightings.

use render::Lighting;
use report::{Axis, Point, Series, XyChart};

use super::measure::Row;

fn labelled(row: &Row, x: f64, y: f64) -> Point {
    Point::labelled(x, y, row.lighting.to_string())
}

pub(super) fn ratio_chart(rows: &[Row], lamps: usize) -> XyChart {
    let points = rows
        .iter()
        .map(|row| labelled(row, row.rays_a_pixel(lamps), row.costs.reconstruct_view_s / row.costs.direct_view_s));
    let mut chart = XyChart::new("c / g against lighting", Axis::log("rays a pixel", ""), Axis::log("c / g_v", ""))
        .with(Series::line("c / g_v", points));
    chart.note = "Reconstructing a view costs the same in every light; drawing it does not.".to_owned();
    chart
}

pub(super) fn throughput_chart(rows: &[Row], lamps: usize) -> XyChart {
    let pipeline = rows.iter().filter_map(|row| {
        let (views, seconds) = row.pipelines.first()?;
        Some(labelled(row, row.rays_a_pixel(lamps), *views as f64 / seconds))
    });
    let direct = rows.iter().map(|row| (row.rays_a_pixel(lamps), row.direct_view_s.recip()));
    let views = rows.first().and_then(|row| row.pipelines.first()).map_or(0, |(views, _)| *views);
    XyChart::new(
        format!("Throughput against lighting, {views} views"),
        Axis::log("rays a pixel", ""),
        Axis::log("delivered", "views/s"),
    )
    .with(Series::line("pipeline", pipeline))
    .with(Series::line("direct", direct))
}

/// The numbers of views along the chart's axis.
const VIEWS: [usize; 7] = [1, 3, 10, 32, 100, 290, 1000];

/// The measured points of a series that only predicts.
const NONE: [Point; 0] = [];

pub(super) fn total_time_chart(rows: &[Row]) -> XyChart {
    let chart =
        XyChart::new("Total time against views, by lighting", Axis::log("views V", ""), Axis::log("total time", "s"));
    let mut chart = rows.iter().filter(|row| row.lighting != Lighting::default()).fold(chart, |chart, row| {
        let direct = VIEWS.map(|views| (views as f64, row.direct_view_s * views as f64));
        let predicted = VIEWS.map(|views| (views as f64, row.predicted_s(views)));
        let measured = row.pipelines.iter().map(|&(views, seconds)| (views as f64, seconds));
        chart
            .with(Series::line(format!("direct, {}", row.lighting), NONE).then_extrapolated(direct))
            .with(Series::line(format!("pipeline, {}", row.lighting), NONE).then_extrapolated(predicted))
            .with(Series::points(format!("pipeline, {}, delivered", row.lighting), measured))
    });
    chart.note = "Dashed: predicted from the parts, S·g_s + d + V·(c + e), or from direct rendering's timed views. Points: delivered to a client.".to_owned();
    chart
}
