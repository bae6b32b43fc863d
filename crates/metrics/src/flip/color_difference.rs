//! FLIP's colour pipeline (§4.1): filter by contrast sensitivity, then measure in Hunt-adjusted L*a*b*.

use glam::Vec3;
use rayon::prelude::*;

use super::kernels::{ACHROMATIC, BLUE_YELLOW, RED_GREEN, Sensitivity};
use crate::{color::REC_709, color::WhiteRelative, convolution::Edge, convolution::Plane};

/// Differences are compressed by this power.
const POWER: f32 = 0.7;
/// Errors up to this share of the greatest error…
const KNEE: f32 = 0.4;
/// …are spread over this share of the output.
const KNEE_OUTPUT: f32 = 0.95;

/// The colour difference of every pixel, 0 to 1.
pub(super) fn map(reference_ycxcz: &[Vec3], test_ycxcz: &[Vec3], width: usize, pixels_per_degree: f32) -> Vec<f32> {
    let space = WhiteRelative::new(REC_709);
    let [reference, test] =
        [reference_ycxcz, test_ycxcz].map(|image| perceived(image, width, pixels_per_degree, &space));
    let greatest = greatest_difference(&space);
    reference.par_iter().zip(&test).map(|(a, b)| remapped(hyab(*a, *b).powf(POWER), greatest)).collect()
}

/// Hunt-adjusted L*a*b* of what the eye resolves.
fn perceived(ycxcz: &[Vec3], width: usize, pixels_per_degree: f32, space: &WhiteRelative) -> Vec<Vec3> {
    let channel = |of: fn(&Vec3) -> f32| Plane { width, values: ycxcz.iter().map(of).collect() };
    let y = filtered(&channel(|c| c.x), &[ACHROMATIC], pixels_per_degree);
    let cx = filtered(&channel(|c| c.y), &[RED_GREEN], pixels_per_degree);
    let cz = filtered(&channel(|c| c.z), &BLUE_YELLOW, pixels_per_degree);
    let pixels = y.par_iter().zip(&cx).zip(&cz).map(|((&y, &cx), &cz)| Vec3::new(y, cx, cz));
    pixels.map(|ycxcz| hunt_adjusted(space, space.linear_from_ycxcz(ycxcz).clamp(Vec3::ZERO, Vec3::ONE))).collect()
}

/// The plane convolved with a sum of sensitivities that together weigh 1.
fn filtered(plane: &Plane, sensitivities: &[Sensitivity], pixels_per_degree: f32) -> Vec<f32> {
    let kernels: Vec<_> = sensitivities.iter().map(|one| one.kernel(pixels_per_degree)).collect();
    let total: f32 = kernels.iter().map(|(_, volume)| volume).sum();
    let mut sum = vec![0.0; plane.values.len()];
    for (kernel, volume) in &kernels {
        let part = plane.convolved(kernel, kernel, Edge::Repeat);
        sum.par_iter_mut().zip(&part.values).for_each(|(sum, value)| *sum += value * volume / total);
    }
    sum
}

/// Chroma counts less in the dark.
fn hunt_adjusted(space: &WhiteRelative, linear: Vec3) -> Vec3 {
    let lab = space.lab_from_linear(linear);
    Vec3::new(lab.x, 0.01 * lab.x * lab.y, 0.01 * lab.x * lab.z)
}

/// City-block in lightness, Euclidean in chroma (Abasi et al. 2020).
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let delta = a - b;
    delta.x.abs() + delta.y.hypot(delta.z)
}

/// Green against blue: the greatest difference a display can show.
fn greatest_difference(space: &WhiteRelative) -> f32 {
    hyab(hunt_adjusted(space, Vec3::Y), hunt_adjusted(space, Vec3::Z)).powf(POWER)
}

/// To 0…1, most of it for the small differences.
fn remapped(difference: f32, greatest: f32) -> f32 {
    let knee = KNEE * greatest;
    match difference < knee {
        true => KNEE_OUTPUT / knee * difference,
        false => KNEE_OUTPUT + (difference - knee) / (greatest - knee) * (1.0 - KNEE_OUTPUT),
    }
    .clamp(0.0, 1.0)
}
