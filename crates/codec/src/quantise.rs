//! Inverse depths as 16-bit codes, linear over an image's own range.
//!
//! The sums are done in `f64`. The error is therefore within half a step for any range, plus the rounding of the result to
//! `f32`.

use depth_image::{BACKGROUND_INVERSE_DEPTH, HOLE_INVERSE_DEPTH};

use crate::DecodeError;

/// A texel without a sample.
pub(crate) const HOLE_CODE: u16 = 0;
/// A texel whose ray met nothing.
pub(crate) const BACKGROUND_CODE: u16 = 1;
/// The code of the least inverse depth; the greatest has `u16::MAX`.
pub(crate) const FIRST_SAMPLE_CODE: u16 = 2;

const STEPS: f64 = (u16::MAX - FIRST_SAMPLE_CODE) as f64;
/// Added to a small number it leaves the number, rounded, in the lowest bits of the sum.
const ROUND_TO_INTEGER: f64 = (1u64 << 52) as f64;

/// The inverse depths that the codes of an image span. Both are 0 in an image without samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InverseDepthRange {
    /// Inverse depth of the least code of a sample, per metre.
    pub least_per_m: f32,
    /// Inverse depth of code `u16::MAX`, per metre.
    pub greatest_per_m: f32,
}

impl InverseDepthRange {
    /// The range of the samples in a plane. Only positive, finite numbers are samples.
    #[must_use]
    pub fn of_plane(inverse_depth_per_m: &[f32]) -> Self {
        const LANES: usize = 16;
        // One pair a lane, and comparisons in place of `f32::min`, so that the loop is vectorised.
        let mut least = [f32::INFINITY; LANES];
        let mut greatest = [0f32; LANES];
        let mut widen = |values: &[f32; LANES]| {
            for ((least, greatest), &value) in least.iter_mut().zip(&mut greatest).zip(values) {
                let finite = if value <= f32::MAX { value } else { 0.0 };
                let positive = if finite > 0.0 { finite } else { f32::INFINITY };
                *least = if positive < *least { positive } else { *least };
                *greatest = if finite > *greatest { finite } else { *greatest };
            }
        };
        let (blocks, rest) = inverse_depth_per_m.as_chunks::<LANES>();
        blocks.iter().for_each(&mut widen);
        let mut last = [0.0; LANES];
        last[..rest.len()].copy_from_slice(rest);
        widen(&last);
        let greatest_per_m = greatest.into_iter().fold(0.0, f32::max);
        let least_per_m = least.into_iter().fold(greatest_per_m, f32::min);
        Self { least_per_m, greatest_per_m }
    }

    /// Refuses ranges that would decode to anything but positive, finite inverse depths.
    pub(crate) fn validate(self) -> Result<(), DecodeError> {
        let Self { least_per_m, greatest_per_m } = self;
        let empty = least_per_m == 0.0 && greatest_per_m == 0.0;
        if empty || (least_per_m > 0.0 && least_per_m <= greatest_per_m && greatest_per_m <= f32::MAX) {
            return Ok(());
        }
        Err(DecodeError::Header { field: "inverse_depth_range", reason: "not 0 < least <= greatest < infinity" })
    }

    pub(crate) fn is_empty(self) -> bool {
        self.greatest_per_m == 0.0
    }

    /// The distance between neighbouring codes; half of it bounds the error of a round trip.
    pub(crate) fn step_per_m(self) -> f64 {
        (f64::from(self.greatest_per_m) - f64::from(self.least_per_m)) / STEPS
    }
}

/// Codes of inverse depths over a range.
pub(crate) fn quantise(inverse_depth_per_m: &[f32], range: InverseDepthRange, codes: &mut [u16]) {
    let step = range.step_per_m();
    let codes_per_unit = if step > 0.0 { step.recip() } else { 0.0 };
    let offset = f64::from(FIRST_SAMPLE_CODE) - f64::from(range.least_per_m) * codes_per_unit;
    for (code, &value) in codes.iter_mut().zip(inverse_depth_per_m) {
        let level = f64::from(value) * codes_per_unit + offset;
        let sample_code = (level + ROUND_TO_INTEGER).to_bits() as u16;
        let is_sample = value > 0.0 && value <= f32::MAX;
        let empty_code = u16::from(value == BACKGROUND_INVERSE_DEPTH);
        *code = if is_sample { sample_code } else { empty_code };
    }
}

/// Inverse depths of sample codes. The results lie within the range for any codes.
pub(crate) fn dequantise(sample_codes: &[u16], range: InverseDepthRange, inverse_depth_per_m: &mut [f32]) {
    let least = f64::from(range.least_per_m);
    let step = range.step_per_m();
    for (out, code) in inverse_depth_per_m.iter_mut().zip(sample_codes) {
        let level = i32::from(code.saturating_sub(FIRST_SAMPLE_CODE));
        *out = (least + f64::from(level) * step) as f32;
    }
}

/// The value in the plane for a code without a sample.
pub(crate) fn empty_inverse_depth(code: u16) -> f32 {
    if code == BACKGROUND_CODE { BACKGROUND_INVERSE_DEPTH } else { HOLE_INVERSE_DEPTH }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Random;

    fn round_trip(plane: &[f32]) -> (InverseDepthRange, Vec<f32>) {
        let range = InverseDepthRange::of_plane(plane);
        let mut codes = vec![0; plane.len()];
        quantise(plane, range, &mut codes);
        let mut back = vec![0.0; plane.len()];
        dequantise(&codes, range, &mut back);
        for (out, &code) in back.iter_mut().zip(&codes).filter(|(_, code)| **code < FIRST_SAMPLE_CODE) {
            *out = empty_inverse_depth(code);
        }
        (range, back)
    }

    #[test]
    fn error_stays_within_half_a_step() {
        let mut random = Random::new(2);
        for case in 0..2000 {
            let scale = 10f32.powi(case % 60 - 30);
            let offset = if case % 3 == 0 { scale * 1000.0 } else { 0.0 };
            let length = 1 + random.below(60);
            let plane: Vec<f32> = (0..length).map(|_| offset + scale * (random.unit() + 1e-6)).collect();
            let (range, back) = round_trip(&plane);
            for (&was, &is) in plane.iter().zip(&back) {
                let rounding = f64::from(is) * f64::from(f32::EPSILON) * 0.5 + f64::from(f32::from_bits(1));
                let error = (f64::from(was) - f64::from(is)).abs();
                assert!(error <= range.step_per_m() * 0.5 * (1.0 + 1e-3) + rounding, "{was} {is} {range:?}");
            }
        }
    }

    #[test]
    fn degenerate_ranges_are_exact() {
        let hole = HOLE_INVERSE_DEPTH;
        let background = BACKGROUND_INVERSE_DEPTH;
        for plane in [
            vec![],
            vec![hole; 40],
            vec![background; 3],
            vec![background, 0.37, hole],
            vec![f32::from_bits(1), f32::MAX],
            vec![1.0, 1.0 + f32::EPSILON],
            vec![0.1; 100],
        ] {
            assert_eq!(round_trip(&plane).1, plane);
        }
    }

    #[test]
    fn numbers_that_are_not_finite_become_holes() {
        let hole = HOLE_INVERSE_DEPTH;
        let (range, back) = round_trip(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.5, -0.0, 0.5, 0.25]);
        assert_eq!(back, [hole, hole, hole, hole, 0.0, 0.5, 0.25]);
        assert_eq!(range, InverseDepthRange { least_per_m: 0.25, greatest_per_m: 0.5 });
    }

    #[test]
    fn ranges_that_could_yield_nonsense_are_refused() {
        for (least_per_m, greatest_per_m) in
            [(f32::NAN, 1.0), (0.5, f32::NAN), (0.5, f32::INFINITY), (-1.0, 1.0), (0.0, 1.0), (2.0, 1.0)]
        {
            assert!(InverseDepthRange { least_per_m, greatest_per_m }.validate().is_err());
        }
    }
}
