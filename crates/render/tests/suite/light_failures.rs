//! Light far from the origin of a file's coordinates. Where light goes wrong is a list of curves: docs/failures.md.

use depth_image::{DepthImage, Light, PinholeCamera, linear_from_rgb9e5};
use glam::{DVec3, Vec3};
use scene::{Limits, Scene};

use crate::stage::{SIZE_PX, image, lamps, mean, upload, work};

fn sun(towards: Vec3) -> Light {
    Light::Directional {
        towards_light_in_world: towards.normalize_or(Vec3::Y),
        irradiance_linear: Vec3::ONE,
        angular_radius_rad: 0.0,
    }
}

fn root_mean_square_difference(a: &DepthImage, b: &DepthImage) -> f32 {
    let squares = a.color_rgb9e5.iter().zip(&b.color_rgb9e5).zip(&b.inverse_depth_per_m);
    let squares = squares.filter(|(_, depth)| **depth > 0.0).map(|((&a, &b), _)| {
        let difference = (linear_from_rgb9e5(a) - linear_from_rgb9e5(b)).y;
        difference * difference
    });
    mean(squares).sqrt()
}

/// A canopy over a floor as an OBJ file with its corner at `at`, lit by a slanting sun.
fn canopy_far_away(at: DVec3) -> Scene {
    let corner = |x: f64, y: f64, z: f64| format!("v {} {} {}\n", at.x + x, at.y + y, at.z + z);
    let square = |y: f64, low: f64, high: f64| {
        [(low, low), (low, high), (high, high), (high, low)].map(|(x, z)| corner(x, y, z)).concat()
    };
    let text = square(0.0, -1.0, 1.0) + &square(0.5, -0.25, 0.25) + "f 1 2 3 4\nf 5 6 7 8\n";
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("canopy.obj");
    std::fs::write(&file, text).expect("a file");
    let mut scene = scene::load_file(&file, &Limits::default(), scene::MissingTextures::Refuse).expect("a scene");
    scene.illumination = lamps(vec![sun(Vec3::new(1.0, 1.0, 0.3))]);
    scene
}

/// Swiss national coordinates lie 2.7e6 m from their origin, where an `f32` is a quarter of a metre.
#[test]
fn distant_surfaces_are_lit_like_near_ones() {
    let seen = |at: DVec3| {
        let scene = canopy_far_away(at);
        assert!((scene.source_space.origin_in_source - at).length() < 2.0, "{}", scene.source_space.origin_in_source);
        let center = scene.bounds().center();
        let camera = PinholeCamera::looking_at(center + Vec3::new(0.3, 3.0, 0.2), center, Vec3::NEG_Z, 0.9, SIZE_PX);
        let on_device = upload(&scene);
        ["shadows", "soft 4, occlusion 4"].map(|lighting| image(work(&on_device, lighting), &camera))
    };
    let near = seen(DVec3::ZERO);
    for far in [1e4, 2.7e6] {
        let there = seen(DVec3::new(far, 400.0, 0.45 * far));
        for (a, b) in near.iter().zip(&there) {
            let depths = a.inverse_depth_per_m.iter().zip(&b.inverse_depth_per_m);
            let off = depths.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            let light = root_mean_square_difference(a, b);
            println!("at {far:e} m: inverse depth {off:e} a metre, light {light:e}");
            assert!(off < 1e-5 && light < 1e-3, "{far:e}: {off} {light}");
        }
    }
}
