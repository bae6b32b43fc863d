//! Figures 5 and 6 of the paper.

use report::{Axis, BarChart, Series, XyChart};

use super::timing::{Run, Times};

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

/// The stages, left to right.
const STAGES: [&str; 6] = ["sampling", "transfer", "decode and upload", "compositing", "encode", "delivery"];

/// The time of each stage at the headline's V.
pub fn stages(times: &Times) -> BarChart {
    let runs = times
        .pipelines
        .iter()
        .filter_map(|(name, runs)| Some((name.clone(), runs.iter().find(|run| run.views == times.headline_views)?)));
    let mut bars: Vec<(String, [f64; 6])> =
        runs.map(|(name, run)| (name, pipeline_stages(run, times.images))).collect();
    bars.extend(
        times
            .direct
            .last()
            .map(|run| (format!("direct, extended from {} views", run.views), direct_stages(run, times))),
    );
    let names: Vec<String> = bars.iter().map(|(name, _)| name.clone()).collect();
    let mut chart = BarChart::new(
        format!("Time per stage, {} views", times.headline_views),
        Axis::linear("total time", "s"),
        names,
    );
    for (stage, name) in STAGES.into_iter().enumerate() {
        chart = chart.with(name, bars.iter().map(|(_, parts)| parts[stage]));
    }
    chart.note = "Sampling, decode and upload, compositing and encode are costs measured alone, times their number; transfer is the rest of the wait for the set, delivery the rest of the total. Stages overlap: where the parts exceed the total, the rest is 0.".to_owned();
    chart
}

fn pipeline_stages(run: &Run, images: usize) -> [f64; 6] {
    let costs = run.plan.costs;
    let views = run.views as f64;
    let sampling = images as f64 * costs.sample_image_s;
    let loading = run.plan.assignment.compositors.len() as f64 * costs.load_set_s;
    let transfer = (run.set_wait_s - sampling - loading).max(0.0);
    let compositing = views * costs.reconstruct_view_s;
    let encode = views * costs.encode_view_s;
    let delivery = (run.seconds - sampling - transfer - loading - compositing - encode).max(0.0);
    [sampling, transfer, loading, compositing, encode, delivery]
}

fn direct_stages(run: &Run, times: &Times) -> [f64; 6] {
    let costs = run.plan.costs;
    let views = times.headline_views as f64;
    let drawing = views * costs.direct_view_s;
    let encode = views * costs.encode_view_s;
    let delivery = (times.direct_view_s() * views - drawing - encode).max(0.0);
    [0.0, 0.0, 0.0, drawing, encode, delivery]
}
