//! Costs of rows that were not measured, from rows that were.
//!
//! Each cost is a product of a constant of the sampling method, one of the reconstruction method, and three powers. Their
//! bases are S, the sample images' side and a view's pixels. The logarithm is linear, and is fitted by least squares. A weak
//! prior holds the exponents of the methods' loops, so that few rows suffice and no input is degenerate.

use std::collections::BTreeSet;

use crate::costs::RowCosts;
use crate::ladder::Row;
use crate::least_squares::LeastSquares;

/// Costs below count as this, in s: a logarithm needs a value above 0.
const LEAST_COST_S: f64 = 1e-9;
/// Logarithms of predicted costs in s stay within this.
const MOST_LOG: f64 = 20.0;
/// The weights of the prior on the common constant, on the three exponents, and on the methods' constants. A weight is the
/// variance of a measured logarithm, 0.1², over the variance of the coefficient. Exponents are within 0.5 of the prior's,
/// constants within a factor of 2.7.
const WEIGHTS: [f64; 3] = [1e-6, 0.04, 0.01];
/// The prior's exponents of S, side and pixels, of g_s, d and c.
const EXPONENTS: [[f64; 3]; 3] = [[0.0, 2.0, 1.0], [1.0, 2.0, 1.0], [0.5, 0.3, 1.0]];
/// Columns before those of methods: the constant, and the exponents.
const FIRST_METHOD: usize = 4;

/// Measured costs of a row.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedRow {
    /// The row.
    pub row: Row,
    /// The pixels of a view.
    pub view_pixels: f64,
    /// The row's costs.
    pub costs: RowCosts,
}

/// The fitted products.
#[derive(Debug, Clone)]
pub struct CostModel {
    samplings: Vec<String>,
    methods: Vec<String>,
    fit: LeastSquares,
    /// Coefficients of g_s, d and c.
    coefficients: [Vec<f64>; 3],
}

impl CostModel {
    /// Fits the measured rows, none to all of them, for predictions of `rows`. All rows must be valid by [`Row::validate`].
    /// Costs that are not finite, or below 10⁻⁹ s, count as that. Pixels that are not finite, or below 1, count as 1.
    #[must_use]
    pub fn fit(rows: &[Row], timed: &[TimedRow]) -> Self {
        let all = || rows.iter().chain(timed.iter().map(|timed| &timed.row));
        let samplings = distinct(all().map(|row| &row.sampling));
        let methods = distinct(all().map(|row| &row.method));
        let x: Vec<Vec<f64>> =
            timed.iter().map(|timed| columns(&samplings, &methods, &timed.row, timed.view_pixels)).collect();
        let count = FIRST_METHOD + samplings.len() + methods.len();
        let weights: Vec<f64> = (0..count).map(weight).collect();
        let fit = LeastSquares::new(&x, &weights);
        let coefficients = [0, 1, 2].map(|cost| {
            let logs: Vec<f64> = timed.iter().map(|timed| log_costs(&timed.costs)[cost]).collect();
            fit.solve(&x, &logs, &weights, &prior(cost, count))
        });
        Self { samplings, methods, fit, coefficients }
    }

    /// The predicted costs of a valid row, always finite and from e⁻²⁰ to e²⁰ s.
    #[must_use]
    pub fn predict(&self, row: &Row, view_pixels: f64) -> RowCosts {
        let x = columns(&self.samplings, &self.methods, row, view_pixels);
        let [sample_image_s, load_set_s, reconstruct_view_s] = self.coefficients.each_ref().map(|coefficients| {
            let log: f64 = x.iter().zip(coefficients).map(|(x, coefficient)| x * coefficient).sum();
            log.clamp(-MOST_LOG, MOST_LOG).exp()
        });
        RowCosts { sample_image_s, load_set_s, reconstruct_view_s }
    }

    /// How little the measured rows say about a row: the variance of its predicted logarithm, in units of that of a
    /// measurement.
    #[must_use]
    pub fn uncertainty(&self, row: &Row, view_pixels: f64) -> f64 {
        self.fit.variance(&columns(&self.samplings, &self.methods, row, view_pixels))
    }
}

fn distinct<'a>(names: impl Iterator<Item = &'a String>) -> Vec<String> {
    names.cloned().collect::<BTreeSet<_>>().into_iter().collect()
}

/// The constant, the logarithms of S, side and pixels, and 1 at the methods of the row.
fn columns(samplings: &[String], methods: &[String], row: &Row, view_pixels: f64) -> Vec<f64> {
    let pixels = if view_pixels.is_finite() { view_pixels.max(1.0) } else { 1.0 };
    let exponents = [1.0, f64::from(row.camera_count).ln(), row.side_ratio.ln(), pixels.ln()];
    let is = |name: &String, of: &String| f64::from(u8::from(name == of));
    let samplings = samplings.iter().map(|name| is(name, &row.sampling));
    exponents.into_iter().chain(samplings).chain(methods.iter().map(|name| is(name, &row.method))).collect()
}

fn weight(column: usize) -> f64 {
    match column {
        0 => WEIGHTS[0],
        1..FIRST_METHOD => WEIGHTS[1],
        _ => WEIGHTS[2],
    }
}

fn prior(cost: usize, count: usize) -> Vec<f64> {
    let mut prior = vec![0.0; count];
    prior[1..FIRST_METHOD].copy_from_slice(&EXPONENTS[cost]);
    prior
}

fn log_costs(costs: &RowCosts) -> [f64; 3] {
    [costs.sample_image_s, costs.load_set_s, costs.reconstruct_view_s].map(|cost| {
        let is_valid = cost.is_finite() && cost > LEAST_COST_S;
        if is_valid { cost.ln() } else { LEAST_COST_S.ln() }
    })
}
