//! All image metrics at once, overall and by pixel class.

use serde::{Serialize, Serializer};

use crate::error::expect_len;
use crate::{
    MetricsError, PdiffMap, PdiffSettings, PixelClass, Rgb8Image, SSIM_WINDOW_PX, ScoreMap, class_mask, flip_map,
    max_channel_difference, pdiff_map, psnr_db, ssim_map,
};

/// The PSNR of equal images in reports: JSON has no infinity. A value above is written as this one, which reads "at
/// least"; `null` means that there was no pixel.
pub const PSNR_CAP_DB: f64 = 99.99;

/// The errors of one set of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ImageErrors {
    /// The number of pixels.
    pub pixels: usize,
    /// PSNR, infinite for equal images and written as at most [`PSNR_CAP_DB`]; `None` without pixels.
    #[serde(serialize_with = "capped_db")]
    pub psnr_db: Option<f64>,
    /// Mean SSIM over the pixels whose 7×7 window lies in the image; `None` without any. Near the border of a class,
    /// the window has pixels of other classes.
    pub ssim: Option<f64>,
    /// Mean LDR-FLIP; `None` without pixels.
    pub flip: Option<f64>,
    /// The number of pixels that fail Yee's perceptual difference.
    pub pdiff_failing_px: usize,
    /// The greatest difference in any channel, in 8-bit steps; `None` without pixels.
    pub max_channel_difference: Option<u8>,
}

/// [`ImageErrors`] of each class.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ClassErrors {
    /// [`PixelClass::Silhouette`].
    pub silhouette: ImageErrors,
    /// [`PixelClass::Disoccluded`].
    pub disoccluded: ImageErrors,
    /// [`PixelClass::Covered`].
    pub covered: ImageErrors,
    /// [`PixelClass::Background`].
    pub background: ImageErrors,
}

/// The result of [`compare`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Errors of all pixels.
    pub overall: ImageErrors,
    /// Errors of each class, if classes were given.
    pub by_class: Option<ClassErrors>,
    /// FLIP at every pixel, for error maps.
    #[serde(skip)]
    pub flip_map: ScoreMap,
}

/// Compares two images by every metric, overall and, with one class a pixel, by class.
///
/// # Errors
/// Images or classes differ in size.
pub fn compare(
    reference: &Rgb8Image,
    test: &Rgb8Image,
    classes: Option<&[PixelClass]>,
) -> Result<Comparison, MetricsError> {
    let maps = Maps::new(reference, test)?;
    let by_class = classes.map(|classes| maps.by_class(classes)).transpose()?;
    Ok(Comparison { overall: maps.errors(None)?, by_class, flip_map: maps.flip })
}

/// Maps that the means are taken from.
struct Maps<'a> {
    reference: &'a Rgb8Image<'a>,
    test: &'a Rgb8Image<'a>,
    /// `None` for an image below the window.
    ssim: Option<ScoreMap>,
    flip: ScoreMap,
    pdiff: PdiffMap,
}

impl<'a> Maps<'a> {
    fn new(reference: &'a Rgb8Image<'a>, test: &'a Rgb8Image<'a>) -> Result<Self, MetricsError> {
        let holds_window = reference.width_px().min(reference.height_px()) >= SSIM_WINDOW_PX;
        let ssim = holds_window.then(|| ssim_map(reference, test)).transpose()?;
        let flip = flip_map(reference, test)?;
        let pdiff = pdiff_map(reference, test, PdiffSettings::default())?;
        Ok(Self { reference, test, ssim, flip, pdiff })
    }

    fn errors(&self, mask: Option<&[bool]>) -> Result<ImageErrors, MetricsError> {
        let selected = |mask: &[bool]| mask.iter().filter(|&&one| one).count();
        Ok(ImageErrors {
            pixels: mask.map_or(self.reference.pixel_count(), selected),
            psnr_db: psnr_db(self.reference, self.test, mask)?,
            ssim: self.ssim.as_ref().map_or(Ok(None), |map| map.mean(mask))?,
            flip: self.flip.mean(mask)?,
            pdiff_failing_px: self.pdiff.failing_px(mask)?,
            max_channel_difference: max_channel_difference(self.reference, self.test, mask)?,
        })
    }

    fn by_class(&self, classes: &[PixelClass]) -> Result<ClassErrors, MetricsError> {
        expect_len("classes", classes.len(), self.reference.pixel_count())?;
        let errors = |class| self.errors(Some(&class_mask(classes, class)));
        Ok(ClassErrors {
            silhouette: errors(PixelClass::Silhouette)?,
            disoccluded: errors(PixelClass::Disoccluded)?,
            covered: errors(PixelClass::Covered)?,
            background: errors(PixelClass::Background)?,
        })
    }
}

// serde hands the field over by reference.
fn capped_db<S: Serializer>(psnr_db: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    psnr_db.map(|db| db.min(PSNR_CAP_DB)).serialize(serializer)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pattern(shift: usize) -> Rgb8Image<'static> {
        let bytes = (0..24 * 16).flat_map(|i| {
            let (x, y) = ((i % 24 + shift) / 4, i / 24 / 4);
            [((x * 67 + y * 31) % 256) as u8, ((x * 151 + y * 83) % 256) as u8, ((x * 29 + y * 197) % 256) as u8]
        });
        Rgb8Image::new(24, 16, bytes.collect::<Vec<u8>>()).unwrap()
    }

    #[test]
    fn identical_is_perfect_and_serialises_without_null() {
        let comparison = compare(&pattern(0), &pattern(0), None).unwrap();
        assert_eq!(comparison.overall.psnr_db, Some(f64::INFINITY));
        assert_eq!((comparison.overall.flip, comparison.overall.pdiff_failing_px), (Some(0.0), 0));
        let json = serde_json::to_value(&comparison).unwrap();
        assert_eq!(json["overall"]["psnr_db"], 99.99);
        assert!(json["by_class"].is_null() && json.get("flip_map").is_none());
    }

    #[test]
    fn every_comparator_sees_a_shift_of_one_pixel() {
        let errors = compare(&pattern(0), &pattern(1), None).unwrap().overall;
        assert!(errors.psnr_db.unwrap() < 25.0, "{errors:?}");
        assert!(errors.ssim.unwrap() < 0.95, "{errors:?}");
        assert!(errors.flip.unwrap() > 0.02, "{errors:?}");
        assert!(errors.pdiff_failing_px > 20, "{errors:?}");
    }

    #[test]
    fn classes_add_up_and_an_empty_class_has_no_means() {
        let mut classes = vec![PixelClass::Covered; 24 * 16];
        classes[..100].fill(PixelClass::Silhouette);
        let comparison = compare(&pattern(0), &pattern(1), Some(&classes)).unwrap();
        let by_class = comparison.by_class.unwrap();
        assert_eq!((by_class.silhouette.pixels, by_class.covered.pixels), (100, 284));
        let failing = by_class.silhouette.pdiff_failing_px + by_class.covered.pdiff_failing_px;
        assert_eq!(failing, comparison.overall.pdiff_failing_px);
        let flip = (by_class.silhouette.flip.unwrap() * 100.0 + by_class.covered.flip.unwrap() * 284.0) / 384.0;
        assert!((flip - comparison.overall.flip.unwrap()).abs() < 1e-9);
        assert_eq!(
            (by_class.disoccluded.psnr_db, by_class.disoccluded.ssim, by_class.disoccluded.flip),
            (None, None, None)
        );
        assert!(serde_json::to_value(&comparison).unwrap()["by_class"]["background"]["psnr_db"].is_null());
    }

    #[test]
    fn an_image_below_the_window_has_no_ssim() {
        let small = Rgb8Image::new(3, 2, vec![5; 18]).unwrap();
        assert_eq!(compare(&small, &small, None).unwrap().overall.ssim, None);
    }

    #[test]
    fn sizes_must_agree() {
        let small = Rgb8Image::new(3, 2, vec![5; 18]).unwrap();
        assert!(compare(&small, &pattern(0), None).is_err());
        assert!(compare(&small, &small, Some(&[PixelClass::Covered])).is_err());
    }
}
