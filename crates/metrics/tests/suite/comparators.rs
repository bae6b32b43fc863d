//! All image metrics on one pair of patterns.

use depth_image::View;
use glam::UVec2;
use metrics::{MetricsError, flip_map, pdiff_map, psnr_db, ssim_map};

fn pattern(shift: usize) -> View {
    let bytes = (0..24 * 16).flat_map(|i| {
        let x = (i % 24 + shift) / 4;
        let y = i / 24 / 4;
        [((x * 67 + y * 31) % 256) as u8, ((x * 151 + y * 83) % 256) as u8, ((x * 29 + y * 197) % 256) as u8]
    });
    View::from_srgb8(UVec2::new(24, 16), bytes.collect())
}

#[test]
fn identical_is_perfect() {
    let image = pattern(0);
    assert_eq!(psnr_db(&image, &image, None).unwrap(), Some(f64::INFINITY));
    assert_eq!(flip_map(&image, &image).unwrap().mean(None).unwrap(), Some(0.0));
    assert!(!pdiff_map(&image, &image).unwrap().contains(&true));
}

#[test]
fn every_comparator_sees_a_shift_of_one_pixel() {
    let reference = pattern(0);
    let test = pattern(1);
    assert!(psnr_db(&reference, &test, None).unwrap().unwrap() < 25.0);
    assert!(ssim_map(&reference, &test).unwrap().mean(None).unwrap().unwrap() < 0.95);
    assert!(flip_map(&reference, &test).unwrap().mean(None).unwrap().unwrap() > 0.02);
    assert!(pdiff_map(&reference, &test).unwrap().into_iter().filter(|&fails| fails).count() > 20);
}

#[test]
fn masks_add_up_and_an_empty_mask_has_no_means() {
    let [upper, lower, none] = [0..100, 100..24 * 16, 0..0].map(|pixels| {
        let mut mask = vec![false; 24 * 16];
        mask[pixels].fill(true);
        mask
    });
    let reference = pattern(0);
    let test = pattern(1);
    let map = flip_map(&reference, &test).unwrap();
    let flip = |mask: Option<&[bool]>| map.mean(mask).unwrap();
    let sum = flip(Some(&upper)).unwrap() * 100.0 + flip(Some(&lower)).unwrap() * 284.0;
    assert!((sum / 384.0 - flip(None).unwrap()).abs() < 1e-9);
    assert_eq!(flip(Some(&none)), None);
    assert_eq!(psnr_db(&reference, &test, Some(&none)).unwrap(), None);
    assert_eq!(ssim_map(&reference, &test).unwrap().mean(Some(&none)).unwrap(), None);
}

#[test]
fn sizes_must_agree() {
    let small = View::from_srgb8(UVec2::new(3, 2), vec![5; 18]);
    let large = pattern(0);
    let differ = |error| matches!(error, MetricsError::SizesDiffer { .. });
    assert!(differ(psnr_db(&small, &large, None).unwrap_err()));
    assert!(differ(ssim_map(&small, &large).unwrap_err()));
    assert!(differ(flip_map(&small, &large).unwrap_err()));
    assert!(differ(pdiff_map(&small, &large).unwrap_err()));
}
