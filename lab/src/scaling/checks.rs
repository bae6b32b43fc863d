//! Checks of the measured points.

use cluster::PolicyChoice;
use report::{Bar, Check};

use super::matrix::{Extent, Form, PAPER_NODES, PAPER_VIEWS};
use super::paper::{TABLE_1, table_1};
use super::results::Results;
use crate::study::check_if_measured;

/// The share of their processor time that nodes must use, at the most nodes and views.
const USED: f64 = 0.9;
/// The efficiency that shared light must reach at every number of nodes.
const LIT_EFFICIENCY: f64 = 0.88;
/// The longest time of the quick form, seconds.
const QUICK_S: f64 = 600.0;
const NOT_MEASURED: &str = "it was not measured at eleven nodes and 1000 views";

/// All checks of the measured points.
pub fn checks(results: &Results, extent: Extent) -> Vec<Check> {
    let policies = [PolicyChoice::Pipeline, PolicyChoice::Auto];
    let [pipeline, auto] = policies.map(|policy| results.find(policy, PAPER_NODES, PAPER_VIEWS));
    let efficiencies = [pipeline, auto].map(|point| point.map(|point| results.efficiency(point)));
    let paper = table_1(PAPER_NODES).map_or(f64::NAN, |row| row.proposed);
    let lit = results.node_counts().into_iter().filter(|_| extent.is_lit).map(|nodes| {
        let auto = results.find(PolicyChoice::Auto, nodes, PAPER_VIEWS);
        let name = format!("efficiency of auto at P = {nodes}, V = 1000, shared light");
        check_if_measured(
            name,
            auto.map(|point| results.efficiency(point)),
            "",
            Bar::AtLeast(LIT_EFFICIENCY),
            NOT_MEASURED,
        )
    });
    let efficient = policies.into_iter().zip(efficiencies).map(|(policy, efficiency)| {
        let name = format!("efficiency of {policy} at P = 11, V = 1000 (the paper's: {paper})");
        check_if_measured(name, efficiency, "", Bar::AtLeast(paper), NOT_MEASURED)
    });
    // At eleven nodes above.
    let fewer = TABLE_1.iter().filter(|row| extent.form != Form::Quick && row.nodes < PAPER_NODES).map(|row| {
        let auto = results.find(PolicyChoice::Auto, row.nodes, PAPER_VIEWS);
        let name = format!("efficiency of auto at P = {}, V = 1000 (the paper's: {})", row.nodes, row.proposed);
        let efficiency = auto.map(|point| results.efficiency(point));
        check_if_measured(name, efficiency, "", Bar::AtLeast(row.proposed), NOT_MEASURED)
    });
    let naive = results.naive(PAPER_NODES).map(|(efficiency, _)| efficiency);
    let over_naive = efficiencies[0].zip(naive).map(|(shared, naive)| shared / naive);
    let other_plans = results.points.iter().filter(|point| !point.prediction.same_plan).count();
    let used = auto.map(|point| point.window.used_share());
    let seconds = (extent.form == Form::Quick).then_some(results.seconds);
    let others = [
        check_if_measured(
            "pipeline over naive at P = 11, V = 1000, efficiency (the paper's: 7.5)",
            over_naive,
            "×",
            Bar::AtLeast(1.0),
            NOT_MEASURED,
        ),
        Check::new("points that the simulated schedule plans otherwise", other_plans as f64, "", Bar::Equal(0.0)),
        // Compositors wait for their quota alone; otherwise nodes delay each other.
        check_if_measured(
            "share of their quotas that nodes used, auto, P = 11, V = 1000",
            used,
            "",
            Bar::AtLeast(USED),
            NOT_MEASURED,
        ),
        check_if_measured("time of the quick form", seconds, "s", Bar::AtMost(QUICK_S), "this was another form"),
    ];
    efficient.chain(fewer).chain(lit).chain(others).collect()
}
