//! Yee's perceptual difference, the measure of Lages' comparison (H. Yee, "A Perceptual Metric for
//! Production Testing", Journal of Graphics Tools 9(4), 2004, after Yee, Pattanaik, Greenberg, ACM TOG
//! 20(1), 2001).
//!
//! A pixel fails if its luminance differs by more than `F · tvi(L)`, or its squared difference in (a*, b*) exceeds `F`.
//! `F`, from 1 to 10, grows where the eye is insensitive. It follows from contrast sensitivity (Barten 1989) and visual
//! masking (Daly 1993), weighed by the contrast in each octave of spatial frequency. `tvi` is Ward Larson's threshold
//! against intensity (1997). The code is written from those papers.

mod vision;

use depth_image::View;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::MetricsError;
use crate::color::{ADOBE_RGB, WhiteRelative, convert_pixels, lab_from_relative_xyz};
use crate::convolution::{Edge, Plane};
use crate::image::expect_same_size;
use vision::{FrequencyBands, LEVELS, threshold_vs_intensity};

/// Burt and Adelson's generating kernel.
const BINOMIAL: [f32; 5] = [0.05, 0.25, 0.4, 0.25, 0.05];
/// The least luminance, cd/m².
const DARKEST_CD_M2: f32 = 1e-5;
/// The adaptation luminance below which colour fades, cd/m².
const COLOR_VISION_CD_M2: f32 = 10.0;

/// The horizontal angle of the image, degrees: the public tool and the counts of papers assume it, as well as the display below.
const FIELD_OF_VIEW_DEG: f32 = 45.0;
/// The exponent from 8 bits to light.
const GAMMA: f32 = 2.2;
/// The luminance of white.
const WHITE_CD_M2: f32 = 100.0;

/// Yee's perceptual difference: whether a viewer sees a pixel differ, for each pixel, row by row. The channels have the
/// primaries of Adobe RGB (1998), as the public tool assumes; they weigh chroma a little more than those of sRGB.
///
/// # Errors
/// Images differ in size.
pub fn pdiff_map(reference: &View, test: &View) -> Result<Vec<bool>, MetricsError> {
    expect_same_size(reference, test)?;
    let bands = FrequencyBands::new(reference.size_px.x, FIELD_OF_VIEW_DEG);
    let [reference, test] = [reference, test].map(PerceivedImage::new);
    let pixels = (0..reference.ab.len()).into_par_iter();
    Ok(pixels.map(|index| fails(&reference, &test, &bands, index)).collect())
}

/// One image as the eye adapts to it.
struct PerceivedImage {
    /// Luminance, cd/m², from sharp to smooth.
    pyramid: Vec<Plane>,
    /// (a*, b*).
    ab: Vec<Vec2>,
}

impl PerceivedImage {
    fn new(image: &View) -> Self {
        let space = WhiteRelative::new(ADOBE_RGB);
        let xyz: Vec<Vec3> = convert_pixels(
            image,
            |encoded| (f32::from(encoded) / 255.0).powf(GAMMA),
            |linear| space.xyz_from_linear(linear),
        );
        let luminance = xyz.iter().map(|xyz| xyz.y * WHITE_CD_M2).collect();
        let lab = xyz.iter().map(|&xyz| lab_from_relative_xyz(xyz));
        Self {
            pyramid: pyramid(Plane { width: image.size_px.x as usize, values: luminance }),
            ab: lab.map(|lab| Vec2::new(lab.y, lab.z)).collect(),
        }
    }

    fn luminance(&self, level: usize, index: usize) -> f32 {
        self.pyramid[level].values[index]
    }
}

/// The pyramid at full size: each level is the one before, smoothed once more.
fn pyramid(luminance: Plane) -> Vec<Plane> {
    let levels =
        std::iter::successors(Some(luminance), |finer| Some(finer.convolved(&BINOMIAL, &BINOMIAL, Edge::Mirror)));
    levels.take(LEVELS).collect()
}

/// True if a viewer sees a pixel differ.
fn fails(reference: &PerceivedImage, test: &PerceivedImage, bands: &FrequencyBands, index: usize) -> bool {
    let level = bands.adaptation_level;
    let mean = (reference.luminance(level, index) + test.luminance(level, index)) / 2.0;
    let adaptation_cd_m2 = mean.max(DARKEST_CD_M2);
    let contrast = std::array::from_fn(|band| contrast([reference, test], index, band));
    let elevation = bands.threshold_elevation(&contrast, adaptation_cd_m2);
    let delta_cd_m2 = (reference.luminance(0, index) - test.luminance(0, index)).abs();
    // Colour is seen in full above 10 cd/m² and fades, squared, to nothing in the dark.
    let color_scale = (adaptation_cd_m2 / COLOR_VISION_CD_M2).min(1.0).powi(2);
    delta_cd_m2 > elevation * threshold_vs_intensity(adaptation_cd_m2)
        || reference.ab[index].distance_squared(test.ab[index]) * color_scale > elevation
}

/// The contrast of a band: the stronger amplitude against the brighter background of two images.
fn contrast(images: [&PerceivedImage; 2], index: usize, band: usize) -> f32 {
    let amplitudes_cd_m2 = images.map(|seen| (seen.luminance(band, index) - seen.luminance(band + 1, index)).abs());
    let [a, b] = images.map(|seen| seen.luminance(band + 2, index).abs());
    amplitudes_cd_m2[0].max(amplitudes_cd_m2[1]) / a.max(b).max(DARKEST_CD_M2)
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    fn flat(rgb: [u8; 3]) -> View {
        View::from_srgb8(UVec2::new(64, 48), rgb.repeat(64 * 48))
    }

    fn failing(a: [u8; 3], b: [u8; 3]) -> usize {
        pdiff_map(&flat(a), &flat(b)).unwrap().into_iter().filter(|&fails| fails).count()
    }

    #[test]
    fn an_invisible_difference_passes() {
        assert_eq!(failing([120; 3], [120; 3]), 0);
        assert_eq!(failing([120; 3], [121; 3]), 0);
    }

    #[test]
    fn a_visible_difference_fails() {
        assert_eq!(failing([120; 3], [160; 3]), 64 * 48);
        assert_eq!(failing([200, 100, 100], [100, 145, 100]), 64 * 48, "equal luminance, other colour");
    }
}
