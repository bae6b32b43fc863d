//! FLIP's feature pipeline (§4.2): edges and points that only one image has.

use glam::Vec3;
use rayon::prelude::*;

use super::kernels::FeatureKernels;
use crate::convolution::{Edge, Plane};

/// The feature difference of every pixel, 0 to 1.
pub(super) fn map(reference_ycxcz: &[Vec3], test_ycxcz: &[Vec3], width: usize, pixels_per_degree: f32) -> Vec<f32> {
    let kernels = FeatureKernels::new(pixels_per_degree);
    let [reference, test] = [reference_ycxcz, test_ycxcz].map(|image| Features::of(&luminance(image, width), &kernels));
    let edges = reference.edge.par_iter().zip(&test.edge).map(|(a, b)| (a - b).abs());
    let points = reference.point.par_iter().zip(&test.point).map(|(a, b)| (a - b).abs());
    edges.zip(points).map(|(edge, point)| (edge.max(point) / 2.0_f32.sqrt()).sqrt().min(1.0)).collect()
}

/// Strengths of edges and points at every pixel.
struct Features {
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Features {
    fn of(luminance: &Plane, kernels: &FeatureKernels) -> Self {
        let strength = |derivative: &[f32]| {
            let along_rows = luminance.convolved(derivative, &kernels.smooth, Edge::Repeat).values;
            let along_columns = luminance.convolved(&kernels.smooth, derivative, Edge::Repeat).values;
            along_rows.par_iter().zip(&along_columns).map(|(x, y)| x.hypot(*y)).collect()
        };
        Self { edge: strength(&kernels.edge), point: strength(&kernels.point) }
    }
}

/// Y of YCxCz, scaled to 0…1.
fn luminance(ycxcz: &[Vec3], width: usize) -> Plane {
    Plane { width, values: ycxcz.iter().map(|color| (color.x + 16.0) / 116.0).collect() }
}
