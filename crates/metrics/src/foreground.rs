//! Errors of a picture: over the pixels that show a surface, and over the whole.

use depth_image::View;

use crate::image::{expect_same_size, pixels};
use crate::{MetricsError, PSNR_CAP_DB, error::expect_len, flip_map, psnr_db, ssim_map};

/// PSNR, SSIM and FLIP of a picture, over some of its pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureErrors {
    /// At most [`PSNR_CAP_DB`].
    pub psnr_db: f64,
    /// 1 where nothing differs.
    pub ssim: f64,
    /// 0 where nothing differs.
    pub flip: f64,
}

impl PictureErrors {
    /// The errors over the foreground, then over the whole picture. Empty space around a model lowers the errors of the
    /// whole. The foreground's are the whole's where there is none.
    ///
    /// # Errors
    /// The pictures differ in size, or the reference has no depth.
    pub fn of(reference: &View, test: &View) -> Result<[Self; 2], MetricsError> {
        let foreground = foreground(reference, test)?;
        let ssim = ssim_map(reference, test)?;
        let flip = flip_map(reference, test)?;
        let over = |mask: Option<&[bool]>| {
            let errors = (psnr_db(reference, test, mask)?, ssim.mean(mask)?, flip.mean(mask)?);
            let (Some(psnr_db), Some(ssim), Some(flip)) = errors else { return Ok(None) };
            Ok::<_, MetricsError>(Some(Self { psnr_db: psnr_db.min(PSNR_CAP_DB), ssim, flip }))
        };
        let whole = over(None)?.ok_or(MetricsError::Empty { what: "image" })?;
        Ok([over(Some(&foreground))?.unwrap_or(whole), whole])
    }
}

/// The pixels in which the reference or the test shows a surface. The test does where it differs from the reference's
/// background.
///
/// # Errors
/// The pictures differ in size, or the reference has no depth.
pub fn foreground(reference: &View, test: &View) -> Result<Vec<bool>, MetricsError> {
    expect_same_size(reference, test)?;
    let depth = reference.inverse_depth_per_m.as_ref().ok_or(MetricsError::Empty { what: "plane of depth" })?;
    expect_len("plane of depth", depth.len(), pixels(reference).len())?;
    let pairs = pixels(reference).iter().zip(pixels(test));
    Ok(depth.iter().zip(pairs).map(|(&inverse, (a, b))| inverse > 0.0 || a != b).collect())
}

#[cfg(test)]
mod tests {
    use glam::UVec2;

    use super::*;

    /// Of 16 × 16 pixels, with a surface in the upper half.
    fn view() -> View {
        let inverse_depth_per_m = (0..256).map(|pixel| if pixel < 128 { 0.5 } else { 0.0 }).collect();
        View {
            size_px: UVec2::splat(16),
            srgb8: vec![100; 768],
            inverse_depth_per_m: Some(inverse_depth_per_m),
            provenance: None,
        }
    }

    fn picture(srgb8: Vec<u8>) -> View {
        View::from_srgb8(UVec2::splat(16), srgb8)
    }

    #[test]
    fn surfaces_of_either_picture_count() {
        let mut srgb8 = vec![100; 768];
        srgb8[767] = 90;
        let mask = foreground(&view(), &picture(srgb8)).unwrap();
        assert_eq!(mask.iter().filter(|&&surface| surface).count(), 129);
        assert!(mask[0] && mask[255] && !mask[254]);
    }

    #[test]
    fn empty_space_does_not_lower_the_errors_of_the_foreground() {
        let srgb8 = (0..768).map(|byte| if byte < 384 { 110 } else { 100 }).collect();
        let [foreground, whole] = PictureErrors::of(&view(), &picture(srgb8)).unwrap();
        let expected_db = 20.0 * (255.0_f64 / 10.0).log10();
        assert!((foreground.psnr_db - expected_db).abs() < 1e-9, "{foreground:?}");
        assert!((whole.psnr_db - expected_db - 10.0 * 2.0_f64.log10()).abs() < 1e-9, "{whole:?}");
        assert!(foreground.flip > 1.5 * whole.flip && foreground.ssim < whole.ssim, "{foreground:?} {whole:?}");
    }

    #[test]
    fn a_view_without_depth_or_of_another_size_is_refused() {
        let without = View { inverse_depth_per_m: None, ..view() };
        assert!(foreground(&without, &picture(vec![0; 768])).is_err());
        assert!(foreground(&view(), &View::from_srgb8(UVec2::splat(8), vec![0; 192])).is_err());
        let short = View { inverse_depth_per_m: Some(vec![1.0; 2]), ..view() };
        assert!(PictureErrors::of(&short, &picture(vec![0; 768])).is_err());
    }
}
