//! Least squares with a prior, so that few or degenerate measurements have one finite solution.

/// Coefficients β that minimise Σ (x·β − y)² + Σ weight·(β − prior)².
#[derive(Debug, Clone)]
pub(crate) struct LeastSquares {
    /// The lower triangle L of the normal matrix A = L·Lᵀ, by rows.
    factor: Vec<Vec<f64>>,
}

impl LeastSquares {
    /// Factors the normal matrix of these rows. Weights are above 0.
    pub(crate) fn new(rows: &[Vec<f64>], weights: &[f64]) -> Self {
        let size = weights.len();
        let mut factor = vec![vec![0.0; size]; size];
        for i in 0..size {
            for j in 0..=i {
                let dot: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                let prior = if i == j { weights[i] } else { 0.0 };
                let rest = rows.iter().map(|row| row[i] * row[j]).sum::<f64>() + prior - dot;
                // Rounding cannot take a pivot below its prior weight.
                factor[i][j] = if i == j { rest.max(weights[i] * 0.5).sqrt() } else { rest / factor[j][j] };
            }
        }
        Self { factor }
    }

    /// β for the values of the rows.
    pub(crate) fn solve(&self, rows: &[Vec<f64>], values: &[f64], weights: &[f64], prior: &[f64]) -> Vec<f64> {
        let moment = |i: usize| rows.iter().zip(values).map(|(row, value)| row[i] * value).sum::<f64>();
        let right = (0..weights.len()).map(|i| moment(i) + weights[i] * prior[i]).collect();
        self.back(self.forward(right))
    }

    /// xᵀ·A⁻¹·x: how little the rows say about x.
    pub(crate) fn variance(&self, x: &[f64]) -> f64 {
        self.forward(x.to_vec()).iter().map(|value| value * value).sum()
    }

    /// L⁻¹·b.
    fn forward(&self, mut b: Vec<f64>) -> Vec<f64> {
        for i in 0..b.len() {
            let dot: f64 = (0..i).map(|k| self.factor[i][k] * b[k]).sum();
            b[i] = (b[i] - dot) / self.factor[i][i];
        }
        b
    }

    /// L⁻ᵀ·b.
    fn back(&self, mut b: Vec<f64>) -> Vec<f64> {
        for i in (0..b.len()).rev() {
            let dot: f64 = (i + 1..b.len()).map(|k| self.factor[k][i] * b[k]).sum();
            b[i] = (b[i] - dot) / self.factor[i][i];
        }
        b
    }
}
