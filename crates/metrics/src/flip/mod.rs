//! LDR-FLIP: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: A Difference
//! Evaluator for Alternating Images", HPG 2020. Section numbers below are the paper's.
//!
//! A colour difference is raised by a feature difference: `ΔE = ΔEc^(1 - ΔEf)`. The colour difference is that of both
//! images blurred by the eye's contrast sensitivity; features are edges and points that only one image has.

mod color_difference;
mod feature_difference;
mod kernels;

use rayon::prelude::*;

use crate::{MetricsError, Rgb8Image, ScoreMap, color::REC_709, color::WhiteRelative, color::convert_srgb_pixels};

/// The paper's viewer: 0.7 m from a display 0.7 m wide with 3840 columns, 0.7 · 3840 / 0.7 · π / 180.
pub const FLIP_PIXELS_PER_DEGREE: f32 = 67.020_64;

/// FLIP's error of every pixel, 0 to 1, for the default viewer.
///
/// # Errors
/// Images differ in size.
pub fn flip_map(reference: &Rgb8Image, test: &Rgb8Image) -> Result<ScoreMap, MetricsError> {
    flip_map_at(reference, test, FLIP_PIXELS_PER_DEGREE)
}

/// FLIP's error of every pixel, 0 to 1, for a viewer with this many pixels a degree.
///
/// # Errors
/// Images of different sizes, or no such viewer.
pub fn flip_map_at(reference: &Rgb8Image, test: &Rgb8Image, pixels_per_degree: f32) -> Result<ScoreMap, MetricsError> {
    reference.expect_same_size(test)?;
    if !(pixels_per_degree.is_finite() && pixels_per_degree > 0.0) {
        return Err(MetricsError::Setting { what: "pixels per degree" });
    }
    let space = WhiteRelative::new(REC_709);
    let [reference_ycxcz, test_ycxcz] =
        [reference, test].map(|image| convert_srgb_pixels(image, |linear| space.ycxcz_from_linear(linear)));
    let width = reference.width_px() as usize;
    let color = color_difference::map(&reference_ycxcz, &test_ycxcz, width, pixels_per_degree);
    let feature = feature_difference::map(&reference_ycxcz, &test_ycxcz, width, pixels_per_degree);
    let values = color.par_iter().zip(&feature).map(|(color, feature)| color.powf(1.0 - feature)).collect();
    let (width_px, height_px) = reference.size_px();
    Ok(ScoreMap { width_px, height_px, border_px: 0, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(rgb: [u8; 3]) -> Rgb8Image<'static> {
        Rgb8Image::new(5, 4, rgb.repeat(20)).unwrap()
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
    fn an_impossible_viewer_is_refused() {
        for pixels_per_degree in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(flip_map_at(&flat([0; 3]), &flat([0; 3]), pixels_per_degree).is_err());
        }
    }
}
