//! PSNR, SSIM and FLIP against independent implementations: scikit-image 0.26.0 and flip-evaluator 1.7.
//! `reference_values.py` beside this file printed the table.

mod pairs;

use depth_image::View;
use glam::UVec2;
use metrics::{flip_map, psnr_db, ssim_map};
use pairs::Pair;

struct Expected {
    name: &'static str,
    psnr_db: f64,
    ssim: f64,
    flip: f64,
    /// FLIP of the pixel in row height / 2, column width / 3.
    flip_at_third: f32,
}

#[rustfmt::skip]
const EXPECTED: [Expected; 6] = [
    Expected { name: "noise", psnr_db: 25.315014632117983, ssim: 0.46309392668567523, flip: 0.10903803259134293, flip_at_third: 0.095_162_46 },
    Expected { name: "blur", psnr_db: 16.26612738810332, ssim: 0.7453687248200667, flip: 0.28516650199890137, flip_at_third: 0.006_973_51 },
    Expected { name: "shift", psnr_db: 23.71597389364605, ssim: 0.9641232823331874, flip: 0.06785418093204498, flip_at_third: 0.048_819_13 },
    Expected { name: "block", psnr_db: 18.699359271012078, ssim: 0.8397483139393517, flip: 0.12906299531459808, flip_at_third: 0.956_134_7 },
    Expected { name: "colour", psnr_db: 9.8065497649561, ssim: 0.5422943079999532, flip: 0.730891227722168, flip_at_third: 0.472_231_5 },
    Expected { name: "step", psnr_db: 48.141771317933255, ssim: 0.9994636693173401, flip: 0.037994664162397385, flip_at_third: 0.035_729_1 },
];

fn images(pair: &Pair) -> [View; 2] {
    let size_px = UVec2::new(pair.width as u32, pair.height as u32);
    [&pair.reference, &pair.test].map(|pixels| View::from_srgb8(size_px, pixels.clone()))
}

fn for_each_pair(check: impl Fn(&Expected, [View; 2])) {
    let pairs = pairs::all();
    assert_eq!(pairs.len(), EXPECTED.len());
    for (pair, expected) in pairs.iter().zip(&EXPECTED) {
        assert_eq!(pair.name, expected.name);
        check(expected, images(pair));
    }
}

fn expect_near(what: &str, expected: &Expected, found: f64, value: f64, tolerance: f64) {
    assert!((found - value).abs() <= tolerance, "{what} of {}: {found}, elsewhere {value}", expected.name);
}

#[test]
fn psnr_agrees() {
    for_each_pair(|expected, [reference, test]| {
        let found = psnr_db(&reference, &test, None).unwrap().unwrap();
        expect_near("PSNR", expected, found, expected.psnr_db, 1e-9);
    });
}

#[test]
fn ssim_agrees() {
    for_each_pair(|expected, [reference, test]| {
        let found = ssim_map(&reference, &test).unwrap().mean(None).unwrap().unwrap();
        expect_near("SSIM", expected, found, expected.ssim, 1e-7);
    });
}

#[test]
fn flip_agrees() {
    for_each_pair(|expected, [reference, test]| {
        let map = flip_map(&reference, &test).unwrap();
        expect_near("FLIP", expected, map.mean(None).unwrap().unwrap(), expected.flip, 2e-5);
        let at = map.values.len() / 2 + reference.size_px.x as usize / 3;
        expect_near("FLIP at a pixel", expected, f64::from(map.values[at]), f64::from(expected.flip_at_third), 1e-4);
    });
}
