//! Gaussian process regression: values at new points from noisy values at measured ones. A value is the more like another
//! the greater the covariance of their points (Rasmussen and Williams 2006, "Gaussian Processes for Machine Learning", §2.2).

/// The measured points of a process. The prior mean is 0.
#[derive(Debug, Clone)]
pub(crate) struct GaussianProcess {
    /// The lower triangle L of the covariance A = L·Lᵀ of measured values, by rows.
    factor: Vec<Vec<f64>>,
}

impl GaussianProcess {
    /// Factors the covariance of `count` measured points. `noise` is the variance of a measurement, above 0.
    pub(crate) fn new(count: usize, covariance: impl Fn(usize, usize) -> f64, noise: f64) -> Self {
        let mut factor: Vec<Vec<f64>> = Vec::with_capacity(count);
        for i in 0..count {
            let mut row = Vec::with_capacity(i + 1);
            for (j, other) in factor.iter().enumerate() {
                row.push((covariance(i, j) - dot(&row, other)) / other[j]);
            }
            // Rounding cannot take a pivot below the noise.
            let pivot = (covariance(i, i) - dot(&row, &row) + noise).max(0.5 * noise);
            row.push(pivot.sqrt());
            factor.push(row);
        }
        Self { factor }
    }

    /// A⁻¹·values: the mean at a point is the sum of these weights times its covariances with the measured points.
    pub(crate) fn weights(&self, values: &[f64]) -> Vec<f64> {
        let mut weights = self.forward(values);
        for i in (0..weights.len()).rev() {
            let above: f64 = (i + 1..weights.len()).map(|k| self.factor[k][i] * weights[k]).sum();
            weights[i] = (weights[i] - above) / self.factor[i][i];
        }
        weights
    }

    /// The variance at a point, from its own prior variance and its covariances with the measured points.
    pub(crate) fn variance(&self, prior: f64, covariances: &[f64]) -> f64 {
        let known = self.forward(covariances);
        (prior - dot(&known, &known)).max(0.0)
    }

    /// L⁻¹·values.
    fn forward(&self, values: &[f64]) -> Vec<f64> {
        let mut solved = Vec::with_capacity(values.len());
        for (row, value) in self.factor.iter().zip(values) {
            solved.push((value - dot(row, &solved)) / row[solved.len()]);
        }
        solved
    }
}

/// Over the shorter of both.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
