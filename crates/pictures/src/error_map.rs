//! Error maps as colours.

use image::{Rgb, RgbImage};
use metrics::ScoreMap;

/// A map of 0…1 in magma: black is no error, pale yellow the greatest.
#[must_use]
pub fn error_map(map: &ScoreMap) -> RgbImage {
    let [width, height] = map.size_px.to_array();
    RgbImage::from_fn(width, height, |x, y| {
        let value = map.values[(y * width + x) as usize];
        let share = if value.is_nan() { 0.0 } else { f64::from(value.clamp(0.0, 1.0)) };
        Rgb(colorous::MAGMA.eval_continuous(share).as_array())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use depth_image::View;
    use glam::UVec2;
    use metrics::flip_map;

    #[test]
    fn an_error_of_0_is_black_and_of_1_pale() {
        let flat = |rgb: [u8; 3]| View::from_srgb8(UVec2::splat(2), rgb.repeat(4));
        let none = error_map(&flip_map(&flat([9; 3]), &flat([9; 3])).unwrap());
        assert_eq!(none[(0, 0)].0, [0, 0, 4]);
        let all = error_map(&flip_map(&flat([0, 255, 0]), &flat([0, 0, 255])).unwrap());
        assert!(all[(1, 1)].0.iter().all(|&channel| channel > 180), "{:?}", all[(1, 1)]);
    }
}
