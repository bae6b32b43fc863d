//! An environment map goes with the scene's package to every engine: views from samples show and mirror it as direct ones
//! do.

use std::f32::consts::PI;

use depth_image::{EnvironmentMap, PinholeCamera, View, ViewPlanes};
use fixtures::uv_sphere;
use glam::{UVec2, Vec3};
use node::{DirectWork, Engine, EngineError, SampleSet, Turn, ViewWork, WorkClass};
use scene::{Material, Scene, pack};

use crate::stage::{engine, sample_set};

const LIGHTING: &str = "soft 4";
const HASH: &str = "a ball under a map";

/// A metal ball in a map of broad stripes.
fn scene() -> Scene {
    let size_px = UVec2::new(128, 64);
    let wave = |i: u32, turns: f32| 0.5 + 0.5 * (2.0 * PI * turns * (i as f32 + 0.5)).sin();
    let texel = |i: u32| Vec3::new(wave(i % 128, 3.0 / 128.0), wave(i / 128, 2.0 / 64.0), 0.3);
    let radiances: Vec<Vec3> = (0..size_px.element_product()).map(texel).collect();
    let map = EnvironmentMap::new(size_px, &radiances).expect("a map");
    let mut scene = uv_sphere(1.0, 96).surrounded_by(map);
    scene.illumination.lights.clear();
    scene.materials[0] = Material { metallic: 1.0, roughness: 0.3, ..scene.materials[0].clone() };
    scene
}

fn camera(x: f32) -> PinholeCamera {
    PinholeCamera::looking_at(Vec3::new(x, 0.5, 3.0), Vec3::ZERO, Vec3::Y, 0.9, UVec2::new(96, 72))
}

fn from_samples(scene: &Scene) -> View {
    let turn = Turn::of(WorkClass::Batch);
    let cameras = [-0.4, -0.1, 0.2, 0.5].map(camera);
    let set = sample_set((HASH, scene), &cameras, LIGHTING);
    let elsewhere = SampleSet { scene_hash: "a scene elsewhere".to_owned(), ..set.clone() };
    let refused = engine().upload(&elsewhere, turn).err();
    assert_eq!(refused, Some(EngineError::UnknownScene { hash: elsewhere.scene_hash }));
    let set = engine().upload(&set, turn).expect("a set");
    let work =
        ViewWork { cameras: vec![camera(0.05)], method: "joint_carve".to_owned(), planes: ViewPlanes::WITH_DEPTH };
    engine().reconstruct(set.as_ref(), &work, turn).expect("a view").remove(0)
}

#[test]
fn a_view_from_samples_shows_and_mirrors_the_map_of_the_package() {
    let scene = scene();
    engine().load_scene(HASH, &pack(&scene)).expect("a scene");
    let view = from_samples(&scene);
    let direct = DirectWork {
        scene_hash: HASH.to_owned(),
        cameras: vec![camera(0.05)],
        lighting: LIGHTING.to_owned(),
        scene_time_s: 0.0,
        planes: ViewPlanes::WITH_DEPTH,
        surfaces_by_rays: None,
    };
    let direct = engine().draw_direct(&direct, Turn::of(WorkClass::Batch)).expect("a view").remove(0);
    let depths = view
        .inverse_depth_per_m
        .as_ref()
        .expect("depth")
        .iter()
        .zip(direct.inverse_depth_per_m.as_ref().expect("depth"));
    let mut open = 0;
    let mut surfaces = 0;
    let mut close = 0;
    for ((a, b), (here, there)) in view.srgb8.as_chunks::<3>().0.iter().zip(direct.srgb8.as_chunks::<3>().0).zip(depths)
    {
        let differs_by = (0..3).map(|i| a[i].abs_diff(b[i])).max().unwrap_or(0);
        if *here <= 0.0 && *there <= 0.0 {
            assert!(differs_by <= 1, "the background: {a:?} {b:?}");
            open += 1;
        } else if *here > 0.0 && *there > 0.0 {
            surfaces += 1;
            close += usize::from(differs_by <= 12);
        }
    }
    assert!(open > 1000 && surfaces > 1000, "{open} open, {surfaces} of surfaces");
    assert!(close * 20 > surfaces * 19, "{close} of {surfaces} pixels mirror the map");
}
