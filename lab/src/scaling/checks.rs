//! Checks of the measured points.

use cluster::PolicyChoice;
use report::{Bar, Check};

use super::matrix::{Extent, PAPER_NODES, PAPER_VIEWS, TILED_VIEWS};
use super::measured::Measured;
use super::paper::table_1;
use super::results::Results;
use super::whole_images;

/// The largest relative difference between simulated and measured times.
const SIMULATED_WITHIN: f64 = 0.1;
/// Cores that other programs may use during a measurement.
const QUIET_CORES: f64 = 0.1;
/// The share of the processor time that compositors must use, at the most nodes and views.
const USED: f64 = 0.9;
/// The longest time of the quick form, seconds.
const QUICK_S: f64 = 600.0;

/// All checks of the measured points.
#[must_use]
pub fn checks(measured: &Measured, results: &[Results<'_>], extent: Extent) -> Vec<Check> {
    let Some(main) = results.first() else { return Vec::new() };
    let mut checks: Vec<Check> =
        [PolicyChoice::Pipeline, PolicyChoice::Auto].into_iter().map(|policy| efficient(main, policy)).collect();
    checks.push(naive_beside(main));
    checks.extend(tiles_pay(results.get(1), extent.nodes));
    checks.extend(simulated(results));
    checks.push(quiet(results));
    checks.push(equal_shares(main));
    let seconds = (extent.quick && results.len() == 1).then_some(measured.seconds);
    let not_quick = "this was the full form, or expensive lighting was measured, too";
    checks.push(Check::maybe("time of the quick form", seconds, "s", Bar::AtMost(QUICK_S), not_quick));
    checks
}

const NOT_MEASURED: &str = "it was not measured at eleven nodes and 1000 views";

fn efficient(results: &Results<'_>, policy: PolicyChoice) -> Check {
    let value = results.find(policy, PAPER_NODES, PAPER_VIEWS).map(|point| results.efficiency(point));
    let bar = table_1(PAPER_NODES).map_or(f64::NAN, |row| row.proposed);
    let name = format!("efficiency of {policy} at P = 11, V = 1000 (the paper's: {bar})");
    Check::maybe(name, value, "", Bar::AtLeast(bar), NOT_MEASURED)
}

/// Sharing pays: the paper shows 0.829 beside 0.110.
fn naive_beside(results: &Results<'_>) -> Check {
    let shared = results.find(PolicyChoice::Pipeline, PAPER_NODES, PAPER_VIEWS).map(|point| results.efficiency(point));
    let naive = results.naive(PAPER_NODES).map(|(efficiency, _)| efficiency);
    let value = shared.zip(naive).map(|(shared, naive)| shared / naive);
    let name = "pipeline over naive at P = 11, V = 1000, efficiency (the paper's: 7.5)";
    Check::maybe(name, value, "×", Bar::AtLeast(1.0), NOT_MEASURED)
}

/// Tiles beat the bound of whole images under expensive lighting.
fn tiles_pay(expensive: Option<&Results<'_>>, nodes: usize) -> [Check; 2] {
    let of = |ratio: fn(&Results<'_>, usize, usize) -> Option<f64>| {
        expensive.and_then(|expensive| ratio(expensive, nodes, TILED_VIEWS))
    };
    let at = format!("P = {nodes}, V = {TILED_VIEWS}, expensive lighting, pipeline");
    let not = "no expensive lighting was asked for";
    let over_bound = of(whole_images::over_bound);
    [
        Check::maybe(format!("{at}: over the bound of whole images"), over_bound, "×", Bar::AtLeast(1.0), not),
        Check::maybe(format!("{at}: over whole images"), of(whole_images::over_whole), "×", Bar::AtLeast(1.0), not),
    ]
}

fn simulated(results: &[Results<'_>]) -> [Check; 2] {
    let off = results.iter().flat_map(|results| {
        results
            .lit
            .points
            .iter()
            .zip(&results.predictions)
            .map(|(point, prediction)| (prediction.simulated_s / point.period_s - 1.0).abs())
    });
    // NaN counts as the largest difference.
    let most = off.fold(0.0, |most: f64, off| if most.is_nan() || off <= most { most } else { off });
    let others =
        results.iter().flat_map(|results| &results.predictions).filter(|prediction| !prediction.same_plan).count();
    [
        Check::new("simulated T off the measured, worst point", most, "", Bar::AtMost(SIMULATED_WITHIN)),
        Check::new("points that the simulated schedule plans otherwise", others as f64, "", Bar::Equal(0.0)),
    ]
}

/// Other programs slow these measurements, and unevenly so.
fn quiet(results: &[Results<'_>]) -> Check {
    let points = results.iter().flat_map(|results| &results.lit.points);
    let most = points.map(|point| point.window.others_cores()).fold(0.0, f64::max);
    Check::new("cores that other programs had meanwhile, worst point", most, "cores", Bar::AtMost(QUIET_CORES))
}

/// Compositors wait for their quota alone; otherwise nodes delay each other.
fn equal_shares(results: &Results<'_>) -> Check {
    let value = results.find(PolicyChoice::Auto, PAPER_NODES, PAPER_VIEWS).map(|point| point.window.used_share());
    Check::maybe(
        "share of their quotas that nodes used, auto, P = 11, V = 1000",
        value,
        "",
        Bar::AtLeast(USED),
        NOT_MEASURED,
    )
}
