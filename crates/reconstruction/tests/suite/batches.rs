//! Many views in one call, and requests that are refused.

use depth_image::{Aabb, CameraError, LightPlanes, PinholeCamera, ViewPlanes};
use fixtures::uv_sphere;
use glam::{UVec2, Vec3};
use gpu::Turn;
use reconstruction::ReconstructionError;

use crate::stage::{CARVE, Corners, SEARCH, Stage, reconstruct, reconstructor};

fn corners() -> Corners {
    Corners { eye: Vec3::new(0.4, 0.9, 3.6), target: Vec3::ZERO, half_m: 0.6 }
}

fn stage() -> Stage {
    Stage::new(uv_sphere(1.0, 24), &corners().samples(2))
}

#[test]
fn seventy_views_are_seventy_single_views() {
    let set = stage().upload();
    let cameras: Vec<_> = (0..70)
        .map(|i| corners().camera(i as f32 / 35.0 - 1.0, (i % 7) as f32 / 3.5 - 1.0, UVec2::new(33, 21)))
        .collect();
    for method in [CARVE, SEARCH] {
        let all = reconstruct(&set, &cameras, method, ViewPlanes::ALL).expect("views");
        assert_eq!(all.len(), 70);
        for (index, (camera, view)) in cameras.iter().zip(&all).enumerate() {
            let single = reconstruct(&set, &[*camera], method, ViewPlanes::ALL).expect("a view");
            assert!(single[0] == *view, "{method}: view {index} differs");
        }
    }
}

#[test]
fn sizes_may_change_from_view_to_view() {
    let set = stage().upload();
    let sizes = [[64, 48], [64, 48], [31, 17], [1, 1], [64, 48], [8, 100]].map(UVec2::from);
    let cameras = sizes.map(|size_px| corners().camera(0.1, 0.2, size_px));
    let views = reconstruct(&set, &cameras, CARVE, ViewPlanes::ALL).expect("views");
    assert_eq!(views.iter().map(|view| view.size_px).collect::<Vec<_>>(), sizes);
    assert!(views[0] == views[1] && views[0] == views[4], "the same camera, the same view");
    for (camera, view) in cameras.iter().zip(&views) {
        assert!(reconstruct(&set, &[*camera], CARVE, ViewPlanes::ALL).expect("a view")[0] == *view);
    }
}

/// Its textures are those of the set before.
#[test]
fn a_set_shows_nothing_of_the_one_before_it() {
    let camera = corners().camera(0.2, -0.3, UVec2::new(64, 48));
    let small = Stage::new(uv_sphere(0.5, 12), &corners().samples(2));
    let large = stage();
    let alone = |stage: &Stage| stage.view(&camera, CARVE);
    let small_view = alone(&small);
    let large_view = alone(&large);
    assert!(small_view != large_view);
    for _ in 0..4 {
        for (stage, view) in [(&small, &small_view), (&large, &large_view)] {
            let set = stage.upload();
            let views = reconstruct(&set, &[camera], CARVE, ViewPlanes::ALL).expect("a view");
            assert!(views[0] == *view);
        }
    }
}

/// Its textures are filled another way than those of small ones.
#[test]
fn images_of_four_million_samples_are_seen_as_they_are() {
    let sample = corners().camera(0.0, 0.0, UVec2::splat(2100));
    let stage = Stage::new(uv_sphere(1.0, 24), &[sample]);
    let camera = corners().camera(0.1, 0.05, UVec2::new(32, 24));
    let view = stage.view(&camera, CARVE);
    let twin = stage.twin(&camera, CARVE);
    let differ = view.srgb8.iter().zip(&twin.srgb8).filter(|(a, b)| a.abs_diff(**b) > 2).count();
    assert!(differ * 100 <= view.srgb8.len(), "{differ} of {}", view.srgb8.len());
    assert!(view.srgb8.iter().any(|&value| value > 30), "something is seen");
}

#[test]
fn no_views_are_no_views() {
    let set = stage().upload();
    assert!(reconstruct(&set, &[], CARVE, ViewPlanes::ALL).expect("nothing").is_empty());
}

/// The error of an upload that must fail.
fn refused(stage: &Stage) -> ReconstructionError {
    let done = reconstructor().upload(&stage.images, &stage.description(), Turn::default());
    done.err().expect("an error")
}

/// An image with light in place of colour serves no method that shows the colour of samples.
fn assert_light_is_refused(good: &Stage) {
    let mut lit = good.clone();
    let image = &mut lit.images[1];
    let texels = std::mem::take(&mut image.color_rgb9e5).len();
    image.specular = None;
    image.corner_inverse_depth_per_m = None;
    image.normal_oct16 = Some(vec![0; texels]);
    image.light = Some(LightPlanes {
        triangle_normal_oct16: vec![0; texels],
        lamps_rgb9e5: vec![0; texels],
        environment_rgb9e5: vec![0; texels],
        share8: Vec::new(),
    });
    assert_eq!(image.validate(), Ok(()));
    let error = refused(&lit);
    assert!(matches!(error, ReconstructionError::LightForColor { index: 1 }), "{error}");
    assert!(error.to_string().contains("image 1 has light where colour is needed"), "{error}");
}

#[test]
fn sets_that_cannot_be_used_are_refused() {
    let good = stage();
    let of = |count: usize| Stage { images: vec![good.images[0].clone(); count], ..good.clone() };
    assert!(reconstructor().upload(&of(16).images, &good.description(), Turn::default()).is_ok());
    assert!(matches!(refused(&of(17)), ReconstructionError::SampleCount(17)));
    assert!(matches!(refused(&of(0)), ReconstructionError::SampleCount(0)));
    let mut short = good.clone();
    short.images[1].inverse_depth_per_m.pop();
    assert!(matches!(refused(&short), ReconstructionError::Sample { index: 1, .. }));
    assert_light_is_refused(&good);
    let mut nowhere = good.clone();
    let eye_in_world = Vec3::NAN;
    nowhere.images[0].camera = PinholeCamera { eye_in_world, ..*good.images[0].camera.reference() }.into();
    assert!(matches!(refused(&nowhere), ReconstructionError::Sample { index: 0, .. }));
    for volume in [Aabb::EMPTY, Aabb { min: Vec3::NAN, max: Vec3::NAN }, Aabb { min: Vec3::ZERO, max: Vec3::INFINITY }]
    {
        assert!(matches!(refused(&Stage { volume, ..good.clone() }), ReconstructionError::Volume), "{volume:?}");
    }
}

#[test]
fn a_bad_view_camera_is_named() {
    let set = stage().upload();
    let good = corners().view();
    let bad = PinholeCamera { eye_in_world: Vec3::NAN, ..good };
    let error = reconstruct(&set, &[good, bad], CARVE, ViewPlanes::ALL).expect_err("NaN");
    let named = matches!(error, ReconstructionError::Camera { index: 1, source: CameraError::NotFinite { .. } });
    assert!(named, "{error}");
}
