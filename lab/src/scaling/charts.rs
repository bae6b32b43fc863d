//! Figures 7 and 8 of the paper, from measured points.

use cluster::PolicyChoice;
use report::{Axis, Series, XyChart};

use super::matrix::PAPER_VIEWS;
use super::paper::TABLE_1;
use super::results::Results;

/// Policies of the legends.
const POLICIES: [PolicyChoice; 4] =
    [PolicyChoice::Pipeline, PolicyChoice::TimeShare, PolicyChoice::Auto, PolicyChoice::Direct];

/// Both charts.
pub fn charts(results: &Results) -> [XyChart; 2] {
    [
        chart("Fig. 7: speed-up at V = 1000", "speed-up", results, |nodes, efficiency| nodes * efficiency),
        chart("Fig. 8: efficiency at V = 1000", "efficiency", results, |_, efficiency| efficiency),
    ]
}

fn chart(name: &str, what: &str, results: &Results, value: fn(f64, f64) -> f64) -> XyChart {
    let mut chart = XyChart::new(name, Axis::linear("nodes P", ""), Axis::linear(what, ""));
    for policy in POLICIES {
        chart = chart.with(Series::line(policy.to_string(), by_nodes(results, policy, value)));
    }
    let proposed = TABLE_1.map(|row| (row.nodes as f64, row.proposed));
    let naive = TABLE_1.map(|row| (row.nodes as f64, row.naive));
    for (name, paper) in [("the paper, proposed", proposed), ("the paper, naive", naive)] {
        chart = chart.with(Series::line(name, paper.map(|(nodes, efficiency)| (nodes, value(nodes, efficiency)))));
    }
    chart.note =
        "`direct` is the paper's naive parallelisation, by the faster of triangles and rays; measured on the views \
                  that Table 1 says, whose time grows as V does."
            .to_owned();
    chart
}

/// A value of the efficiency of a policy at V = 1000, by P.
fn by_nodes(results: &Results, policy: PolicyChoice, value: fn(f64, f64) -> f64) -> Vec<(f64, f64)> {
    let points = results.node_counts().into_iter().filter_map(|nodes| {
        let efficiency = match policy {
            PolicyChoice::Direct => results.naive(nodes).map(|(efficiency, _)| efficiency),
            _ => results.find(policy, nodes, PAPER_VIEWS).map(|point| results.efficiency(point)),
        };
        efficiency.map(|efficiency| (nodes as f64, value(nodes as f64, efficiency)))
    });
    points.collect()
}
