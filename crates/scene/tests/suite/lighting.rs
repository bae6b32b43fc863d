//! Lights as text, the default lights, and scenes without light.

use depth_image::linear_from_srgb8;
use fixtures::{quad, unit_cube};
use glam::{DVec3, Vec3};
use scene::{Environment, EnvironmentSpec, Illumination, Light, LightSpec, Limits, Material, Scene, SourceSpace};

fn light(text: &str) -> Light {
    text.parse::<LightSpec>().unwrap_or_else(|e| panic!("{text}: {e}")).0
}

fn radians(degrees: f64) -> f32 {
    degrees.to_radians() as f32
}

#[test]
fn every_kind_of_light_is_parsed_with_and_without_defaults() {
    let Light::Directional { towards_light_in_world, irradiance_linear, angular_radius_rad } =
        light("sun towards=0,3,4")
    else {
        panic!()
    };
    assert!(towards_light_in_world.distance(Vec3::new(0.0, 0.6, 0.8)) < 1e-6);
    assert_eq!((irradiance_linear, angular_radius_rad), (Vec3::ONE, radians(0.27)));
    let point = |intensity_linear, radius_m| Light::Point {
        position_in_world: Vec3::new(1.0, 2.5, -3.0),
        intensity_linear,
        radius_m,
    };
    assert_eq!(light("point at=1,2.5,-3"), point(Vec3::ONE, 0.0));
    assert_eq!(light("  point\tradius=0.5  intensity=1,2,3 at=1,2.5,-3 "), point(Vec3::new(1.0, 2.0, 3.0), 0.5));
    let orange = Vec3::new(1.0, linear_from_srgb8(128), 0.0);
    assert_eq!(light("point at=1,2.5,-3 intensity=#Ff8000"), point(orange, 0.0));
    let spot = |inner, outer, radius_m| Light::Spot {
        position_in_world: Vec3::ZERO,
        forward_in_world: Vec3::NEG_Y,
        intensity_linear: Vec3::ONE,
        inner_cone_rad: radians(inner),
        outer_cone_rad: radians(outer),
        radius_m,
    };
    assert_eq!(light("spot at=0,0,0 towards=0,-7,0"), spot(0.0, 45.0, 0.0));
    assert_eq!(light("spot at=0,0,0 towards=0,-7,0 inner=10 outer=90 radius=1e-1"), spot(10.0, 90.0, 0.1));
    assert_eq!(
        light("rectangle at=0,2,0 u=1,0,0 v=0,0,2 radiance=4"),
        Light::Rectangle {
            center_in_world: Vec3::Y * 2.0,
            half_edges_in_world: [Vec3::X, Vec3::Z * 2.0],
            radiance_linear: Vec3::splat(4.0)
        }
    );
}

#[test]
fn an_environment_is_one_colour_or_two() {
    let read = |text: &str| match text.parse::<EnvironmentSpec>().unwrap() {
        EnvironmentSpec::Colors(environment) => environment,
        EnvironmentSpec::File(path) => panic!("{path:?}"),
    };
    assert_eq!(read("0.25"), Environment::uniform(Vec3::splat(0.25)));
    assert_eq!(read(" #000000 "), Environment::default());
    let gradient = Environment::gradient(Vec3::new(0.1, 0.2, 0.3), Vec3::ONE);
    assert_eq!(read("0.1,0.2,0.3/#ffffff"), gradient);
    assert_eq!("skies/noon.HDR".parse(), Ok(EnvironmentSpec::File("skies/noon.HDR".into())));
}

#[test]
fn an_invalid_light_is_refused_by_field() {
    let unknown = "unknown; known are";
    let repeated = "given twice";
    let missing = "missing";
    let malformed = " is not ";
    let invalid = "";
    let cases = [
        ("", "light", missing),
        ("moon towards=0,1,0", "moon", unknown),
        ("Sun towards=0,1,0", "Sun", unknown),
        ("sun", "towards", missing),
        ("sun at=0,1,0", "at", unknown),
        ("sun towards=0,1,0 bright", "bright", unknown),
        ("sun towards=0,1,0 =3", "", unknown),
        ("sun towards=0,1,0 towards=0,1,0", "towards", repeated),
        ("sun towards=0,1", "towards", malformed),
        ("sun towards=0,1,0,0", "towards", malformed),
        ("sun towards", "towards", malformed),
        ("sun towards=0,nan,0", "towards", malformed),
        ("sun towards=0,0,0", "towards", invalid),
        ("sun towards=0,1,0 angle=-1", "angle", invalid),
        ("sun towards=0,1,0 angle=46", "angle", invalid),
        ("sun towards=0,1,0 angle=nan", "angle", malformed),
        ("sun towards=0,1,0 irradiance=-1", "irradiance", invalid),
        ("sun towards=0,1,0 irradiance=1,2", "irradiance", malformed),
        ("sun towards=0,1,0 irradiance=inf", "irradiance", malformed),
        ("sun towards=0,1,0 irradiance=1e39", "irradiance", malformed),
        ("sun towards=0,1,0 irradiance=#12345", "irradiance", malformed),
        ("sun towards=0,1,0 irradiance=#+12345", "irradiance", malformed),
        ("sun towards=0,1,0 irradiance=#äöü", "irradiance", malformed),
        ("point", "at", missing),
        ("point at=0,0,1e39", "at", malformed),
        ("point at=0,0,0 radius=-1", "radius", invalid),
        ("point at=0,0,0 intensity=1,-2,3", "intensity", invalid),
        ("spot at=0,0,0", "towards", missing),
        ("spot towards=0,1,0", "at", missing),
        ("spot at=0,0,0 towards=0,1,0 inner=50", "inner", invalid),
        ("spot at=0,0,0 towards=0,1,0 outer=91", "outer", invalid),
        ("rectangle at=0,0,0 u=1,0,0", "v", missing),
        ("rectangle at=0,0,0 u=1,0,0 v=1,1,0", "u, v", invalid),
        ("rectangle at=0,0,0 u=1,0,0 v=2,0,0", "u, v", invalid),
        ("rectangle at=0,0,0 u=1,0,0 v=0,1,0 radiance=-1", "radiance", invalid),
    ];
    for (text, field, kind) in cases {
        let error = text.parse::<LightSpec>().expect_err(text);
        let found = [unknown, repeated, missing, malformed].into_iter().find(|kind| error.reason.contains(kind));
        assert_eq!((error.field.as_str(), found.unwrap_or(invalid)), (field, kind), "{text}: {error:?}");
    }
    for (text, field) in [
        ("", "environment"),
        ("x", "environment"),
        ("1/", "nadir"),
        ("/1", "zenith"),
        ("1/2/3", "nadir"),
        ("-1", "environment"),
    ] {
        assert_eq!(text.parse::<EnvironmentSpec>().expect_err(text).field, field, "{text}");
    }
    let message = "spot at=0,0,0 towards=0,1,0 colour=1".parse::<LightSpec>().unwrap_err().to_string();
    assert_eq!(message, "colour: unknown; known are at, towards, intensity, inner, outer, radius");
}

#[test]
fn given_light_replaces_the_light_of_its_kind() {
    let cube = unit_cube();
    assert_eq!(cube.clone().lit_by(None, None), cube);
    let sky = Environment::uniform(Vec3::X);
    let relit = cube.clone().lit_by(None, Some(sky));
    assert_eq!(relit.illumination, Illumination { environment: sky, ..cube.illumination.clone() });
    let moved = Scene { source_space: SourceSpace::moved(DVec3::new(1e6, 0.0, -0.5)), ..cube.clone() };
    let lights = ["point at=1000001,2,3", "rectangle at=1000000,0,0 u=1,0,0 v=0,1,0", "sun towards=0,1,0"];
    let relit = moved.lit_by(Some(lights.map(light).to_vec()), None);
    let expected = ["point at=1,2,3.5", "rectangle at=0,0,0.5 u=1,0,0 v=0,1,0", "sun towards=0,1,0"];
    assert_eq!(relit.illumination.lights, expected.map(light));
    assert_eq!(relit.illumination.environment, cube.illumination.environment);
}

#[test]
fn a_scene_without_light_is_black_and_valid() {
    assert!(unit_cube().has_light());
    for lights in [vec![], vec![light("sun towards=0,1,0 irradiance=0")]] {
        let dark = unit_cube().lit_by(Some(lights), Some(Environment::default()));
        assert!(!dark.has_light());
        dark.validate(&Limits::default()).unwrap();
    }
    let dark = || unit_cube().lit_by(Some(Vec::new()), Some(Environment::default()));
    assert!(dark().lit_by(None, Some(Environment::uniform(Vec3::Z))).has_light());
    assert!(dark().lit_by(Some(vec![light("point at=0,9,0")]), None).has_light());
}

#[test]
fn the_default_lights_are_soft_and_under_a_sky() {
    let Illumination { lights, environment } = unit_cube().illumination;
    let [Light::Directional { angular_radius_rad, .. }] = lights[..] else { panic!("{lights:?}") };
    assert!((angular_radius_rad.to_degrees() - 2.0).abs() < 1e-4);
    assert!(environment.diffuse_linear(Vec3::Y).distance(Vec3::new(0.20, 0.21, 0.23)) < 1e-3);
    let sky = environment.zenith_linear;
    let ground = environment.nadir_linear;
    assert!(sky.z > sky.x && ground.x > ground.z && ground.cmplt(sky).all(), "blue above, warm and darker below");
    assert!(!quad(Vec3::ZERO, 1.0, Vec3::Z, [1, 2, 3]).has_light(), "what is unlit needs none");
}

#[test]
fn a_scene_without_a_background_gets_a_quiet_gradient() {
    let background = Scene::default().with_default_background().background;
    let above = background.zenith_linear;
    let below = background.nadir_linear;
    assert!(below.cmplt(above).all() && below.min_element() > 0.0 && above.max_element() < 1.0, "{background:?}");
    for color in [above, below] {
        assert!(color.max_element() < 1.3 * color.min_element(), "{color} is no grey");
    }
    let red = Scene { background: Environment::uniform(Vec3::X), ..Scene::default() };
    assert_eq!(red.clone().with_default_background(), red, "a background that is there is kept");
}

#[test]
fn only_a_material_with_a_highlight_is_specular() {
    let matt = Material::default();
    assert!(!matt.is_specular() && !Material { roughness: 0.95, ..matt.clone() }.is_specular());
    let shiny = [
        Material { roughness: 0.9, ..matt.clone() },
        Material { metallic: 0.1, ..matt.clone() },
        Material { metallic_roughness_texture: Some(0.into()), ..matt.clone() },
    ];
    for material in shiny {
        assert!(material.is_specular(), "{material:?}");
        assert!(!Material { unlit: true, ..material }.is_specular());
    }
    assert!(!unit_cube().materials[0].is_specular());
}

#[test]
fn pictures_in_other_formats_are_no_environment() {
    for file in ["skies/noon.exr", "noon.EXR", "a.png", "noon.ktx2"] {
        let error = file.parse::<EnvironmentSpec>().expect_err(file).to_string();
        assert!(error.contains(file) && error.contains("only .hdr is read"), "{error}");
    }
    for color in ["0.5", ".5", "0.5/1.5", "1,0.25,0.125"] {
        assert!(color.parse::<EnvironmentSpec>().is_ok(), "{color}");
    }
}
