//! Structural similarity (Wang, Bovik, Sheikh, Simoncelli 2004). The choices are those of scikit-image's
//! `structural_similarity(a, b, channel_axis=2)` for 8-bit images: a 7×7 uniform window, the sample covariance (divided
//! by n-1), `K1 = 0.01` and `K2 = 0.03`. The mean is over the pixels whose whole window lies in the image.
//!
//! Window sums of 8-bit values are whole numbers, so they are exact here.

use depth_image::View;
use rayon::prelude::*;

use crate::image::expect_same_size;
use crate::{MetricsError, ScoreMap};

/// Side of the window.
pub const SSIM_WINDOW_PX: u32 = 7;

const RADIUS: usize = SSIM_WINDOW_PX as usize / 2;
const SAMPLES: f64 = (SSIM_WINDOW_PX * SSIM_WINDOW_PX) as f64;
const C1: f64 = (0.01 * 255.0) * (0.01 * 255.0);
const C2: f64 = (0.03 * 255.0) * (0.03 * 255.0);

/// The structural similarity of the window around every pixel, mean of the three channels.
///
/// # Errors
/// Images differ in size, or are smaller than the window.
pub fn ssim_map(reference: &View, test: &View) -> Result<ScoreMap, MetricsError> {
    expect_same_size(reference, test)?;
    let size_px = reference.size_px;
    if size_px.min_element() < SSIM_WINDOW_PX {
        return Err(MetricsError::SmallerThanWindow { size_px: size_px.into(), window_px: SSIM_WINDOW_PX });
    }
    let [width, height] = size_px.to_array().map(|side| side as usize);
    let mut values = vec![0.0; width * height];
    let interior = values.par_chunks_exact_mut(width).enumerate().take(height - RADIUS).skip(RADIUS);
    interior.for_each(|(y, row)| fill_row(row, y, reference, test));
    Ok(ScoreMap { size_px, border_px: RADIUS as u32, values })
}

/// The first and second moments of a window, times its samples: `a`, `b`, `aa`, `bb`, `ab`.
#[derive(Clone, Copy, Default)]
struct Sums([i64; 5]);

impl Sums {
    fn of(a: u8, b: u8) -> Self {
        let a = i64::from(a);
        let b = i64::from(b);
        Self([a, b, a * a, b * b, a * b])
    }

    fn plus(self, other: Self, sign: i64) -> Self {
        Self(std::array::from_fn(|moment| self.0[moment] + sign * other.0[moment]))
    }

    fn similarity(self) -> f64 {
        let Self([a, b, aa, bb, ab]) = self;
        let mean_a = a as f64 / SAMPLES;
        let mean_b = b as f64 / SAMPLES;
        let variances = covariance(aa, a, a) + covariance(bb, b, b);
        let luminance = (2.0 * mean_a * mean_b + C1) / (mean_a * mean_a + mean_b * mean_b + C1);
        luminance * (2.0 * covariance(ab, a, b) + C2) / (variances + C2)
    }
}

/// The sample covariance of two sums, from that of their products.
fn covariance(product: i64, x: i64, y: i64) -> f64 {
    (SAMPLES * product as f64 - x as f64 * y as f64) / (SAMPLES * (SAMPLES - 1.0))
}

/// One row of the map.
fn fill_row(row: &mut [f32], y: usize, reference: &View, test: &View) {
    let width = row.len();
    for channel in 0..3 {
        let columns: Vec<Sums> = (0..width).map(|x| column_sums(x, y, channel, reference, test)).collect();
        let mut window = columns[..2 * RADIUS].iter().fold(Sums::default(), |sum, &column| sum.plus(column, 1));
        for x in RADIUS..width - RADIUS {
            window = window.plus(columns[x + RADIUS], 1);
            row[x] += (window.similarity() / 3.0) as f32;
            window = window.plus(columns[x - RADIUS], -1);
        }
    }
}

/// The sums down the part of a column that the window around row `y` covers.
fn column_sums(x: usize, y: usize, channel: usize, reference: &View, test: &View) -> Sums {
    let width = reference.size_px.x as usize;
    (y - RADIUS..=y + RADIUS).fold(Sums::default(), |sum, row| {
        let index = (row * width + x) * 3 + channel;
        sum.plus(Sums::of(reference.srgb8[index], test.srgb8[index]), 1)
    })
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    #[test]
    fn identical_is_one() {
        let bytes: Vec<u8> = (0..9 * 8 * 3).map(|i| (i * 37 % 251) as u8).collect();
        let image = View::from_srgb8(UVec2::new(9, 8), bytes);
        let map = ssim_map(&image, &image).unwrap();
        assert!((map.mean(None).unwrap().unwrap() - 1.0).abs() < 1e-7);
    }

    #[test]
    fn flat_images_differ_by_luminance_alone() {
        let flat = |value| View::from_srgb8(UVec2::splat(7), vec![value; 147]);
        let expected = (2.0 * 100.0 * 120.0 + C1) / (100.0_f64.powi(2) + 120.0_f64.powi(2) + C1);
        let mean = ssim_map(&flat(100), &flat(120)).unwrap().mean(None).unwrap().unwrap();
        assert!((mean - expected).abs() < 1e-7);
    }

    #[test]
    fn an_image_below_the_window_is_refused() {
        let small = View::from_srgb8(UVec2::new(6, 9), vec![0; 162]);
        assert!(matches!(ssim_map(&small, &small), Err(MetricsError::SmallerThanWindow { window_px: 7, .. })));
    }
}
