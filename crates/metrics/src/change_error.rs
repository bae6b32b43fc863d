//! Errors of the change from frame to frame: what flickers, swims or jumps.

use depth_image::View;

use crate::image::expect_same_size;
use crate::{MetricsError, ScoreMap};

/// |(T₁ − T₀) − (R₁ − R₀)| of each pixel, the mean over its channels, in shares of full scale: from 0, where both change
/// alike, to 2.
///
/// # Errors
/// Images differ in size.
pub fn change_error_map(reference: [&View; 2], test: [&View; 2]) -> Result<ScoreMap, MetricsError> {
    for image in [reference[1], test[0], test[1]] {
        expect_same_size(reference[0], image)?;
    }
    let off: Vec<i32> =
        changes(test).zip(changes(reference)).map(|(test, reference)| (test - reference).abs()).collect();
    let pixels = off.as_chunks::<3>().0.iter().map(|channels| channels.iter().sum::<i32>() as f32 / (3.0 * 255.0));
    Ok(ScoreMap { size_px: reference[0].size_px, border_px: 0, values: pixels.collect() })
}

/// The change of each channel of each pixel.
fn changes([from, to]: [&View; 2]) -> impl Iterator<Item = i32> {
    from.srgb8.iter().zip(&to.srgb8).map(|(&from, &to)| i32::from(to) - i32::from(from))
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    fn flat(value: u8) -> View {
        View::from_srgb8(UVec2::splat(2), vec![value; 12])
    }

    fn mean(reference: [u8; 2], test: [u8; 2]) -> f64 {
        let [reference, test] = [reference, test].map(|values| values.map(flat));
        let map = change_error_map(reference.each_ref(), test.each_ref()).unwrap();
        map.mean(None).unwrap().unwrap()
    }

    #[test]
    fn equal_changes_have_no_error_whatever_the_pictures_are() {
        assert_eq!(mean([10, 90], [30, 110]), 0.0);
        assert!((mean([10, 10], [0, 51]) - 0.2).abs() < 1e-7);
        assert!((mean([51, 0], [0, 51]) - 0.4).abs() < 1e-7);
        assert_eq!(mean([255, 0], [0, 255]), 2.0);
    }

    #[test]
    fn images_of_different_sizes_are_refused() {
        let flat = flat(1);
        let other = View::from_srgb8(UVec2::new(1, 2), vec![1; 6]);
        assert!(change_error_map([&flat, &flat], [&flat, &other]).is_err());
    }
}
