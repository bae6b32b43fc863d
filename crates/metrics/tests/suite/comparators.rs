//! All image metrics on one pair of patterns.

use metrics::{MetricsError, PdiffSettings, PixelClass, Rgb8Image, class_mask, flip_map, pdiff_map, psnr_db, ssim_map};

fn pattern(shift: usize) -> Rgb8Image<'static> {
    let bytes = (0..24 * 16).flat_map(|i| {
        let x = (i % 24 + shift) / 4;
        let y = i / 24 / 4;
        [((x * 67 + y * 31) % 256) as u8, ((x * 151 + y * 83) % 256) as u8, ((x * 29 + y * 197) % 256) as u8]
    });
    Rgb8Image::new(24, 16, bytes.collect::<Vec<u8>>()).unwrap()
}

#[test]
fn identical_is_perfect() {
    let image = pattern(0);
    assert_eq!(psnr_db(&image, &image, None).unwrap(), Some(f64::INFINITY));
    assert_eq!(flip_map(&image, &image).unwrap().mean(None).unwrap(), Some(0.0));
    assert_eq!(pdiff_map(&image, &image, PdiffSettings::default()).unwrap().failing_px(None).unwrap(), 0);
}

#[test]
fn every_comparator_sees_a_shift_of_one_pixel() {
    let reference = pattern(0);
    let test = pattern(1);
    assert!(psnr_db(&reference, &test, None).unwrap().unwrap() < 25.0);
    assert!(ssim_map(&reference, &test).unwrap().mean(None).unwrap().unwrap() < 0.95);
    assert!(flip_map(&reference, &test).unwrap().mean(None).unwrap().unwrap() > 0.02);
    assert!(pdiff_map(&reference, &test, PdiffSettings::default()).unwrap().failing_px(None).unwrap() > 20);
}

#[test]
fn classes_add_up_and_an_empty_class_has_no_means() {
    let mut classes = vec![PixelClass::Covered; 24 * 16];
    classes[..100].fill(PixelClass::Silhouette);
    let [silhouette, covered, none] =
        [PixelClass::Silhouette, PixelClass::Covered, PixelClass::Disoccluded].map(|class| class_mask(&classes, class));
    let reference = pattern(0);
    let test = pattern(1);
    let pdiff = pdiff_map(&reference, &test, PdiffSettings::default()).unwrap();
    let failing = |mask: Option<&[bool]>| pdiff.failing_px(mask).unwrap();
    assert_eq!(failing(Some(&silhouette)) + failing(Some(&covered)), failing(None));
    let map = flip_map(&reference, &test).unwrap();
    let flip = |mask: Option<&[bool]>| map.mean(mask).unwrap();
    let sum = flip(Some(&silhouette)).unwrap() * 100.0 + flip(Some(&covered)).unwrap() * 284.0;
    assert!((sum / 384.0 - flip(None).unwrap()).abs() < 1e-9);
    assert_eq!(flip(Some(&none)), None);
    assert_eq!(psnr_db(&reference, &test, Some(&none)).unwrap(), None);
    assert_eq!(ssim_map(&reference, &test).unwrap().mean(Some(&none)).unwrap(), None);
}

#[test]
fn sizes_must_agree() {
    let small = Rgb8Image::new(3, 2, vec![5; 18]).unwrap();
    let large = pattern(0);
    let differ = |error| matches!(error, MetricsError::SizesDiffer { .. });
    assert!(differ(psnr_db(&small, &large, None).unwrap_err()));
    assert!(differ(ssim_map(&small, &large).unwrap_err()));
    assert!(differ(flip_map(&small, &large).unwrap_err()));
    assert!(differ(pdiff_map(&small, &large, PdiffSettings::default()).unwrap_err()));
}
