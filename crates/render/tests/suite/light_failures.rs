//! Where light goes wrong, as curves: what they look like is in docs/methods/light.md.

use depth_image::{DepthImage, Light, PinholeCamera, linear_from_rgb9e5};
use glam::{DVec3, Vec3};
use scene::procedural::{courtyard, uv_sphere};
use scene::{Limits, Scene};

use crate::stage::{SIZE_PX, floor_light, floor_under, image, lamps, lit_points, mean, upload, work};

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

/// A ceiling lamp of one brightness in all, a quarter to four times as wide as the scene (Xie's Table 4): the wider
/// it is the more its rays differ, up to the noise of rays that see all or nothing; more rays help at every width.
#[test]
fn wide_lamps_need_more_rays_but_never_fail() {
    let mut scene = courtyard();
    let bounds = scene.bounds();
    let diagonal_m = bounds.size().length();
    let eye = bounds.center() + Vec3::new(0.4, 1.0, 1.1) * diagonal_m * 0.8;
    let camera = PinholeCamera::looking_at(eye, bounds.center(), Vec3::Y, 0.8, SIZE_PX);
    println!("width (diagonals): error of 4, 16 and 64 rays beside 1024");
    for width in [0.25, 0.5, 1.0, 2.0, 4.0] {
        let half_m = 0.5 * width * diagonal_m;
        scene.illumination = lamps(vec![Light::Rectangle {
            center_in_world: bounds.center() + Vec3::Y * diagonal_m,
            half_edges_in_world: [Vec3::X * half_m, Vec3::Z * half_m],
            radiance_linear: Vec3::splat(1.0 / (width * width)),
        }]);
        let on_device = upload(&scene);
        let lit = |rays: u32| image(work(&on_device, &format!("soft {rays}")), &camera);
        let converged = lit(1024);
        let errors = [4, 16, 64].map(|rays| root_mean_square_difference(&lit(rays), &converged));
        println!("{width:5.2}: {errors:.5?}");
        assert!(errors.iter().all(|e| e.is_finite() && *e < 0.2), "{width}: {errors:?}");
        assert!(errors[0] > 1.5 * errors[1] && errors[1] > 1.5 * errors[2], "{width}: {errors:?}");
    }
}

/// Smooth normals over flat facets: where light grazes, a facet that faces away shadows what the normals call lit.
#[test]
fn coarse_spheres_shadow_themselves_at_the_terminator() {
    let camera = PinholeCamera::looking_at(Vec3::Z * 4.0, Vec3::ZERO, Vec3::Y, 0.7, SIZE_PX);
    let mut before = 1.0;
    println!("segments: share of what faces the light that lies in the sphere's own shadow");
    for segments in [8, 16, 32, 64, 128] {
        let mut scene = uv_sphere(1.0, segments);
        scene.illumination = lamps(vec![sun(Vec3::new(1.0, 0.37, 0.21))]);
        let on_device = upload(&scene);
        let shares = |lighting| lit_points(&image(work(&on_device, lighting), &camera));
        let (plain, shadowed) = (shares("phong"), shares("shadows"));
        let facing: Vec<_> = plain.iter().zip(&shadowed).filter(|((_, lit), _)| *lit > 0.0).collect();
        let dark = facing.iter().filter(|(_, (_, lit))| *lit == 0.0).count() as f32 / facing.len() as f32;
        println!("{segments:4}: {dark:.4}");
        assert!(dark < before && (segments > 8 || dark > 0.03), "{segments}: {dark} after {before}");
        before = dark;
    }
    assert!(before < 0.02, "a fine sphere is nearly free of it: {before}");
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
        assert!((scene.origin_in_source - at).length() < 2.0, "{}", scene.origin_in_source);
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

/// A lamp sinks to the level of the floor that it lights.
#[test]
fn a_lamp_in_the_plane_of_a_surface_gives_it_none() {
    let camera = PinholeCamera::looking_at(Vec3::new(0.0, 2.5, 0.1), Vec3::ZERO, Vec3::NEG_Z, 0.9, SIZE_PX);
    println!("height (m): mean light of the floor");
    let mut before = f32::INFINITY;
    for height_m in [1.0, 0.1, 0.01, 1e-3, 1e-6, 0.0] {
        let lamp = Light::Point {
            position_in_world: Vec3::new(2.0, height_m, 0.0),
            intensity_linear: Vec3::ONE,
            radius_m: 0.05,
        };
        let scene = floor_under(&[], lamps(vec![lamp]));
        let light = mean(floor_light(&image(work(&upload(&scene), "soft 16"), &camera)).into_iter().map(|(_, l)| l));
        println!("{height_m:8}: {light:e}");
        assert!(light.is_finite() && light >= 0.0 && light <= before, "{height_m}: {light} after {before}");
        before = light;
    }
}
