//! Flicker: the change from frame to frame against the reference's change.

use crate::{MetricsError, Rgb8Image, psnr::db_from_mean_squared_error};

/// PSNR of `test[1] - test[0]` against `reference[1] - reference[0]`, decibels, with a peak of 255; infinite
/// where both change alike.
///
/// # Errors
/// Images differ in size.
pub fn temporal_psnr_db(reference: [&Rgb8Image; 2], test: [&Rgb8Image; 2]) -> Result<f64, MetricsError> {
    for image in [reference[1], test[0], test[1]] {
        reference[0].expect_same_size(image)?;
    }
    let changes = |frames: [&Rgb8Image; 2], index: usize| {
        i64::from(frames[1].srgb8()[index]) - i64::from(frames[0].srgb8()[index])
    };
    let bytes = reference[0].srgb8().len();
    let squares: i64 = (0..bytes).map(|index| (changes(test, index) - changes(reference, index)).pow(2)).sum();
    Ok(db_from_mean_squared_error(squares as f64 / bytes as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: u8) -> Rgb8Image<'static> {
        Rgb8Image::new(2, 2, vec![value; 12]).unwrap()
    }

    #[test]
    fn a_constant_error_does_not_flicker() {
        let psnr = temporal_psnr_db([&flat(10), &flat(90)], [&flat(30), &flat(110)]).unwrap();
        assert_eq!(psnr, f64::INFINITY);
    }

    #[test]
    fn flicker_of_a_step_is_48_db() {
        let psnr = temporal_psnr_db([&flat(10), &flat(10)], [&flat(10), &flat(11)]).unwrap();
        assert!((psnr - 20.0 * 255.0_f64.log10()).abs() < 1e-12);
    }
}
