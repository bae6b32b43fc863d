//! Models of any size are shown at a size that can be drawn, and lead back to the coordinates of their file.

use glam::{DVec3, Vec3};
use scene::{Limits, Scene, SceneError, pack, unpack};

use crate::samples::{CUBE_CORNERS, CUBE_QUADS, cube, load, refusal, signed_volume};

/// A cube of this side in an OBJ file.
fn cube_of(side: f64, middle: DVec3) -> Result<Scene, SceneError> {
    let mut text = String::new();
    for corner in CUBE_CORNERS {
        let point = Vec3::from(corner).as_dvec3() * side + middle;
        text += &format!("v {:e} {:e} {:e}\n", point.x, point.y, point.z);
    }
    CUBE_QUADS.iter().for_each(|q| text += &format!("f {} {} {} {}\n", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1));
    load("cube.obj", text.as_bytes())
}

#[test]
fn cubes_from_a_picometre_to_a_gigametre_can_be_drawn() {
    for exponent in -12..=9 {
        let side = 10f64.powi(exponent);
        for middle in [DVec3::ZERO, DVec3::new(3.0, -2.0, 0.5) * side] {
            let scene = cube_of(side, middle).unwrap();
            let unit = scene.source_space.metres_per_unit;
            let size = f64::from(scene.bounds().size().x);
            assert!((1e-3..=1e6).contains(&size), "{side:e}: {size}");
            assert!((size - side * unit).abs() < 1e-5 * size, "{side:e}: {size}");
            let volume = f64::from(signed_volume(&scene));
            assert!((volume / size.powi(3) - 1.0).abs() < 1e-3, "{side:e}: {volume}");
            let found = scene.source_space.source_from_world(scene.bounds().center());
            assert!(found.distance(middle) < 1e-5 * side, "{side:e}: {found} for {middle}");
            assert_eq!(unpack(&pack(&scene), &Limits::default()).unwrap().source_space, scene.source_space);
        }
    }
}

#[test]
fn models_of_common_sizes_keep_their_metres() {
    for side in [0.01, 1.0, 500_000.0] {
        assert_eq!(cube_of(side, DVec3::ZERO).unwrap().source_space.metres_per_unit, 1.0);
    }
}

#[test]
fn lamps_and_cameras_are_scaled_with_their_scene() {
    let light = r#""extensionsUsed":["KHR_lights_punctual"],"extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":3}]}},
        "cameras":[{"type":"perspective","perspective":{"yfov":0.7,"znear":0.1}}],"#;
    let scene = |scale: f64| {
        let cube = cube(|c| {
            c.more = light.into();
            c.roots = "0,1,2".into();
            let at = |x: f64| format!(r#""translation":[{:e},0,0]"#, x * scale);
            c.nodes = format!(
                r#"{{"mesh":0,"scale":[{scale:e},{scale:e},{scale:e}]}},{{{},"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},{{{},"camera":0}}"#,
                at(3.0),
                at(-4.0)
            );
        });
        load("lit.glb", &cube.glb()).unwrap()
    };
    // The irradiance at the middle, in any unit: the lamp's intensity by the square of its distance.
    let exposed = |scene: &Scene| {
        let scene::Light::Point { position_in_world, intensity_linear, .. } = scene.illumination.lights[0] else {
            panic!()
        };
        intensity_linear / (position_in_world - scene.bounds().center()).length_squared()
    };
    let unscaled = exposed(&scene(1.0));
    for scale in [2f64.powi(-30), 2f64.powi(-12), 2f64.powi(25)] {
        let scene = scene(scale);
        assert!(exposed(&scene).distance(unscaled) < 1e-4, "{scale:e}: {} for {unscaled}", exposed(&scene));
        let unit = scene.source_space.metres_per_unit;
        let size = scale * unit;
        assert!(unit != 1.0 && scene.bounds().size().distance(Vec3::splat(size as f32)) < 1e-5);
        let scene::Light::Point { position_in_world, intensity_linear, .. } = scene.illumination.lights[0] else {
            panic!()
        };
        assert_eq!(position_in_world, Vec3::X * 3.0 * size as f32);
        assert!(intensity_linear.is_finite() && intensity_linear.min_element() > 0.0);
        let camera = scene.cameras[0].world_from_camera;
        assert_eq!(Vec3::from(camera.translation), Vec3::X * -4.0 * size as f32);
        assert!((camera.matrix3.determinant() - 1.0).abs() < 1e-5, "a camera has no size");
    }
}

#[test]
fn lamps_of_the_command_line_are_in_the_units_of_the_file() {
    let scene = cube_of(1e-9, DVec3::ZERO).unwrap();
    let unit = scene.source_space.metres_per_unit;
    let lamp = scene::Light::Point {
        position_in_world: Vec3::new(0.0, 2e-9, 0.0),
        intensity_linear: Vec3::splat(4e-18),
        radius_m: 1e-10,
    };
    let lit = scene.lit_by(Some(vec![lamp]), None);
    let scene::Light::Point { position_in_world, intensity_linear, radius_m } = lit.illumination.lights[0] else {
        panic!()
    };
    // The cube's top is lit as that of a cube of 1 m by a lamp of 4 at 2 m.
    let distance = f64::from(position_in_world.y);
    assert!((f64::from(intensity_linear.x) / (distance * distance) - 1.0).abs() < 1e-5);
    assert!((distance - 2e-9 * unit).abs() < 1e-6 && (f64::from(radius_m) / distance - 0.05).abs() < 1e-6);
}

#[test]
fn models_without_extent_or_beyond_all_sizes_are_refused() {
    assert!(refusal("point.obj", b"v 2 3 4\nv 2 3 4\nv 2 3 4\nf 1 2 3\n").contains("it has no extent"));
    assert!(refusal("far.obj", b"v 0 0 0\nv 1e200 0 0\nv 0 1e200 0\nf 1 2 3\n").contains("extent"));
}
