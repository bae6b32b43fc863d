//! Checks of the fronts: everything was measured, and nothing stands for anything else.

use std::collections::BTreeSet;

use planner::Metric;
use reconstruction::ReconstructionMethod;
use report::{Bar, Check};
use sampling::SamplingMethod;

use super::measure::Front;
use super::row::MeasuredRow;

pub fn checks(fronts: &[Front]) -> Vec<Check> {
    let rows: Vec<&MeasuredRow> = fronts.iter().flat_map(|front| &front.rows).collect();
    let samplings: BTreeSet<&str> = rows.iter().map(|row| row.row.sampling.as_str()).collect();
    let methods: BTreeSet<&str> = rows.iter().map(|row| row.row.method.as_str()).collect();
    let all_samplings = Bar::Equal(SamplingMethod::ladder().count() as f64);
    let all_methods = Bar::Equal(ReconstructionMethod::ladder().count() as f64);
    let not_finite = rows.iter().filter(|row| !figures(row).iter().all(|figure| figure.is_finite())).count();
    let repeated = fronts.iter().map(repeated).sum::<usize>();
    vec![
        Check::new("sampling methods with a row", samplings.len() as f64, "", all_samplings),
        Check::new("reconstructions with a row", methods.len() as f64, "", all_methods),
        Check::new("rows with a figure that is no number", not_finite as f64, "", Bar::Equal(0.0)),
        Check::new("rows with all errors of the row before", repeated as f64, "", Bar::Equal(0.0)),
    ]
}

/// All errors, and all costs.
fn figures(row: &MeasuredRow) -> [f64; 8] {
    let costs = [row.costs.sample_image_s, row.costs.load_set_s, row.costs.reconstruct_view_s];
    let [flip, square, disocclusion] =
        [Metric::Flip, Metric::Psnr, Metric::Disocclusion].map(|metric| row.error_ratio(metric));
    [flip, square, disocclusion, row.wrong_hits, row.filled, costs[0], costs[1], costs[2]]
}

/// Rows of the same errors as the row before: a setting that changes nothing is no row.
fn repeated(front: &Front) -> usize {
    front.rows.windows(2).filter(|pair| figures(&pair[0])[..5] == figures(&pair[1])[..5]).count()
}
