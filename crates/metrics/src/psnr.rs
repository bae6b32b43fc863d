//! Peak signal-to-noise ratio on 8-bit sRGB.

use crate::{MetricsError, Rgb8Image, error::expect_mask};

/// Peak signal-to-noise ratio over all three channels, decibels; infinite where nothing differs, `None`
/// for an empty mask.
///
/// # Errors
/// Images or mask differ in size.
pub fn psnr_db(reference: &Rgb8Image, test: &Rgb8Image, mask: Option<&[bool]>) -> Result<Option<f64>, MetricsError> {
    Ok(mean_squared_error(reference, test, mask)?.map(db_from_mean_squared_error))
}

/// The mean over pixels and channels of the squared difference in 8-bit steps; `None` for an empty mask.
///
/// # Errors
/// Images or mask differ in size.
pub fn mean_squared_error(
    reference: &Rgb8Image,
    test: &Rgb8Image,
    mask: Option<&[bool]>,
) -> Result<Option<f64>, MetricsError> {
    let (sum, pixels) = differences(reference, test, mask)?
        .fold((0_u64, 0_u64), |(sum, pixels), delta| (sum + u64::from(squared_length(delta)), pixels + 1));
    Ok((pixels > 0).then(|| sum as f64 / (3 * pixels) as f64))
}

/// The greatest difference in any channel, in 8-bit steps; `None` for an empty mask.
///
/// # Errors
/// Images or mask differ in size.
pub fn max_channel_difference(
    reference: &Rgb8Image,
    test: &Rgb8Image,
    mask: Option<&[bool]>,
) -> Result<Option<u8>, MetricsError> {
    Ok(differences(reference, test, mask)?.flatten().max())
}

/// 10 · log10(255² / MSE).
pub(crate) fn db_from_mean_squared_error(mean_squared_error: f64) -> f64 {
    match mean_squared_error > 0.0 {
        true => 10.0 * (255.0 * 255.0 / mean_squared_error).log10(),
        false => f64::INFINITY,
    }
}

/// Channel by channel differences of the selected pixels.
fn differences<'a>(
    reference: &'a Rgb8Image,
    test: &'a Rgb8Image,
    mask: Option<&'a [bool]>,
) -> Result<impl Iterator<Item = [u8; 3]> + 'a, MetricsError> {
    reference.expect_same_size(test)?;
    expect_mask(mask, reference.pixel_count())?;
    let pairs = reference.pixels().zip(test.pixels()).enumerate();
    let selected = pairs.filter(move |(index, _)| mask.is_none_or(|mask| mask[*index]));
    Ok(selected.map(|(_, (a, b))| std::array::from_fn(|channel| a[channel].abs_diff(b[channel]))))
}

fn squared_length(delta: [u8; 3]) -> u32 {
    delta.iter().map(|&d| u32::from(d).pow(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: u8) -> Rgb8Image<'static> {
        Rgb8Image::new(4, 3, vec![value; 36]).unwrap()
    }

    #[test]
    fn a_constant_offset_has_a_known_psnr() {
        let expected = 20.0 * (255.0_f64 / 5.0).log10();
        let psnr = psnr_db(&flat(100), &flat(105), None).unwrap().unwrap();
        assert!((psnr - expected).abs() < 1e-12);
        assert_eq!(max_channel_difference(&flat(100), &flat(95), None).unwrap(), Some(5));
    }

    #[test]
    fn identical_images_have_infinite_psnr_and_an_empty_mask_has_no_mean() {
        assert_eq!(psnr_db(&flat(7), &flat(7), None).unwrap(), Some(f64::INFINITY));
        assert_eq!(psnr_db(&flat(7), &flat(9), Some(&[false; 12])).unwrap(), None);
    }

    #[test]
    fn a_mask_selects() {
        let mut bytes = vec![50; 36];
        bytes[0] = 60;
        let test = Rgb8Image::new(4, 3, bytes).unwrap();
        let mut first = [false; 12];
        first[0] = true;
        let error = mean_squared_error(&flat(50), &test, Some(&first)).unwrap().unwrap();
        assert!((error - 100.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn sizes_must_agree() {
        let other = Rgb8Image::new(3, 4, vec![0; 36]).unwrap();
        assert!(matches!(psnr_db(&flat(0), &other, None), Err(MetricsError::SizesDiffer { .. })));
        assert!(matches!(psnr_db(&flat(0), &flat(0), Some(&[true])), Err(MetricsError::BufferSize { .. })));
    }
}
