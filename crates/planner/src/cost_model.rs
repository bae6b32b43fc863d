//! Costs of rows that were not measured, from rows that were.
//!
//! The logarithm of a cost is a Gaussian process over the ladder. Its prior mean is a product of powers of S and of the
//! sample images' side, as the methods' loops have them. Rows differ from it alike that share a sampling method, a
//! reconstruction method, or both, and are near in S and side.

use crate::costs::RowCosts;
use crate::gaussian_process::{GaussianProcess, dot};
use crate::ladder::Row;

/// Costs below count as this, in s: a logarithm needs a value above 0.
const LEAST_COST_S: f64 = 1e-9;
/// Logarithms of predicted costs in s stay within this.
const MOST_LOG: f64 = 20.0;
/// The prior exponents of S and side, of g_s, d and c.
const EXPONENTS: [[f64; 2]; 3] = [[0.0, 2.0], [1.0, 2.0], [0.5, 0.3]];
/// The variance of a measured logarithm: two measurements differ by about 10 %.
const NOISE: f64 = 0.01;
/// Prior variances of logarithms: of the constant, which is not known, and of both exponents.
const CONSTANT: f64 = 100.0;
const EXPONENT: f64 = 0.25;
/// Prior variances of what rows near in S and side share: all of them, those of one reconstruction method, of one sampling
/// method, and of one pair.
const SHARED: [f64; 4] = [0.05, 0.5, 0.2, 0.2];
/// Distances at which rows are near: four times in S, twice in side.
const NEAR: [f64; 2] = [2.0 * std::f64::consts::LN_2, std::f64::consts::LN_2];

/// Measured costs of a row.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedRow {
    /// The row.
    pub row: Row,
    /// The row's costs.
    pub costs: RowCosts,
}

/// Predictions from the measured rows.
#[derive(Debug, Clone)]
pub struct CostModel {
    rows: Vec<Row>,
    /// The logarithms of each row's S and side.
    logs: Vec<[f64; 2]>,
    process: GaussianProcess,
    /// The weights of the measured rows in predictions of g_s, d and c.
    weights: [Vec<f64>; 3],
    /// The variances that were found over those of the prior.
    scales: [f64; 3],
}

impl CostModel {
    /// From the measured rows, none to all. All rows must be valid by [`Row::validate`]. Costs that are not finite, or below
    /// 10⁻⁹ s, count as that.
    #[must_use]
    pub fn fit(timed: &[TimedRow]) -> Self {
        let points: Vec<Point<'_>> = timed.iter().map(|timed| Point::new(&timed.row)).collect();
        let process = GaussianProcess::new(timed.len(), |i, j| points[i].covariance(points[j]), NOISE);
        let residuals = [0, 1, 2].map(|cost| -> Vec<f64> {
            timed.iter().map(|timed| log_costs(&timed.costs)[cost] - prior(&timed.row)[cost]).collect()
        });
        let weights = residuals.each_ref().map(|residuals| process.weights(residuals));
        // The most likely scale, with the prior's as one more measurement.
        let scales = [0, 1, 2].map(|cost| (1.0 + dot(&residuals[cost], &weights[cost])) / (1.0 + timed.len() as f64));
        let rows = points.iter().map(|point| point.row.clone()).collect();
        let logs = points.iter().map(|point| point.logs).collect();
        Self { rows, logs, process, weights, scales }
    }

    /// The predicted costs of a valid row, always finite and from e⁻²⁰ to e²⁰ s, less some standard deviations.
    #[must_use]
    pub fn predict(&self, row: &Row, deviations: f64) -> RowCosts {
        let point = Point::new(row);
        let covariances = self.covariances(point);
        let variance = self.process.variance(point.covariance(point), &covariances) + NOISE;
        let prior = prior(row);
        let [sample_image_s, load_set_s, reconstruct_view_s] = [0, 1, 2].map(|cost| {
            let log = prior[cost] + dot(&covariances, &self.weights[cost]);
            let deviation = (variance * self.scales[cost].max(0.0)).sqrt();
            (log - deviations * deviation).clamp(-MOST_LOG, MOST_LOG).exp()
        });
        RowCosts { sample_image_s, load_set_s, reconstruct_view_s }
    }

    /// How little the measured rows say about a row: the variance of its predicted logarithm, at the prior's scale.
    #[must_use]
    pub fn uncertainty(&self, row: &Row) -> f64 {
        let point = Point::new(row);
        self.process.variance(point.covariance(point), &self.covariances(point))
    }

    /// The covariance of a point with each measured row.
    fn covariances(&self, point: Point<'_>) -> Vec<f64> {
        let measured = self.rows.iter().zip(&self.logs).map(|(row, &logs)| Point { row, logs });
        measured.map(|other| point.covariance(other)).collect()
    }
}

/// The logarithms of S and side.
fn logs(row: &Row) -> [f64; 2] {
    [f64::from(row.camera_count).ln(), row.side_ratio.ln()]
}

/// A row with the logarithms of its S and side, which every covariance needs.
#[derive(Debug, Clone, Copy)]
struct Point<'a> {
    row: &'a Row,
    logs: [f64; 2],
}

impl<'a> Point<'a> {
    fn new(row: &'a Row) -> Self {
        Self { row, logs: logs(row) }
    }

    fn covariance(self, other: Self) -> f64 {
        let squares = [0, 1].map(|axis| ((self.logs[axis] - other.logs[axis]) / NEAR[axis]).powi(2));
        let nearness = (-0.5 * (squares[0] + squares[1])).exp();
        let is_method = self.row.method == other.row.method;
        let is_sampling = self.row.sampling == other.row.sampling;
        let is_shared = [true, is_method, is_sampling, is_method && is_sampling];
        let shared: f64 = SHARED.iter().zip(is_shared).map(|(variance, is)| if is { *variance } else { 0.0 }).sum();
        CONSTANT + EXPONENT * dot(&self.logs, &other.logs) + nearness * shared
    }
}

/// The prior means of the logarithms of g_s, d and c.
fn prior(row: &Row) -> [f64; 3] {
    EXPONENTS.map(|exponents| dot(&exponents, &logs(row)))
}

fn log_costs(costs: &RowCosts) -> [f64; 3] {
    [costs.sample_image_s, costs.load_set_s, costs.reconstruct_view_s].map(|cost| {
        let is_valid = cost.is_finite() && cost > LEAST_COST_S;
        if is_valid { cost.ln() } else { LEAST_COST_S.ln() }
    })
}
