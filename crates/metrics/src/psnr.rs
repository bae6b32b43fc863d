//! Peak signal-to-noise ratio on 8-bit sRGB.

use depth_image::View;

use crate::image::{expect_same_size, pixels};
use crate::{MetricsError, error::expect_mask};

/// The PSNR of equal images in reports: JSON has no infinity. A value above is written as this one, which reads "at
/// least".
pub const PSNR_CAP_DB: f64 = 99.99;

/// Peak signal-to-noise ratio over all three channels, decibels; infinite where nothing differs, `None`
/// for an empty mask.
///
/// # Errors
/// Images or mask differ in size.
pub fn psnr_db(reference: &View, test: &View, mask: Option<&[bool]>) -> Result<Option<f64>, MetricsError> {
    expect_same_size(reference, test)?;
    expect_mask(mask, pixels(reference).len())?;
    let pairs = pixels(reference).iter().zip(pixels(test)).enumerate();
    let selected = pairs.filter(|(index, _)| mask.is_none_or(|mask| mask[*index]));
    let (sum, pixels) = selected
        .fold((0_u64, 0_u64), |(sum, pixels), (_, (a, b))| (sum + u64::from(squared_distance(*a, *b)), pixels + 1));
    let mean = sum as f64 / (3 * pixels) as f64;
    let db = if mean > 0.0 { 10.0 * (255.0 * 255.0 / mean).log10() } else { f64::INFINITY };
    Ok((pixels > 0).then_some(db))
}

fn squared_distance(a: [u8; 3], b: [u8; 3]) -> u32 {
    a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    fn flat(value: u8) -> View {
        View::from_srgb8(UVec2::new(4, 3), vec![value; 36])
    }

    #[test]
    fn a_constant_offset_has_a_known_psnr() {
        let expected = 20.0 * (255.0_f64 / 5.0).log10();
        let psnr = psnr_db(&flat(100), &flat(105), None).unwrap().unwrap();
        assert!((psnr - expected).abs() < 1e-12);
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
        let test = View::from_srgb8(UVec2::new(4, 3), bytes);
        let mut first = [false; 12];
        first[0] = true;
        let psnr = psnr_db(&flat(50), &test, Some(&first)).unwrap().unwrap();
        assert!((psnr - 10.0 * (255.0_f64.powi(2) * 3.0 / 100.0).log10()).abs() < 1e-12);
    }

    #[test]
    fn sizes_must_agree() {
        let other = View::from_srgb8(UVec2::new(3, 4), vec![0; 36]);
        assert!(matches!(psnr_db(&flat(0), &other, None), Err(MetricsError::SizesDiffer { .. })));
        assert!(matches!(psnr_db(&flat(0), &flat(0), Some(&[true])), Err(MetricsError::BufferSize { .. })));
    }
}
