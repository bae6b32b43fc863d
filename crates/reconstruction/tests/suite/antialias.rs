//! Several samples a pixel: their mean in linear light, whatever the method.

use depth_image::{Antialias, Environment, Illumination, View, ViewPlanes, linear_from_srgb8};
use glam::{Vec2, Vec3};
use gpu::Turn;
use reconstruction::{ReconstructionMethod, SampleSet, SetDescription, scalar};

use crate::stage::{CARVE, SEARCH, Stage, corpus, reconstruct, reconstructor};

const HYBRID: ReconstructionMethod = ReconstructionMethod::HybridMesh { merged: None };

fn four() -> Antialias {
    Antialias::of(4).expect("offered")
}

fn drawn(
    set: &SampleSet,
    camera: depth_image::PinholeCamera,
    method: ReconstructionMethod,
    planes: ViewPlanes,
) -> View {
    reconstruct(set, &[camera], method, planes).expect("a view").remove(0)
}

/// Mean absolute difference of bytes.
fn difference(a: &View, b: &View) -> f64 {
    let sum: u64 = a.srgb8.iter().zip(&b.srgb8).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / a.srgb8.len() as f64
}

/// The mean in linear light of whole reconstructions, each of one position.
fn mean_of_whole(set: &SampleSet, camera: &depth_image::PinholeCamera, method: ReconstructionMethod) -> Vec<f32> {
    let shifted = |offset: Vec2| drawn(set, camera.with_offset(offset), method, ViewPlanes::COLOR);
    let views: Vec<View> = four().offsets_px().map(shifted).collect();
    let mean = |byte: usize| views.iter().map(|view| linear_from_srgb8(view.srgb8[byte])).sum::<f32>() / 4.0;
    (0..views[0].srgb8.len()).map(mean).collect()
}

#[test]
fn a_pixel_is_the_mean_of_its_positions_in_linear_light() {
    let planes = ViewPlanes { antialias: four(), ..ViewPlanes::ALL };
    for (name, scene, corners) in corpus() {
        let stage = Stage::with_corners(scene, &corners.samples(4));
        let set = stage.upload();
        let camera = corners.view();
        for method in [CARVE, SEARCH, HYBRID] {
            let smooth = drawn(&set, camera, method, planes);
            let means = mean_of_whole(&set, &camera, method);
            let off = smooth.srgb8.iter().zip(&means).map(|(&byte, mean)| (linear_from_srgb8(byte) - mean).abs());
            // Whole reconstructions have tile starts of their own, with which a ray may end a rounding apart. Where the first
            // position found a smooth surface, the others continue it.
            let apart = off.filter(|&off| off > 0.006).count();
            assert!(apart * 100 <= means.len(), "{name}, {method}: {apart} of {} bytes", means.len());
            let plain = drawn(&set, camera, method, ViewPlanes::ALL);
            assert_eq!(smooth.inverse_depth_per_m, plain.inverse_depth_per_m, "{name}, {method}");
            assert_eq!(smooth.provenance, plain.provenance, "{name}, {method}");
            assert!(name == "quad" || difference(&smooth, &plain) > 0.2, "{name}, {method}: nothing changes");
        }
    }
}

#[test]
fn views_with_several_positions_are_their_twins() {
    for (name, scene, corners) in corpus() {
        let stage = Stage::new(scene, &corners.samples(4));
        let camera = corners.view();
        for samples in [2, 4] {
            let antialias = Antialias::of(samples).expect("offered");
            let planes = ViewPlanes { antialias, ..ViewPlanes::COLOR };
            let view = drawn(&stage.upload(), camera, CARVE, planes);
            let description = stage.description();
            let twin = scalar::reconstruct_shown(&stage.images, &description, &camera, CARVE, planes);
            let off = difference(&view, &twin);
            assert!(off < 0.25, "{name}, {samples} samples: {off}");
        }
    }
}

/// The half of a pixel that shows a bright background and the half that shows a dark surface add up in linear light, whose
/// sRGB is lighter than the mean of both bytes.
#[test]
fn a_silhouette_is_between_the_surface_and_the_background() {
    let (_, mut scene, corners) = corpus().swap_remove(3);
    scene.background = Environment::uniform(Vec3::ONE);
    let stage = Stage::new(scene, &corners.samples(4));
    let planes = ViewPlanes { antialias: Antialias::MOST, ..ViewPlanes::COLOR };
    let view = drawn(&stage.upload(), corners.view(), CARVE, planes);
    let blues: std::collections::BTreeSet<u8> = view.srgb8.chunks(3).map(|rgb| rgb[2]).collect();
    assert!(blues.len() > 6 && blues.last() == Some(&255), "{blues:?}");
}

/// Highlights are brighter than the picture shows: they count at their full height until the mean is taken.
#[test]
fn light_beyond_white_counts_in_the_mean() {
    let (_, scene, corners) = corpus().swap_remove(3);
    let mut stage = Stage::new(scene, &corners.samples(4));
    for image in &mut stage.images {
        image.color_rgb9e5.iter_mut().for_each(|color| *color = depth_image::rgb9e5_from_linear(Vec3::splat(8.0)));
    }
    let dark = Illumination { lights: Vec::new(), environment: Environment::uniform(Vec3::ZERO) };
    let description = SetDescription {
        volume: stage.volume,
        background: Environment::uniform(Vec3::ZERO),
        illumination: &dark,
        highlight: None,
        environment: None,
        mips: false,
    };
    let set = reconstructor().upload(&stage.images, &description, Turn::default()).expect("a set");
    let planes = ViewPlanes { antialias: Antialias::MOST, ..ViewPlanes::COLOR };
    let view = drawn(&set, corners.view(), CARVE, planes);
    // A sixteenth of a pixel is half of white: 188 of 255. Were colours cut off at white first, it would be 71.
    let lit = view.srgb8.chunks(3).map(|rgb| rgb[0]).filter(|&red| red > 0);
    let darkest = lit.min().expect("a surface");
    let white = view.srgb8.chunks(3).filter(|rgb| rgb[0] == 255).count();
    assert!(white > 100 && (180..255).contains(&darkest), "{white} white, the darkest {darkest}");
}
