//! Figures 5 to 8 of the paper, from measured points.

use cluster::PolicyChoice;
use report::{Axis, BarChart, Chart, Series, XyChart};

use super::matrix::{FEW_NODES, PAPER_VIEWS};
use super::paper::{PaperRow, TABLE_1};
use super::point::Point;
use super::prediction::Prediction;
use super::results::{Results, STEPS};

/// Policies of the legends.
const POLICIES: [PolicyChoice; 4] =
    [PolicyChoice::Pipeline, PolicyChoice::TimeShare, PolicyChoice::Auto, PolicyChoice::Direct];

/// All four charts.
#[must_use]
pub fn charts(results: &Results<'_>) -> Vec<Chart> {
    // The paper's five nodes, or as many as there are.
    let nodes = results.node_counts().into_iter().filter(|&nodes| nodes <= FEW_NODES).max().unwrap_or(0);
    vec![
        total_time(results, nodes).into(),
        main_steps(results, nodes).into(),
        speedup(results).into(),
        scalability(results).into(),
    ]
}

/// Points of a policy at a number of nodes, by V.
fn by_views<'a>(results: &'a Results<'_>, policy: PolicyChoice, nodes: usize) -> Vec<(&'a Point, &'a Prediction)> {
    let all = results.lit.points.iter().zip(&results.predictions);
    let mut of: Vec<_> = all.filter(|(point, _)| point.settings.policy == policy && point.nodes == nodes).collect();
    of.sort_by_key(|(point, _)| point.settings.views);
    of
}

fn total_time(results: &Results<'_>, nodes: usize) -> XyChart {
    let name = format!("Fig. 5: time between sets, P = {nodes}");
    let mut chart = XyChart::new(name, Axis::log("views V", ""), Axis::log("T", "s"));
    for policy in [PolicyChoice::Pipeline, PolicyChoice::TimeShare, PolicyChoice::Direct] {
        let points = by_views(results, policy, nodes);
        let measured = points.iter().map(|(point, _)| (point.settings.views as f64, point.period_s));
        chart = chart.with(Series::line(policy.to_string(), measured));
        let equation = points.iter().map(|(point, prediction)| (point.settings.views as f64, prediction.equation_s));
        chart = chart.with(Series::points(format!("{policy}, by the equation"), equation));
    }
    chart.note =
        "The naive parallelisation of the paper is `direct`. Equations: 2 for the pipeline, 1 for `direct`, all \
                  work over all nodes for time-share."
            .to_owned();
    chart
}

fn main_steps(results: &Results<'_>, nodes: usize) -> BarChart {
    let all = results.steps(nodes);
    let bars = all.iter().map(|(views, _)| format!("{views} views"));
    let chart = BarChart::new(
        format!("Fig. 6: main steps of one set, P = {nodes}, pipeline"),
        Axis::linear("time, added up over nodes", "s"),
        bars,
    );
    let part =
        |chart: BarChart, (step, name): (usize, &&str)| chart.with(*name, all.iter().map(|(_, seconds)| seconds[step]));
    let mut chart = STEPS.iter().enumerate().fold(chart, part);
    chart.note = "Sampling, reconstruction and encoding as nodes timed them at work; loading as timed alone, once a \
                  compositor; transfer as fetched from a sampler that has the images, for every compositor; the client \
                  by its processor time."
        .to_owned();
    chart
}

/// Efficiency of a policy at V = 1000, by P.
fn by_nodes(results: &Results<'_>, policy: PolicyChoice) -> Vec<(f64, f64)> {
    let at = |nodes: usize| {
        let efficiency = match policy {
            PolicyChoice::Direct => results.naive(nodes).map(|(efficiency, _)| efficiency),
            _ => results.find(policy, nodes, PAPER_VIEWS).map(|point| results.efficiency(point)),
        };
        efficiency.map(|efficiency| (nodes as f64, efficiency))
    };
    results.node_counts().into_iter().filter_map(at).collect()
}

fn of_the_paper(of: impl Fn(&PaperRow) -> f64) -> Vec<(f64, f64)> {
    TABLE_1.iter().map(|row| (row.nodes as f64, of(row))).collect()
}

fn with_all(mut chart: XyChart, results: &Results<'_>, value: impl Fn(f64, f64) -> f64) -> XyChart {
    let of = |points: Vec<(f64, f64)>| points.into_iter().map(|(p, e)| (p, value(p, e))).collect::<Vec<_>>();
    for policy in POLICIES {
        chart = chart.with(Series::line(policy.to_string(), of(by_nodes(results, policy))));
    }
    chart
        .with(Series::line("the paper, proposed", of(of_the_paper(|row| row.proposed))))
        .with(Series::line("the paper, naive", of(of_the_paper(|row| row.naive))))
}

const NAIVE_NOTE: &str = "`direct` is the paper's naive parallelisation, by the faster of triangles and rays; measured on \
                          the views that Table 1 says, whose time grows as V does.";

fn speedup(results: &Results<'_>) -> XyChart {
    let chart =
        XyChart::new("Fig. 7: speed-up at V = 1000", Axis::linear("nodes P", ""), Axis::linear("speed-up", "×"));
    let mut chart = with_all(chart, results, |nodes, efficiency| nodes * efficiency);
    chart.note = NAIVE_NOTE.to_owned();
    chart
}

fn scalability(results: &Results<'_>) -> XyChart {
    let chart =
        XyChart::new("Fig. 8: efficiency at V = 1000", Axis::linear("nodes P", ""), Axis::linear("efficiency", ""));
    let mut chart = with_all(chart, results, |_, efficiency| efficiency);
    chart.note = NAIVE_NOTE.to_owned();
    chart
}
