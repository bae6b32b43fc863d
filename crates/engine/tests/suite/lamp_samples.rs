//! Light of a grid on a rectangle, asked of samples of what the rectangle sees.

use depth_image::{Illumination, Light, PinholeCamera, View, ViewPlanes};
use engine::{GpuEngine, LampSampling};
use glam::{UVec2, Vec3};
use node::{DirectWork, Engine, EngineError, Turn, WorkClass};
use scene::Scene;
use scene::procedural::tree_terrain;

use crate::stage::engine;

const HASH: &str = "trees under a rectangle";

/// Trees under a square lamp.
fn scene() -> Scene {
    let scene = tree_terrain(30_000, 1);
    let bounds = scene.bounds();
    let diagonal_m = bounds.size().length();
    let lamp = Light::Rectangle {
        center_in_world: bounds.center() + Vec3::Y * diagonal_m,
        half_edges_in_world: [Vec3::X * 0.3 * diagonal_m, Vec3::Z * 0.3 * diagonal_m],
        radiance_linear: Vec3::splat(3.0),
    };
    Scene { illumination: Illumination { lights: vec![lamp], ..Illumination::default() }, ..scene }
}

fn camera(scene: &Scene) -> PinholeCamera {
    let bounds = scene.bounds();
    let eye = bounds.center() + bounds.size() * Vec3::new(0.2, 2.0, 0.3);
    PinholeCamera::looking_at(eye, bounds.center(), Vec3::Y, 0.8, UVec2::new(96, 72))
}

fn drawn(engine: &GpuEngine, hash: &str, camera: PinholeCamera, lighting: &str) -> Result<View, EngineError> {
    let work = DirectWork {
        scene_hash: hash.to_owned(),
        cameras: vec![camera],
        lighting: lighting.to_owned(),
        scene_time_s: 0.0,
        planes: ViewPlanes::WITH_DEPTH,
        surfaces_by_rays: Some(true),
    };
    engine.draw_direct(&work, Turn::of(WorkClass::Batch)).map(|mut views| views.remove(0))
}

fn differing_share(a: &View, b: &View) -> f64 {
    let differ = a.srgb8.iter().zip(&b.srgb8).filter(|(a, b)| a.abs_diff(**b) > 12).count();
    differ as f64 / a.srgb8.len() as f64
}

#[test]
fn samples_of_a_lamp_cast_nearly_the_shadows_of_the_scene() {
    let scene = scene();
    engine().put_scene(HASH, &scene).expect("a scene");
    let camera = camera(&scene);
    let view = |lighting: &str| drawn(engine(), HASH, camera, lighting).expect(lighting);
    let rays = view("soft 4x4");
    let shadows = differing_share(&rays, &view("phong"));
    assert!(shadows > 0.1, "{shadows}");
    engine().set_lamp_sampling("conventional 512 mesh".parse().expect("a name"));
    let by_maps = differing_share(&rays, &view("soft 4x4 by maps"));
    assert!(by_maps < 0.3 * shadows, "{by_maps} of {shadows}");
    let mut before = None;
    for sampling in
        ["non_redundant:pixel 512 hybrid_mesh:0.5", "conventional 512 mesh", "depth_peeling:4 512 hybrid_mesh"]
    {
        engine().set_lamp_sampling(sampling.parse().expect(sampling));
        let by_samples = view("soft 4x4 by samples");
        let share = differing_share(&rays, &by_samples);
        assert!(share < 0.5 * shadows, "{sampling}: {share} of {shadows}");
        assert!(by_samples == view("soft 4x4 by samples"), "{sampling}: the second view has the same samples");
        assert!(before.replace(by_samples.clone()) != Some(by_samples), "{sampling}: samples of its own");
    }
    engine().set_lamp_sampling("conventional 256 mesh".parse().expect("a name"));
    let by_cube = view("soft 4x4 by cube");
    let share = differing_share(&rays, &by_cube);
    assert!(share < 0.3 * shadows, "a cube: {share} of {shadows}");
    assert!(by_cube == view("soft 4x4 by cube"), "the second view has the same cube");
    engine().set_lamp_sampling(LampSampling::default());
}

/// A cube knows what any lamp sees: here a sphere and parallel light, too.
#[test]
fn a_cube_answers_for_lamps_of_all_kinds() {
    let mut scene = scene();
    let bounds = scene.bounds();
    scene.illumination.lights = vec![
        Light::Point {
            position_in_world: bounds.center() + Vec3::Y * bounds.size().length(),
            intensity_linear: Vec3::splat(bounds.size().length_squared()),
            radius_m: 0.1 * bounds.size().length(),
        },
        Light::Directional {
            towards_light_in_world: Vec3::new(0.6, 0.8, 0.0),
            irradiance_linear: Vec3::ONE,
            angular_radius_rad: 0.05,
        },
    ];
    engine().put_scene("trees under a sphere and the sun", &scene).expect("a scene");
    let view =
        |lighting: &str| drawn(engine(), "trees under a sphere and the sun", camera(&scene), lighting).expect(lighting);
    let rays = view("soft 4x4");
    let shadows = differing_share(&rays, &view("phong"));
    let share = differing_share(&rays, &view("soft 4x4 by cube"));
    assert!(shadows > 0.1 && share < 0.3 * shadows, "{share} of {shadows}");
}

#[test]
fn a_scene_without_a_rectangle_is_refused_with_the_reason() {
    let scene = fixtures::blocks();
    engine().put_scene("blocks without a rectangle", &scene).expect("a scene");
    let refused = drawn(engine(), "blocks without a rectangle", camera(&scene), "soft 4x4 by samples");
    let Err(EngineError::InvalidArgument { field, reason }) = refused else { panic!("it is drawn") };
    assert_eq!(field, "lighting");
    assert!(reason.contains("rectangle light"), "{reason}");
}

#[test]
fn a_scene_with_too_many_rectangles_is_refused_with_their_number() {
    let mut scene = scene();
    scene.illumination.lights = vec![scene.illumination.lights[0]; 9];
    engine().put_scene("nine rectangles", &scene).expect("a scene");
    let refused = drawn(engine(), "nine rectangles", camera(&scene), "soft 4x4 by samples");
    assert!(
        matches!(&refused, Err(EngineError::InvalidArgument { field: "lighting", reason }) if reason.contains("has 9"))
    );
    drawn(engine(), "nine rectangles", camera(&scene), "soft 2x2 by maps").expect("maps are drawn one after the other");
}
