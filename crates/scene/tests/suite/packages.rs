//! Packages, and procedural scenes.

use fixtures::{checker_sphere, poles, quad, unit_cube, uv_sphere};
use glam::{UVec2, Vec3};
use scene::procedural::{courtyard, tree_terrain};
use scene::{
    Environment, EnvironmentMap, Illumination, Light, LightSpec, Limits, Scene, SceneErrorKind, Texture, TextureUse,
    VertexDetail, Wrap, pack, unpack,
};

use crate::samples::{signed_volume, world_triangles};

#[test]
fn packing_is_deterministic_and_loses_nothing() {
    for make in [unit_cube, checker_sphere, courtyard, || tree_terrain(10_000, 1).with_wind()] {
        let package = pack(&make());
        let again = pack(&make());
        assert!(package == again);
        assert_eq!(unpack(&package, &Limits::default()).unwrap(), make());
    }
    assert!(pack(&tree_terrain(10_000, 1)) != pack(&tree_terrain(10_000, 2)));
    let map = EnvironmentMap::from_texels(UVec2::new(4, 2), (0..8).collect()).unwrap();
    let mapped = unit_cube().surrounded_by(map);
    assert_eq!(unpack(&pack(&mapped), &Limits::default()).unwrap(), mapped);
    let package = pack(&mapped);
    assert!(unpack(&package[..package.len() - 1], &Limits::default()).is_err(), "a texel is cut");
}

#[test]
fn an_invalid_scene_is_not_unpacked() {
    let broken: [fn(&mut Scene); 24] = [
        |s| s.meshes[0].indices[0] = 99,
        |s| s.meshes[0].vertices[3].position[1] = f32::NAN,
        |s| s.meshes[0].vertices[3].normal = [0.0; 3],
        |s| s.meshes[0].vertices[3].sway = 1.5,
        |s| s.meshes[0].parts[0].material = 1,
        |s| s.meshes[0].parts[0].index_count = 33,
        |s| s.instances[0].mesh = 1,
        |s| s.instances[0].world_from_mesh.matrix3.x_axis.x = -1.0,
        |s| s.instances[0].world_from_mesh.matrix3.x_axis.x = 0.0,
        |s| s.materials[0].base_color_texture = Some(0.into()),
        |s| s.materials[0].metallic_roughness_texture = Some(0.into()),
        |s| s.materials[0].normal_texture = Some(0.into()),
        |s| s.materials[0].normal_scale = f32::NAN,
        |s| s.materials[0].occlusion_strength = 1.5,
        |s| s.materials[0].dielectric_reflectance_linear.y = 1.5,
        |s| s.meshes[0].details = vec![VertexDetail::default(); 3],
        |s| s.meshes[0].details = vec![VertexDetail { uv: [0.0; 2], tangent: [0.0; 4] }; s.meshes[0].vertices.len()],
        |s| s.materials[0].metallic = 2.0,
        |s| s.materials[0].roughness = f32::NAN,
        |s| s.illumination.environment.zenith_linear.x = -1.0,
        |s| s.illumination.lights = vec![s.illumination.lights[0]; 256],
        |s| s.materials.clear(),
        |s| s.illumination.environment = Environment::mapped(),
        |s| s.environment_map = EnvironmentMap::from_texels(UVec2::ONE, vec![0]).ok(),
    ];
    for (number, break_it) in broken.iter().enumerate() {
        let mut scene = unit_cube();
        break_it(&mut scene);
        assert!(scene.validate(&Limits::default()).is_err(), "{number}");
        assert!(unpack(&pack(&scene), &Limits::default()).is_err(), "{number}");
    }
}

#[test]
fn an_invalid_light_is_refused_with_its_field() {
    let lit_by = |lights| Scene { illumination: Illumination { lights, ..Illumination::default() }, ..unit_cube() };
    let with = |light| lit_by(vec![sun(), light]);
    let far = Vec3::X * 2e9;
    let rectangle = |center_in_world, u| Light::Rectangle {
        center_in_world,
        half_edges_in_world: [u, Vec3::Y],
        radiance_linear: Vec3::ONE,
    };
    let point =
        |position_in_world, intensity_linear, radius_m| Light::Point { position_in_world, intensity_linear, radius_m };
    for (light, field) in [
        (point(Vec3::ZERO, Vec3::NAN, 0.0), "intensity"),
        (point(Vec3::ZERO, -Vec3::ONE, 0.0), "intensity"),
        (point(far, Vec3::ONE, 0.0), "position"),
        (point(Vec3::ZERO, Vec3::ONE, 2e9), "radius"),
        (rectangle(far, Vec3::X), "center"),
        (rectangle(Vec3::ZERO, far), "half_edges"),
        (rectangle(Vec3::ZERO, Vec3::Y), "half_edges"),
    ] {
        let error = with(light).validate(&Limits::default()).unwrap_err();
        assert_eq!(error.element, format!("light 1: {field}"), "{error}");
        assert!(unpack(&pack(&with(light)), &Limits::default()).is_err());
    }
    let many = lit_by(vec![sun(); 255]);
    many.validate(&Limits::default()).unwrap();
    let error = many.validate(&Limits { lights: 254, ..Limits::default() }).unwrap_err();
    assert!(matches!(error.kind, SceneErrorKind::TooLarge { actual: 255, limit: 254 }), "{error}");
}

#[test]
fn lights_of_all_kinds_and_both_kinds_of_texture_travel() {
    let lights = [
        "sun towards=1,2,3 irradiance=0.5 angle=2",
        "point at=1,2,3 radius=0.1",
        "spot at=1,2,3 towards=0,-1,0 inner=10 outer=20",
        "rectangle at=0,2,0 u=1,0,0 v=0,0,1 radiance=3,2,1",
    ];
    let lights = lights.map(|text| text.parse::<LightSpec>().unwrap().0).to_vec();
    let mut scene = checker_sphere().lit_by(Some(lights), None);
    scene.textures.push(Texture { is_srgb: false, ..scene.textures[0].clone() });
    scene.materials[0].metallic_roughness_texture = Some(1.into());
    scene.materials[0].occlusion_texture =
        Some(TextureUse { texture: 1, second_uv: true, wrap: [Wrap::Mirror, Wrap::Clamp] });
    let count = scene.meshes[0].vertices.len();
    scene.meshes[0].details = vec![VertexDetail { uv: [0.5, 2.0], tangent: [0.0, 1.0, 0.0, -1.0] }; count];
    assert_eq!(unpack(&pack(&scene), &Limits::default()).unwrap(), scene);
    scene.materials[0].metallic_roughness_texture = Some(0.into());
    let error = unpack(&pack(&scene), &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("holds colours"), "{error}");
}

fn sun() -> Light {
    unit_cube().illumination.lights[0]
}

#[test]
fn the_limits_hold_for_packages() {
    let bytes = pack(&checker_sphere());
    for limits in [
        Limits { file_bytes: 1000, ..Limits::default() },
        Limits { vertices: 100, ..Limits::default() },
        Limits { triangles: 100, ..Limits::default() },
        Limits { texture_bytes: 100, ..Limits::default() },
    ] {
        let error = unpack(&bytes, &limits).unwrap_err();
        assert!(matches!(error.kind, SceneErrorKind::TooLarge { .. }), "{error}");
    }
}

#[test]
fn trees_have_the_requested_triangles_and_stay_in_their_block() {
    for asked in [30_000u32, 125_000, 500_000] {
        let scene = tree_terrain(asked, 2007);
        scene.validate(&Limits::default()).unwrap();
        let share = |n: u64| n as f32 / asked as f32;
        assert!((share(scene.triangle_count()) - 1.0).abs() < 0.03, "{}", scene.triangle_count());
        assert!((share(scene.meshes[0].triangle_count()) - 0.5).abs() < 0.02);
        let bounds = scene.bounds();
        assert!(bounds.min.cmpge(Vec3::new(-1.0, 0.0, -1.0)).all() && bounds.max.cmple(Vec3::ONE).all(), "{bounds:?}");
        assert!(bounds.max.y > 0.8, "{bounds:?}");
        assert_eq!(scene.period_s(), None);
    }
}

#[test]
fn the_papers_scene_is_matt_and_softly_lit() {
    let scene = tree_terrain(10_000, 2007);
    assert!(scene.materials.iter().all(|m| !m.is_specular() && m.phong_specular > 0.0));
    assert!(scene.illumination.lights.iter().all(Light::has_extent));
    let on_level_ground = scene.illumination.environment.diffuse_linear(Vec3::Y);
    assert!(on_level_ground.distance(Vec3::new(0.20, 0.23, 0.27)) < 1e-3, "{on_level_ground}");
}

#[test]
fn other_seeds_grow_other_trees_that_fit_too() {
    for seed in 0..12 {
        let scene = tree_terrain(20_000, seed).with_wind();
        scene.validate(&Limits::default()).unwrap();
        let bounds = scene.bounds();
        assert!(bounds.min.y >= 0.0 && bounds.max.y <= 1.0, "seed {seed}: {bounds:?}");
    }
}

#[test]
fn the_wind_moves_leaves_and_neither_ground_nor_roots() {
    let scene = tree_terrain(30_000, 2007).with_wind();
    assert!(scene.period_s().is_some());
    let wind = scene.wind.unwrap();
    let [ground, tree] = [&scene.meshes[0], &scene.meshes[1]];
    let moved = |v: &scene::Vertex, t: f32| wind.displacement_in_world(v.position.into(), v.sway, t).length();
    assert!(ground.vertices.iter().all(|v| moved(v, 0.3) == 0.0));
    let lowest = tree.vertices.iter().fold(f32::INFINITY, |y, v| y.min(v.position[1]));
    assert!(tree.vertices.iter().filter(|v| v.position[1] < lowest + 1e-3).all(|v| moved(v, 0.3) < 1e-6));
    let most = tree.vertices.iter().fold(0f32, |most, v| most.max(v.sway));
    assert!((0.8..=1.0).contains(&most), "{most}");
    let bounds = scene.bounds();
    for step in 0..8 {
        let at = |v: &scene::Vertex| {
            Vec3::from(v.position) + wind.displacement_in_world(v.position.into(), v.sway, step as f32 * 0.37)
        };
        assert!(tree.vertices.iter().map(at).all(|p| p.cmpge(bounds.min).all() && p.cmple(bounds.max).all()));
    }
}

#[test]
fn small_scenes_have_their_stated_geometry() {
    assert_eq!(unit_cube().triangle_count(), 12);
    assert!((signed_volume(&unit_cube()) - 1.0).abs() < 1e-6);
    let sphere = uv_sphere(2.0, 64);
    assert!(sphere.meshes[0].vertices.iter().all(|v| (Vec3::from(v.position).length() - 2.0).abs() < 1e-5));
    assert!((signed_volume(&sphere) / (32.0 / 3.0 * std::f32::consts::PI) - 1.0).abs() < 0.01);
    let pole = poles(0.05).bounds();
    assert!((pole.max.z - -0.95).abs() < 1e-6 && pole.min.z == -3.0);
    assert_eq!(courtyard().bounds().max.y, 2.0);
    assert!(checker_sphere().materials[0].base_color_texture.is_some());
}

#[test]
fn a_quad_faces_along_its_normal() {
    for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z, Vec3::new(1.0, 2.0, -3.0)] {
        let scene = quad(Vec3::new(0.0, 0.0, -4.0), 2.0, normal, [1, 2, 3]);
        scene.validate(&Limits::default()).unwrap();
        for [a, b, c] in world_triangles(&scene) {
            assert!((b - a).cross(c - a).normalize_or_zero().distance(normal.normalize_or_zero()) < 1e-5);
            assert!((a - Vec3::new(0.0, 0.0, -4.0)).dot(normal).abs() < 1e-4);
        }
        assert_eq!(scene.meshes[0].vertices[0].color_srgba8, [1, 2, 3, 255]);
    }
}
