//! The one-dimensional kernels whose products are FLIP's filters.

use std::f32::consts::PI;

/// The paper's viewer: 0.7 m from a display 0.7 m wide with 3840 columns, 0.7 · 3840 / 0.7 · π / 180.
const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// A contrast sensitivity of the eye, `a · sqrt(π/b) · exp(-π² x²/b)` over `x` degrees (§4.1.1, table 1).
#[derive(Clone, Copy)]
pub(super) struct Sensitivity {
    pub(super) a: f32,
    pub(super) b: f32,
}

/// Luminance.
pub(super) const ACHROMATIC: Sensitivity = Sensitivity { a: 1.0, b: 0.0047 };
/// Red against green.
pub(super) const RED_GREEN: Sensitivity = Sensitivity { a: 1.0, b: 0.0053 };
/// Blue against yellow is the sum of two.
pub(super) const BLUE_YELLOW: [Sensitivity; 2] = [Sensitivity { a: 34.1, b: 0.04 }, Sensitivity { a: 13.5, b: 0.025 }];

/// Three standard deviations of the widest sensitivity: all share one support.
pub(super) fn sensitivity_radius_px() -> i32 {
    let widest = BLUE_YELLOW[0].b;
    (3.0 * (widest / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32
}

impl Sensitivity {
    /// Weights along one axis that sum to 1, and the share of the two-dimensional filter's volume that
    /// this sensitivity had before.
    pub(super) fn kernel(self) -> (Vec<f32>, f32) {
        let radius = sensitivity_radius_px();
        let weights = (-radius..=radius).map(|x| (-PI * PI * (x as f32 / PIXELS_PER_DEGREE).powi(2) / self.b).exp());
        let weights: Vec<f32> = weights.collect();
        let sum: f32 = weights.iter().sum();
        let volume = self.a * (PI / self.b).sqrt() * sum * sum;
        (weights.iter().map(|weight| weight * sum.recip()).collect(), volume)
    }
}

/// A Gaussian and its first two derivatives, of the width at which the eye finds edges (§4.2).
pub(super) struct FeatureKernels {
    /// Sums to 1.
    pub(super) smooth: Vec<f32>,
    /// Positive weights sum to 1, negative ones to -1.
    pub(super) edge: Vec<f32>,
    /// Positive weights sum to 1, negative ones to -1.
    pub(super) point: Vec<f32>,
}

impl FeatureKernels {
    pub(super) fn new() -> Self {
        const WIDTH_DEGREES: f32 = 0.082;
        let deviation_px = 0.5 * WIDTH_DEGREES * PIXELS_PER_DEGREE;
        let radius = (3.0 * deviation_px).ceil() as i32;
        let gaussian =
            (-radius..=radius).map(|x| x as f32).map(|x| (x, (-x * x / (2.0 * deviation_px * deviation_px)).exp()));
        Self {
            smooth: balanced(gaussian.clone().map(|(_, weight)| weight)),
            edge: balanced(gaussian.clone().map(|(x, weight)| -x * weight)),
            point: balanced(gaussian.map(|(x, weight)| ((x / deviation_px).powi(2) - 1.0) * weight)),
        }
    }
}

/// Positive weights scaled to sum to 1, negative ones to -1.
fn balanced(weights: impl Iterator<Item = f32> + Clone) -> Vec<f32> {
    let [positive, negative] =
        [1.0, -1.0].map(|sign: f32| weights.clone().map(|weight| (sign * weight).max(0.0)).sum::<f32>());
    let balanced = weights.map(|weight| match weight {
        _ if weight > 0.0 => weight / positive,
        _ if weight < 0.0 => weight / negative,
        _ => 0.0,
    });
    balanced.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_keep_their_sums() {
        let kernels = FeatureKernels::new();
        assert!((kernels.smooth.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        assert!(kernels.edge.iter().sum::<f32>().abs() < 1e-5);
        assert!(kernels.point.iter().sum::<f32>().abs() < 1e-5);
        let (achromatic, _) = ACHROMATIC.kernel();
        assert!((achromatic.iter().sum::<f32>() - 1.0).abs() < 1e-5);
    }
}
