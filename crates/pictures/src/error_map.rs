//! Error maps as colours.

use image::{Rgb, RgbImage};
use metrics::ScoreMap;

/// A map of 0…1 in magma: black is no error, pale yellow the greatest.
#[must_use]
pub fn error_map(map: &ScoreMap) -> RgbImage {
    let ScoreMap { width_px, height_px, values, .. } = map;
    RgbImage::from_fn(*width_px, *height_px, |x, y| {
        let value = values[(y * width_px + x) as usize];
        let share = if value.is_nan() { 0.0 } else { f64::from(value.clamp(0.0, 1.0)) };
        Rgb(colorous::MAGMA.eval_continuous(share).as_array())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use metrics::{Rgb8Image, flip_map};

    #[test]
    fn an_error_of_0_is_black_and_of_1_pale() {
        let flat = |rgb: [u8; 3]| Rgb8Image::new(2, 2, rgb.repeat(4)).unwrap();
        let none = error_map(&flip_map(&flat([9; 3]), &flat([9; 3])).unwrap());
        assert_eq!(none[(0, 0)].0, [0, 0, 4]);
        let all = error_map(&flip_map(&flat([0, 255, 0]), &flat([0, 0, 255])).unwrap());
        assert!(all[(1, 1)].0.iter().all(|&channel| channel > 180), "{:?}", all[(1, 1)]);
    }
}
