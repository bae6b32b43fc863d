//! Errors of reconstructed depth, and the rate of pixels without an answer.

use crate::{MetricsError, error::expect_len};

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
    /// Test pixels without an answer, which count in no error below.
    pub unknown_px: usize,
    /// Hits off by more than 1 % in depth, and hits where the reference has nothing.
    pub wrong_hit_px: usize,
    /// Misses where the reference has a surface.
    pub wrong_miss_px: usize,
    /// `wrong_hit_px / hit_px`.
    pub wrong_hit_rate: Option<f64>,
}

/// Compares planes of inverse planar depth, per metre, of one camera.
///
/// # Errors
/// Planes differ in size.
pub fn depth_errors(reference: &[f32], test: &[f32]) -> Result<DepthErrors, MetricsError> {
    expect_len("test depth", test.len(), reference.len())?;
    let mut errors = DepthErrors { pixels: reference.len(), ..DepthErrors::default() };
    reference.iter().zip(test).for_each(|(&reference, &test)| errors.add(reference, test));
    errors.wrong_hit_rate = (errors.hit_px > 0).then(|| errors.wrong_hit_px as f64 / errors.hit_px as f64);
    Ok(errors)
}

impl DepthErrors {
    fn add(&mut self, reference: f32, test: f32) {
        let is_surface = reference > 0.0;
        self.foreground_px += usize::from(is_surface);
        if test > 0.0 {
            self.hit_px += 1;
            // |1/t - 1/r| / (1/r) = |r/t - 1|
            let relative = (f64::from(reference) / f64::from(test) - 1.0).abs();
            self.wrong_hit_px += usize::from(!is_surface || relative > WRONG_HIT_RELATIVE);
        } else if test == 0.0 {
            self.wrong_miss_px += usize::from(is_surface);
        } else {
            self.unknown_px += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_outcome_is_counted_once() {
        let reference = [0.5, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0];
        let test = [0.5, 0.4, 0.0, -1.0, 0.3, 0.0, f32::NAN];
        let errors = depth_errors(&reference, &test).unwrap();
        assert_eq!((errors.pixels, errors.foreground_px), (7, 4));
        assert_eq!((errors.hit_px, errors.unknown_px), (3, 2));
        assert_eq!((errors.wrong_hit_px, errors.wrong_miss_px), (2, 1));
    }

    #[test]
    fn hits_of_more_than_a_hundredth_are_wrong() {
        let test: Vec<f32> = (1..=100).map(|i| 1.0 / (1.0 + i as f32 * 1e-3)).collect();
        let errors = depth_errors(&[1.0; 100], &test).unwrap();
        assert_eq!(errors.wrong_hit_px, 90, "those of more than 1 %, the tenth being on the bound or beside it");
    }

    #[test]
    fn identical_has_no_error_and_no_pixels_have_no_rate() {
        let depth = [0.5, 0.0];
        let errors = depth_errors(&depth, &depth).unwrap();
        assert_eq!(errors.wrong_hit_rate, Some(0.0));
        assert_eq!(depth_errors(&[], &[]), Ok(DepthErrors::default()));
    }

    #[test]
    fn sizes_must_agree() {
        assert!(depth_errors(&[0.5], &[0.5, 0.5]).is_err());
    }
}
