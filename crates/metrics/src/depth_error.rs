//! Errors of reconstructed depth, and the rate of pixels without an answer.

use crate::{MetricsError, error::expect_len, error::expect_mask};

/// The relative depth error above which a hit is wrong.
pub const WRONG_HIT_RELATIVE: f64 = 0.01;

/// Errors of planar depth. In the test plane, above 0 is a HIT, 0 a MISS, below 0 (and NaN) UNKNOWN.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DepthErrors {
    /// The number of pixels compared.
    pub pixels: usize,
    /// Pixels whose reference has a surface.
    pub foreground_px: usize,
    /// Test pixels with a depth.
    pub hit_px: usize,
    /// Test pixels that are certain to show nothing.
    pub miss_px: usize,
    /// Test pixels without an answer, which count in no error below.
    pub unknown_px: usize,
    /// Hits off by more than 1 % in depth, and hits where the reference has nothing.
    pub wrong_hit_px: usize,
    /// Misses where the reference has a surface.
    pub wrong_miss_px: usize,
    /// `wrong_hit_px / hit_px`.
    pub wrong_hit_rate: Option<f64>,
    /// `unknown_px / pixels`.
    pub unknown_rate: Option<f64>,
    /// The median of |z' - z| / z, over hits where the reference has a surface.
    pub relative_p50: Option<f64>,
    /// The 95th percentile.
    pub relative_p95: Option<f64>,
    /// The maximum.
    pub relative_max: Option<f64>,
}

/// Compares planes of inverse planar depth, per metre, of one camera, over all pixels or those of a mask.
///
/// # Errors
/// Planes or mask differ in size.
pub fn depth_errors(reference: &[f32], test: &[f32], mask: Option<&[bool]>) -> Result<DepthErrors, MetricsError> {
    expect_len("test depth", test.len(), reference.len())?;
    expect_mask(mask, reference.len())?;
    let pairs = reference.iter().zip(test).enumerate();
    let mut tally = Tally::default();
    for (_, (&reference, &test)) in pairs.filter(|(index, _)| mask.is_none_or(|mask| mask[*index])) {
        tally.add(reference, test);
    }
    Ok(tally.finish())
}

/// Counts so far, and the relative errors of the hits on surfaces.
#[derive(Default)]
struct Tally {
    counts: DepthErrors,
    relative: Vec<f64>,
}

impl Tally {
    fn add(&mut self, reference: f32, test: f32) {
        let is_surface = reference > 0.0;
        self.counts.pixels += 1;
        self.counts.foreground_px += usize::from(is_surface);
        if test > 0.0 {
            self.add_hit(is_surface.then_some(reference), test);
        } else if test == 0.0 {
            self.counts.miss_px += 1;
            self.counts.wrong_miss_px += usize::from(is_surface);
        } else {
            self.counts.unknown_px += 1;
        }
    }

    fn add_hit(&mut self, surface: Option<f32>, test: f32) {
        self.counts.hit_px += 1;
        // |1/t - 1/r| / (1/r) = |r/t - 1|
        let relative = surface.map(|reference| (f64::from(reference) / f64::from(test) - 1.0).abs());
        self.counts.wrong_hit_px += usize::from(relative.is_none_or(|relative| relative > WRONG_HIT_RELATIVE));
        self.relative.extend(relative);
    }

    fn finish(mut self) -> DepthErrors {
        self.relative.sort_by(f64::total_cmp);
        let rate = |part: usize, whole: usize| (whole > 0).then(|| part as f64 / whole as f64);
        DepthErrors {
            wrong_hit_rate: rate(self.counts.wrong_hit_px, self.counts.hit_px),
            unknown_rate: rate(self.counts.unknown_px, self.counts.pixels),
            relative_p50: percentile(&self.relative, 0.50),
            relative_p95: percentile(&self.relative, 0.95),
            relative_max: self.relative.last().copied(),
            ..self.counts
        }
    }
}

/// The least value that at least `share` of the sorted values do not exceed.
fn percentile(sorted: &[f64], share: f64) -> Option<f64> {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.max(1) - 1).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_outcome_is_counted_once() {
        let reference = [0.5, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0];
        let test = [0.5, 0.4, 0.0, -1.0, 0.3, 0.0, f32::NAN];
        let errors = depth_errors(&reference, &test, None).unwrap();
        assert_eq!((errors.pixels, errors.foreground_px), (7, 4));
        assert_eq!((errors.hit_px, errors.miss_px, errors.unknown_px), (3, 2, 2));
        assert_eq!((errors.wrong_hit_px, errors.wrong_miss_px), (2, 1));
        assert!((errors.relative_max.unwrap() - 0.25).abs() < 1e-6, "2.5 m for 2 m");
    }

    #[test]
    fn percentiles_of_a_ramp() {
        let test: Vec<f32> = (1..=100).map(|i| 1.0 / (1.0 + i as f32 * 1e-3)).collect();
        let errors = depth_errors(&[1.0; 100], &test, None).unwrap();
        assert!((errors.relative_p50.unwrap() - 0.050).abs() < 1e-6);
        assert!((errors.relative_p95.unwrap() - 0.095).abs() < 1e-6);
        assert_eq!(errors.wrong_hit_px, 90, "those of more than 1 %, the tenth being on the bound or beside it");
    }

    #[test]
    fn identical_has_no_error_and_an_empty_mask_no_rates() {
        let depth = [0.5, 0.0];
        let errors = depth_errors(&depth, &depth, None).unwrap();
        assert_eq!((errors.wrong_hit_rate, errors.relative_max), (Some(0.0), Some(0.0)));
        let none = depth_errors(&depth, &depth, Some(&[false, false])).unwrap();
        assert_eq!(none, DepthErrors::default());
    }

    #[test]
    fn sizes_must_agree() {
        assert!(depth_errors(&[0.5], &[0.5, 0.5], None).is_err());
        assert!(depth_errors(&[0.5], &[0.5], Some(&[])).is_err());
    }
}
