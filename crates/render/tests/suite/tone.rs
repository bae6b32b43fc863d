//! Exposure and tone curve of direct views: closed forms of a uniform background, and of each pixel's own light.

use depth_image::{
    Antialias, Environment, ExposureEv, PinholeCamera, ToneCurve, ToneMapping, View, ViewPlanes, linear_from_srgb8,
};
use fixtures::poles;
use glam::{UVec2, Vec3};
use render::GpuScene;

use crate::stage::{device, upload, work};

fn tone(ev: f32, curve: ToneCurve) -> ToneMapping {
    ToneMapping { exposure: ExposureEv::new(ev).expect("within the limits"), curve }
}

fn drawn(scene: &GpuScene, planes: ViewPlanes) -> View {
    drawn_towards(scene, Vec3::NEG_Z, planes)
}

fn drawn_towards(scene: &GpuScene, target_in_world: Vec3, planes: ViewPlanes) -> View {
    let size_px = UVec2::new(64, 48);
    let camera = PinholeCamera::looking_at(Vec3::new(0.3, 0.4, 4.0), target_in_world, Vec3::Y, 0.8, size_px);
    device().1.draw_views(work(scene, "phong"), &[camera], planes).expect("a view").remove(0)
}

#[test]
fn the_background_is_shown_as_the_curve_says() {
    let linear = Vec3::new(6.0, 0.7, 0.1);
    let mut scene = poles(0.08);
    scene.background = Environment::uniform(linear);
    let scene = upload(&scene);
    for (ev, curve) in [(0.0, ToneCurve::None), (-3.0, ToneCurve::None), (0.0, ToneCurve::KhronosNeutral)] {
        let tone = tone(ev, curve);
        for antialias in [Antialias::NONE, Antialias::MOST] {
            // Away from the scene.
            let view = drawn_towards(&scene, Vec3::Z * 90.0, ViewPlanes { antialias, tone, ..ViewPlanes::COLOR });
            let expected = tone.srgb8(linear);
            for shown in view.srgb8.chunks_exact(3) {
                let off = shown.iter().zip(expected).map(|(a, b)| a.abs_diff(b)).max();
                assert!(off <= Some(1), "{tone:?}, {antialias} samples: {shown:?}, not {expected:?}");
            }
        }
    }
}

#[test]
fn surfaces_are_shown_as_the_curve_says() {
    let scene = upload(&poles(0.08));
    let planes = |tone| ViewPlanes { tone, ..ViewPlanes::ALL };
    let plain = drawn(&scene, planes(ToneMapping::NONE));
    let dark = drawn(&scene, planes(tone(-1.0, ToneCurve::None)));
    assert_eq!(plain, drawn(&scene, ViewPlanes::ALL), "no tone changes no bit");
    let neutral = drawn(&scene, planes(tone(0.0, ToneCurve::KhronosNeutral)));
    assert_eq!(plain.inverse_depth_per_m, neutral.inverse_depth_per_m);
    for ((plain, dark), mapped) in
        plain.srgb8.chunks_exact(3).zip(dark.srgb8.chunks_exact(3)).zip(neutral.srgb8.chunks_exact(3))
    {
        let linear = Vec3::from([0, 1, 2].map(|channel| linear_from_srgb8(plain[channel])));
        let expected = tone(0.0, ToneCurve::KhronosNeutral).shown_linear(linear);
        for channel in (0..3).filter(|_| !plain.contains(&255)) {
            let half = linear_from_srgb8(dark[channel]);
            assert!((2.0 * half - linear[channel]).abs() < 0.012, "{plain:?}: half is {dark:?}");
            let shown = linear_from_srgb8(mapped[channel]);
            assert!((shown - expected[channel]).abs() < 0.012, "{plain:?} becomes {mapped:?}, not {expected}");
        }
    }
}
