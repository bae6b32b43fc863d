//! LDR-FLIP: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference
//! Evaluator for Alternating Images", HPG 2020. Section numbers below are the paper's.
//!
//! A colour difference is raised by a feature difference: `ΔE = ΔEc^(1 - ΔEf)`. The colour difference is that of both
//! images blurred by the eye's contrast sensitivity; features are edges and points that only one image has.

mod kernels;

use depth_image::{View, linear_from_srgb8};
use glam::Vec3;
use rayon::prelude::*;

use crate::color::{REC_709, WhiteRelative, convert_pixels};
use crate::convolution::{Edge, Plane};
use crate::image::expect_same_size;
use crate::{MetricsError, ScoreMap};
use kernels::{ACHROMATIC, BLUE_YELLOW, FeatureKernels, RED_GREEN, Sensitivity};

/// The greatest distance between a pixel and another that its error depends on, in pixels.
pub const FLIP_REACH_PX: u32 = 10;
/// Differences are compressed by this power.
const POWER: f32 = 0.7;
/// Errors up to this share of the greatest error…
const KNEE: f32 = 0.4;
/// …are spread over this share of the output.
const KNEE_OUTPUT: f32 = 0.95;

/// FLIP's error of every pixel, 0 to 1, for the paper's viewer.
///
/// # Errors
/// Images differ in size.
pub fn flip_map(reference: &View, test: &View) -> Result<ScoreMap, MetricsError> {
    expect_same_size(reference, test)?;
    let space = WhiteRelative::new(REC_709);
    let [reference_ycxcz, test_ycxcz] = [reference, test]
        .map(|image| convert_pixels(image, linear_from_srgb8, |linear| space.ycxcz_from_linear(linear)));
    let width = reference.size_px.x as usize;
    let color = color_difference(&reference_ycxcz, &test_ycxcz, width);
    let feature = feature_difference(&reference_ycxcz, &test_ycxcz, width);
    let values = color.par_iter().zip(&feature).map(|(color, feature)| color.powf(1.0 - feature)).collect();
    Ok(ScoreMap { size_px: reference.size_px, border_px: 0, values })
}

/// The colour difference of every pixel, 0 to 1 (§4.1): filter by contrast sensitivity, then measure in Hunt-adjusted
/// L*a*b*.
fn color_difference(reference_ycxcz: &[Vec3], test_ycxcz: &[Vec3], width: usize) -> Vec<f32> {
    let space = WhiteRelative::new(REC_709);
    let [reference, test] = [reference_ycxcz, test_ycxcz].map(|image| perceived(image, width, &space));
    // Green against blue is the greatest difference that a display can show.
    let greatest = hyab(hunt_adjusted(&space, Vec3::Y), hunt_adjusted(&space, Vec3::Z)).powf(POWER);
    reference.par_iter().zip(&test).map(|(a, b)| remapped(hyab(*a, *b).powf(POWER), greatest)).collect()
}

/// Hunt-adjusted L*a*b* of what the eye resolves.
fn perceived(ycxcz: &[Vec3], width: usize, space: &WhiteRelative) -> Vec<Vec3> {
    let channels = [0, 1, 2].map(|channel| Plane { width, values: ycxcz.iter().map(|color| color[channel]).collect() });
    let y = filtered(&channels[0], &[ACHROMATIC]);
    let cx = filtered(&channels[1], &[RED_GREEN]);
    let cz = filtered(&channels[2], &BLUE_YELLOW);
    let pixels = y.par_iter().zip(&cx).zip(&cz).map(|((&y, &cx), &cz)| Vec3::new(y, cx, cz));
    pixels.map(|ycxcz| hunt_adjusted(space, space.linear_from_ycxcz(ycxcz).clamp(Vec3::ZERO, Vec3::ONE))).collect()
}

/// The plane convolved with a sum of sensitivities that together weigh 1.
fn filtered(plane: &Plane, sensitivities: &[Sensitivity]) -> Vec<f32> {
    let kernels: Vec<_> = sensitivities.iter().map(|one| one.kernel()).collect();
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

/// To 0…1, most of it for the small differences.
fn remapped(difference: f32, greatest: f32) -> f32 {
    let knee = KNEE * greatest;
    let remapped = match difference < knee {
        true => KNEE_OUTPUT / knee * difference,
        false => KNEE_OUTPUT + (difference - knee) / (greatest - knee) * (1.0 - KNEE_OUTPUT),
    };
    remapped.clamp(0.0, 1.0)
}

/// The feature difference of every pixel, 0 to 1 (§4.2): edges and points that only one image has.
fn feature_difference(reference_ycxcz: &[Vec3], test_ycxcz: &[Vec3], width: usize) -> Vec<f32> {
    let kernels = FeatureKernels::new();
    let [reference, test] = [reference_ycxcz, test_ycxcz].map(|image| Features::of(image, width, &kernels));
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
    fn of(ycxcz: &[Vec3], width: usize, kernels: &FeatureKernels) -> Self {
        // Y is scaled to 0…1.
        let luminance = Plane { width, values: ycxcz.iter().map(|color| (color.x + 16.0) / 116.0).collect() };
        let [edge, point] = [&kernels.edge, &kernels.point].map(|derivative| {
            let along_rows = luminance.convolved(derivative, &kernels.smooth, Edge::Repeat).values;
            let along_columns = luminance.convolved(&kernels.smooth, derivative, Edge::Repeat).values;
            along_rows.par_iter().zip(&along_columns).map(|(x, y)| x.hypot(*y)).collect()
        });
        Self { edge, point }
    }
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    fn flat(rgb: [u8; 3]) -> View {
        View::from_srgb8(UVec2::new(5, 4), rgb.repeat(20))
    }

    #[test]
    fn identical_is_zero() {
        let map = flip_map(&flat([9, 200, 77]), &flat([9, 200, 77])).unwrap();
        assert_eq!(map.mean(None).unwrap(), Some(0.0));
    }

    #[test]
    fn blue_for_green_is_the_greatest_error() {
        let mean = flip_map(&flat([0, 255, 0]), &flat([0, 0, 255])).unwrap().mean(None).unwrap().unwrap();
        assert!((mean - 1.0).abs() < 1e-4, "{mean}");
    }

    #[test]
    fn a_pixel_depends_on_its_surroundings_alone() {
        const SIDE: usize = 64;
        let byte = |index: usize, seed: usize| (index * 7919 + seed).wrapping_mul(2_654_435_761) as u8;
        let crop = |pixels: &[u8], first: usize| -> Vec<u8> {
            let rows = pixels.chunks(3 * SIDE).skip(first).take(SIDE - 2 * first);
            rows.flat_map(|row| row[3 * first..3 * (SIDE - first)].to_vec()).collect()
        };
        let images = [1, 5].map(|seed| (0..3 * SIDE * SIDE).map(|index| byte(index, seed)).collect::<Vec<u8>>());
        let map = |first: usize| {
            let side = (SIDE - 2 * first) as u32;
            let [a, b] = [0, 1].map(|image| View::from_srgb8(UVec2::splat(side), crop(&images[image], first)));
            flip_map(&a, &b).unwrap().values
        };
        let whole = map(0);
        let part = map(8);
        let reach = FLIP_REACH_PX as usize;
        let mut differs_nearer = false;
        for (y, x) in (0..48).flat_map(|y| (0..48).map(move |x| (y, x))) {
            let [own, in_whole] = [part[48 * y + x], whole[SIDE * (y + 8) + x + 8]];
            let to_border = x.min(y).min(47 - x).min(47 - y);
            match to_border >= reach {
                true => assert!((own - in_whole).abs() < 1e-4, "{x}, {y}: {own}, {in_whole}"),
                false => differs_nearer |= (own - in_whole).abs() > 1e-3,
            }
        }
        assert!(differs_nearer, "the border matters");
    }
}
