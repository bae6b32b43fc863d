//! The paper's figures 5 to 8, of what was measured.

use cluster::PolicyChoice;
use study::{Axis, BarChart, Chart, Series, XyChart};

use super::foretold::Foretold;
use super::matrix::{FEW_NODES, PAPER_VIEWS};
use super::paper::{PaperRow, TABLE_1};
use super::point::Point;
use super::tables::{STEPS, Told, naive, steps};

/// Policies that are measured, as they are called in legends.
const POLICIES: [PolicyChoice; 4] =
    [PolicyChoice::Pipeline, PolicyChoice::TimeShare, PolicyChoice::Auto, PolicyChoice::Direct];

/// All of them.
#[must_use]
pub fn charts(told: &Told<'_>) -> Vec<Chart> {
    // The paper's five nodes, or as many as there are.
    let nodes = told.node_counts().into_iter().filter(|&nodes| nodes <= FEW_NODES).max().unwrap_or(0);
    vec![total_time(told, nodes).into(), main_steps(told, nodes).into(), speedup(told).into(), scalability(told).into()]
}

/// Points of a policy at so many nodes, by V.
fn by_views<'a>(told: &'a Told<'_>, policy: PolicyChoice, nodes: usize) -> Vec<(&'a Point, &'a Foretold)> {
    let all = told.lit.points.iter().zip(&told.foretold);
    let mut of: Vec<_> = all.filter(|(point, _)| point.ask.policy == policy && point.nodes == nodes).collect();
    of.sort_by_key(|(point, _)| point.ask.views);
    of
}

fn total_time(told: &Told<'_>, nodes: usize) -> XyChart {
    let name = format!("Fig. 5: time between sets, P = {nodes}");
    let mut chart = XyChart::new(name, Axis::log("views V", ""), Axis::log("T", "s"));
    for policy in [PolicyChoice::Pipeline, PolicyChoice::TimeShare, PolicyChoice::Direct] {
        let points = by_views(told, policy, nodes);
        let measured = points.iter().map(|(point, _)| (point.ask.views as f64, point.period_s));
        chart = chart.with(Series::line(policy.to_string(), measured));
        let equation = points.iter().map(|(point, told)| (point.ask.views as f64, told.equation_s));
        chart = chart.with(Series::points(format!("{policy}, by the equation"), equation));
    }
    chart.note =
        "The naive parallelisation of the paper is `direct`. Equations: 2 for the pipeline, 1 for `direct`, all \
                  work over all nodes for time-share."
            .to_owned();
    chart
}

fn main_steps(told: &Told<'_>, nodes: usize) -> BarChart {
    let all = steps(told, nodes);
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
fn by_nodes(told: &Told<'_>, policy: PolicyChoice) -> Vec<(f64, f64)> {
    let at = |nodes: usize| {
        let efficiency = match policy {
            PolicyChoice::Direct => naive(told, nodes).map(|(efficiency, _)| efficiency),
            _ => told.find(policy, nodes, PAPER_VIEWS).map(|point| told.efficiency(point)),
        };
        efficiency.map(|efficiency| (nodes as f64, efficiency))
    };
    told.node_counts().into_iter().filter_map(at).collect()
}

fn of_the_paper(of: impl Fn(&PaperRow) -> f64) -> Vec<(f64, f64)> {
    TABLE_1.iter().map(|row| (row.nodes as f64, of(row))).collect()
}

fn with_all(mut chart: XyChart, told: &Told<'_>, value: impl Fn(f64, f64) -> f64) -> XyChart {
    let of = |points: Vec<(f64, f64)>| points.into_iter().map(|(p, e)| (p, value(p, e))).collect::<Vec<_>>();
    for policy in POLICIES {
        chart = chart.with(Series::line(policy.to_string(), of(by_nodes(told, policy))));
    }
    chart
        .with(Series::line("the paper, proposed", of(of_the_paper(|row| row.proposed))))
        .with(Series::line("the paper, naive", of(of_the_paper(|row| row.naive))))
}

const NAIVE_NOTE: &str = "`direct` is the paper's naive parallelisation, by the faster of triangles and rays; measured on \
                          the views that Table 1 says, whose time grows as V does.";

fn speedup(told: &Told<'_>) -> XyChart {
    let chart =
        XyChart::new("Fig. 7: speed-up at V = 1000", Axis::linear("nodes P", ""), Axis::linear("speed-up", "×"));
    let mut chart = with_all(chart, told, |nodes, efficiency| nodes * efficiency);
    chart.note = NAIVE_NOTE.to_owned();
    chart
}

fn scalability(told: &Told<'_>) -> XyChart {
    let chart =
        XyChart::new("Fig. 8: efficiency at V = 1000", Axis::linear("nodes P", ""), Axis::linear("efficiency", ""));
    let mut chart = with_all(chart, told, |_, efficiency| efficiency);
    chart.note = NAIVE_NOTE.to_owned();
    chart
}
