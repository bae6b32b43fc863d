//! Exposure and tone curve of reconstructed views, as their twins show them.

use depth_image::{Antialias, ExposureEv, ToneCurve, ToneMapping, View, ViewPlanes, linear_from_srgb8};
use glam::Vec3;
use reconstruction::scalar;

use crate::stage::{CARVE, Stage, corpus, reconstruct};

fn tone(ev: f32, curve: ToneCurve) -> ToneMapping {
    ToneMapping { exposure: ExposureEv::new(ev).expect("within the limits"), curve }
}

/// The share of bytes that are more than one code apart.
fn apart(a: &View, b: &View) -> f64 {
    let count = a.srgb8.iter().zip(&b.srgb8).filter(|(a, b)| a.abs_diff(**b) > 1).count();
    count as f64 / a.srgb8.len() as f64
}

#[test]
fn views_in_every_tone_are_their_twins() {
    let (name, scene, corners) = corpus().swap_remove(3);
    let stage = Stage::new(scene, &corners.samples(4));
    let set = stage.upload();
    let camera = corners.view();
    let reconstruct = |planes| reconstruct(&set, &[camera], CARVE, planes).expect("a view").remove(0);
    let four = Antialias::of(4).expect("offered");
    let tones =
        [tone(-2.0, ToneCurve::None), tone(0.0, ToneCurve::KhronosNeutral), tone(3.0, ToneCurve::KhronosNeutral)];
    let plain = reconstruct(ViewPlanes::ALL);
    for (antialias, tone) in [Antialias::NONE, four].into_iter().flat_map(|n| tones.map(|tone| (n, tone))) {
        let planes = ViewPlanes { antialias, tone, ..ViewPlanes::ALL };
        let view = reconstruct(planes);
        let twin = scalar::reconstruct_shown(&stage.images, &stage.description(), &camera, CARVE, planes);
        let off = apart(&view, &twin);
        assert!(off < 0.01, "{name}, {antialias} samples, {tone:?}: {off}");
        assert_ne!(view.srgb8, plain.srgb8, "{antialias} samples, {tone:?}: nothing changes");
        assert_eq!(view.inverse_depth_per_m, plain.inverse_depth_per_m);
        assert_eq!(view.provenance, plain.provenance);
    }
}

/// Both tones are of one uploaded set, and each is the other's light under its own curve.
#[test]
fn a_tone_is_applied_to_the_pixel_and_changes_no_sample() {
    let (_, scene, corners) = corpus().swap_remove(3);
    let stage = Stage::new(scene, &corners.samples(4));
    let set = stage.upload();
    let shown = |tone| {
        let planes = ViewPlanes { tone, ..ViewPlanes::COLOR };
        reconstruct(&set, &[corners.view()], CARVE, planes).expect("a view").remove(0)
    };
    let before = shown(ToneMapping::NONE);
    let neutral = shown(tone(0.0, ToneCurve::KhronosNeutral));
    assert_eq!(before.srgb8, shown(ToneMapping::NONE).srgb8, "the set keeps no tone");
    for (plain, mapped) in before.srgb8.chunks_exact(3).zip(neutral.srgb8.chunks_exact(3)) {
        if plain.contains(&255) {
            continue;
        }
        let linear = Vec3::new(linear_from_srgb8(plain[0]), linear_from_srgb8(plain[1]), linear_from_srgb8(plain[2]));
        let expected = tone(0.0, ToneCurve::KhronosNeutral).shown_linear(linear);
        for (channel, &byte) in mapped.iter().enumerate() {
            assert!((linear_from_srgb8(byte) - expected[channel]).abs() < 0.012, "{plain:?} becomes {mapped:?}");
        }
    }
}
