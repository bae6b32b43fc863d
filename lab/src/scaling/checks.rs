//! What is promised of the measured points.

use cluster::PolicyChoice;
use study::{Bar, Check};

use super::matrix::{Extent, PAPER_NODES, PAPER_VIEWS, TILED_VIEWS};
use super::measured::Measured;
use super::paper::table_1;
use super::tables::{Told, naive};
use super::whole_images;

/// Of the simulation from what was measured.
const SIMULATED_WITHIN: f64 = 0.1;
/// Cores that other programs may have while anything is measured.
const QUIET_CORES: f64 = 0.1;
/// Of the processor time that compositors had, at the most nodes and views.
const USED: f64 = 0.9;
/// Of the quick form.
const QUICK_S: f64 = 600.0;

/// All of them.
#[must_use]
pub fn checks(measured: &Measured, told: &[Told<'_>], extent: Extent) -> Vec<Check> {
    let Some(main) = told.first() else { return Vec::new() };
    let mut checks: Vec<Check> =
        [PolicyChoice::Pipeline, PolicyChoice::Auto].into_iter().map(|policy| efficient(main, policy)).collect();
    checks.push(naive_beside(main));
    checks.extend(tiles_pay(told.get(1), extent.nodes));
    checks.extend(simulated(told));
    checks.push(quiet(told));
    checks.push(equal_shares(main));
    let seconds = (extent.quick && told.len() == 1).then_some(measured.seconds);
    let not_quick = "this was the full form, or dear light was measured, too";
    checks.push(Check::maybe("time of the quick form", seconds, "s", Bar::AtMost(QUICK_S), not_quick));
    checks
}

const NOT_MEASURED: &str = "it was not measured at eleven nodes and 1000 views";

fn efficient(told: &Told<'_>, policy: PolicyChoice) -> Check {
    let value = told.find(policy, PAPER_NODES, PAPER_VIEWS).map(|point| told.efficiency(point));
    let bar = table_1(PAPER_NODES).map_or(f64::NAN, |row| row.proposed);
    let name = format!("efficiency of {policy} at P = 11, V = 1000 (the paper's: {bar})");
    Check::maybe(name, value, "", Bar::AtLeast(bar), NOT_MEASURED)
}

/// Sharing pays: what the paper shows with 0.829 beside 0.110.
fn naive_beside(told: &Told<'_>) -> Check {
    let shared = told.find(PolicyChoice::Pipeline, PAPER_NODES, PAPER_VIEWS).map(|point| told.efficiency(point));
    let naive = naive(told, PAPER_NODES).map(|(efficiency, _)| efficiency);
    let value = shared.zip(naive).map(|(shared, naive)| shared / naive);
    let name = "pipeline over naive at P = 11, V = 1000, efficiency (the paper's: 7.5)";
    Check::maybe(name, value, "×", Bar::AtLeast(1.0), NOT_MEASURED)
}

/// Where light is dear, images are cut: what whole ones allow at the best is passed.
fn tiles_pay(dear: Option<&Told<'_>>, nodes: usize) -> [Check; 2] {
    let of = |ratio: fn(&Told<'_>, usize, usize) -> Option<f64>| dear.and_then(|dear| ratio(dear, nodes, TILED_VIEWS));
    let at = format!("P = {nodes}, V = {TILED_VIEWS}, dear light, pipeline");
    let not = "no dear light was asked for";
    let over_bound = of(whole_images::over_bound);
    [
        Check::maybe(format!("{at}: over the bound of whole images"), over_bound, "×", Bar::AtLeast(1.0), not),
        Check::maybe(format!("{at}: over whole images"), of(whole_images::over_whole), "×", Bar::AtLeast(1.0), not),
    ]
}

fn simulated(told: &[Told<'_>]) -> [Check; 2] {
    let off = told.iter().flat_map(|told| {
        told.lit.points.iter().zip(&told.foretold).map(|(point, told)| (told.simulated_s / point.period_s - 1.0).abs())
    });
    // NaN is no small error, wherever it stands.
    let most = off.fold(0.0, |most: f64, off| if most.is_nan() || off <= most { most } else { off });
    let others = told.iter().flat_map(|told| &told.foretold).filter(|told| !told.same_plan).count();
    [
        Check::new("simulated T off the measured, worst point", most, "", Bar::AtMost(SIMULATED_WITHIN)),
        Check::new("points that the simulated schedule plans otherwise", others as f64, "", Bar::Equal(0.0)),
    ]
}

/// Whoever else used the processors has made these figures worse, and unevenly so.
fn quiet(told: &[Told<'_>]) -> Check {
    let points = told.iter().flat_map(|told| &told.lit.points);
    let most = points.map(|point| point.window.others_cores()).fold(0.0, f64::max);
    Check::new("cores that other programs had meanwhile, worst point", most, "cores", Bar::AtMost(QUIET_CORES))
}

/// What a compositor waits for is its quota: otherwise nodes would hold each other up, and P would not be P.
fn equal_shares(told: &Told<'_>) -> Check {
    let value = told.find(PolicyChoice::Auto, PAPER_NODES, PAPER_VIEWS).map(|point| point.window.used_share());
    Check::maybe(
        "share of their quotas that nodes used, auto, P = 11, V = 1000",
        value,
        "",
        Bar::AtLeast(USED),
        NOT_MEASURED,
    )
}
