//! Figure 5 of the paper.

use report::{Axis, Series, XyChart};

use super::timing::Times;

/// Total time against V; direct rendering is timed on few views and extended.
pub fn total_time(times: &Times) -> XyChart {
    let timed = times.direct.iter().map(|run| (run.views as f64, run.seconds));
    let most = times.direct.last().map_or(0, |run| run.views);
    let counts: Vec<usize> = times.first_pipeline().iter().map(|run| run.views).collect();
    let beyond =
        counts.iter().filter(|&&views| views > most).map(|&views| (views as f64, times.direct_view_s() * views as f64));
    let direct = Series::line("direct", timed).then_extrapolated(beyond);
    let chart =
        XyChart::new("Total time against views", Axis::log("views V", ""), Axis::log("total time", "s")).with(direct);
    let mut chart = times.pipelines.iter().fold(chart, |chart, (name, runs)| {
        chart.with(Series::line(name.clone(), runs.iter().map(|run| (run.views as f64, run.seconds))))
    });
    chart.note = "From the request until the last view is decoded by the client, the samples included.".to_owned();
    chart
}
