//! Rays and light on the software device against closed forms and the scalar reference.

use depth_image::{
    Camera, DepthImage, Environment, Highlight, Illumination, Light, PinholeCamera, Ray, Reflector, View, ViewPlanes,
    highlight_linear, linear_from_rgb9e5, linear_from_srgb8, unit_from_oct16,
};
use fixtures::{checker_sphere, poles, unit_cube, uv_sphere};
use glam::{Affine3A, UVec2, Vec3};
use rayon::prelude::*;
use render::{DrawWork, Refinement, Visibility, scalar};
use scene::procedural::{courtyard, tree_terrain};
use scene::{Instance, Scene};

use crate::stage::{SIZE_PX, device, down_from, floor_light, floor_under, image, lamps, mean, upload, work};

fn view(work: DrawWork<'_>, camera: &PinholeCamera) -> View {
    device().1.draw_views(work, &[*camera], ViewPlanes::WITH_DEPTH).expect("a view").remove(0)
}

/// From above a scene's front.
fn before(scene: &Scene) -> PinholeCamera {
    let bounds = scene.bounds();
    let eye = bounds.center() + Vec3::new(0.4, 1.0, 1.1) * bounds.size().length() * 0.8;
    PinholeCamera::looking_at(eye, bounds.center(), Vec3::Y, 0.8, SIZE_PX)
}

fn sky(radiance: f32) -> Illumination {
    Illumination { lights: Vec::new(), environment: Environment::uniform(Vec3::splat(radiance)) }
}

#[test]
fn rays_find_the_surfaces_that_triangles_draw() {
    let mut instanced = unit_cube();
    instanced.instances = (0..9)
        .map(|i| {
            let turned = Affine3A::from_rotation_y(i as f32 * 0.3);
            let placed = Affine3A::from_translation(Vec3::new((i % 3) as f32 * 2.0, 0.0, (i / 3) as f32 * 2.0));
            Instance { mesh: 0, world_from_mesh: placed * turned }
        })
        .collect();
    for scene in [courtyard(), poles(0.05), unit_cube(), checker_sphere(), instanced, tree_terrain(30_000, 1)] {
        let on_device = upload(&scene);
        let camera = before(&scene);
        let by = |visibility| image(DrawWork { visibility, ..work(&on_device, "unlit") }, &camera);
        let drawn = by(Visibility::Triangles);
        let traced = by(Visibility::Rays);
        let ids = |image: &DepthImage| image.surface_id.clone().expect("ids");
        let a = ids(&drawn);
        let b = ids(&traced);
        let depths = drawn.inverse_depth_per_m.iter().zip(&traced.inverse_depth_per_m);
        let same: Vec<f32> = depths
            .zip(a.iter().zip(&b))
            .filter(|((d, e), (i, j))| **d > 0.0 && **e > 0.0 && i == j)
            .map(|((d, e), _)| (d - e).abs() / d)
            .collect();
        let surfaces = drawn.inverse_depth_per_m.iter().filter(|&&d| d > 0.0).count();
        assert!(
            surfaces > 300 && same.len() as f32 > 0.97 * surfaces as f32,
            "{}: {} of {surfaces}",
            scene.name,
            same.len()
        );
        assert!(same.iter().all(|&e| e < 1e-4), "{}: {:?}", scene.name, same.iter().copied().fold(0.0, f32::max));
    }
}

#[test]
fn a_million_rays_find_no_gap_in_a_closed_mesh() {
    let mut scene = uv_sphere(1.0, 160);
    scene.materials[0].double_sided = true;
    let on_device = upload(&scene);
    let twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    let place = |n: u32, salt: u32| {
        let axis = |i: u32| scalar::sequence::hashed(n.wrapping_mul(7) ^ salt ^ i) as f32 / u32::MAX as f32 * 2.0 - 1.0;
        Vec3::new(axis(0x51), axis(0x7f31), axis(0x1f0a3))
    };
    let leaks = |aim: &(dyn Fn(u32, Vec3) -> Vec3 + Sync)| {
        let escapes = |&n: &u32| {
            let origin_in_world = place(n, 0x9e37) * 0.5;
            let direction_in_world = aim(n, origin_in_world);
            twin.closest(&Ray { origin_in_world, direction_in_world }, 0.0).is_none()
        };
        (0..1_000_000u32).into_par_iter().filter(escapes).count()
    };
    assert_eq!(leaks(&|n, _| place(n, 0xabcd)), 0, "anywhere");
    let corners: Vec<[Vec3; 3]> = twin.triangles_in_world().collect();
    let triangle = |n: u32| corners[n as usize % corners.len()];
    assert_eq!(leaks(&|n, from| triangle(n)[n as usize % 3] - from), 0, "at corners");
    assert_eq!(leaks(&|n, from| (triangle(n)[0] + triangle(n)[1]) * 0.5 - from), 0, "at edges");
    let inside = PinholeCamera::looking_at(Vec3::splat(0.01), Vec3::X, Vec3::Y, 2.2, UVec2::new(400, 300));
    let seen = view(DrawWork { visibility: Visibility::Rays, ..work(&on_device, "unlit") }, &inside);
    assert!(seen.inverse_depth_per_m.expect("depth").iter().all(|&d| d > 0.0), "from inside");
}

#[test]
fn degenerate_and_stacked_triangles_are_harmless() {
    let mut scene = uv_sphere(1.0, 24);
    let mesh = &mut scene.meshes[0];
    let first = mesh.vertices.len() as u32;
    let corner = |x: f32| scene::Vertex { position: [x, 0.5, 2.0], ..mesh.vertices[0] };
    let line = [corner(0.0), corner(0.5), corner(1.0)];
    mesh.vertices.extend(line);
    for _ in 0..5000 {
        mesh.indices.extend([first, first + 1, first + 2, first, first, first]);
    }
    mesh.parts[0].index_count = mesh.indices.len() as u32;
    let on_device = upload(&scene);
    let camera = before(&scene);
    let by = |visibility| view(DrawWork { visibility, ..work(&on_device, "soft 2, occlusion 2") }, &camera);
    let drawn = by(Visibility::Triangles);
    let traced = by(Visibility::Rays);
    let far = |a: &u8, b: &u8| a.abs_diff(*b) > 8;
    let differ = drawn.srgb8.iter().zip(&traced.srgb8).filter(|(a, b)| far(a, b)).count();
    assert!(differ * 50 < drawn.srgb8.len(), "{differ}");
    assert!(traced.inverse_depth_per_m.expect("depth").iter().all(|d| d.is_finite()));
}

#[test]
fn a_hard_shadow_lies_at_its_projected_place() {
    let sun = Light::Directional {
        towards_light_in_world: Vec3::new(1.0, 1.0, 0.0).normalize_or(Vec3::Y),
        irradiance_linear: Vec3::ONE,
        angular_radius_rad: 0.0,
    };
    // At half a metre's height the shadow falls half a metre to −x.
    let scene = floor_under(&[(Vec3::Y * 0.5, 0.2, Vec3::Y)], lamps(vec![sun]));
    let light = floor_light(&image(work(&upload(&scene), "shadows"), &down_from(4.0)));
    let cosine = 0.5f32.sqrt();
    for (point, reflected) in light {
        let from_edge = (point.x + 0.5).abs().max(point.z.abs()) - 0.2;
        if from_edge.abs() > 0.03 {
            let wanted = if from_edge < 0.0 { 0.0 } else { cosine };
            assert!((reflected - wanted).abs() < 5e-3, "{point}: {reflected}, not {wanted}");
        }
    }
}

#[test]
fn a_penumbra_is_as_wide_as_the_sun() {
    let angular_radius_rad = 0.1f32;
    let sun = Light::Directional { towards_light_in_world: Vec3::Y, irradiance_linear: Vec3::ONE, angular_radius_rad };
    // An edge at x = 0, half a metre up: its shadow fades over ± 0.05 m.
    let scene = floor_under(&[(Vec3::new(-0.9, 0.5, 0.0), 0.9, Vec3::NEG_Y)], lamps(vec![sun]));
    let from_below = PinholeCamera::looking_at(Vec3::new(0.0, 0.45, 0.0), Vec3::ZERO, Vec3::NEG_Z, 1.0, SIZE_PX);
    let light = floor_light(&image(work(&upload(&scene), "soft 256"), &from_below));
    for (point, reflected) in light {
        // The part of a disc beyond a chord.
        let at = (point.x / (0.5 * angular_radius_rad.tan())).clamp(-1.0, 1.0);
        let wanted = 1.0 - (at.acos() - at * (1.0 - at * at).sqrt()) / std::f32::consts::PI;
        assert!((reflected - wanted).abs() < 0.03, "{point}: {reflected}, not {wanted}");
    }
}

#[test]
fn many_lamps_light_as_one_of_their_sum() {
    let mut scene = tree_terrain(30_000, 1);
    let bounds = scene.bounds();
    let diagonal_m = bounds.size().length();
    let lit_by = |count: usize, scene: &mut Scene| {
        let lamp = Light::Point {
            position_in_world: bounds.center() + Vec3::new(0.3, 0.8, 0.2) * diagonal_m,
            intensity_linear: Vec3::splat(diagonal_m * diagonal_m / count as f32),
            radius_m: 0.02 * diagonal_m,
        };
        scene.illumination = lamps(vec![lamp; count]);
        view(work(&upload(scene), "soft 64"), &before(scene))
    };
    let many = lit_by(200, &mut scene);
    let one = lit_by(1, &mut scene);
    let surfaces = one.inverse_depth_per_m.as_ref().expect("depth").iter().map(|&d| d > 0.0);
    let squares = one.srgb8.chunks_exact(3).zip(many.srgb8.chunks_exact(3)).zip(surfaces).filter(|(_, shown)| *shown);
    let square = |((a, b), _): ((&[u8], &[u8]), bool)| {
        mean(a.iter().zip(b).map(|(a, b)| (f32::from(*a) - f32::from(*b)).powi(2)))
    };
    let psnr_db = 10.0 * (255.0f32 * 255.0 / mean(squares.map(square))).log10();
    assert!(psnr_db >= 40.0, "{psnr_db} dB over the surfaces");
}

#[test]
fn a_rectangle_lights_by_its_form_factor() {
    let lamp = Light::Rectangle {
        center_in_world: Vec3::Y,
        half_edges_in_world: [Vec3::X * 0.5, Vec3::Z * 0.5],
        radiance_linear: Vec3::ONE,
    };
    let on_device = upload(&floor_under(&[], lamps(vec![lamp])));
    let light = floor_light(&image(work(&on_device, "soft 64"), &down_from(0.9)));
    let middle = mean(light.iter().filter(|(p, _)| p.length() < 0.03).map(|(_, l)| *l));
    let x = 0.5f32;
    let root = (1.0 + x * x).sqrt();
    let wanted = 4.0 * x / root * (x / root).atan() / std::f32::consts::PI;
    assert!((middle - wanted).abs() < 0.01 * wanted, "{middle}, not {wanted}");
}

#[test]
fn occlusion_is_none_in_the_open_half_at_a_wall_and_all_in_a_box() {
    let open = floor_light(&image(work(&upload(&floor_under(&[], sky(1.0))), "occlusion 16 10m"), &down_from(3.0)));
    assert!(
        open.iter().all(|(_, l)| (l - 1.0).abs() < 3e-3),
        "{:?}",
        open.iter().find(|(_, l)| (l - 1.0).abs() >= 3e-3)
    );
    // A wall that goes on for ever, from its foot: half of the sky.
    let wall = floor_under(&[(Vec3::X * -0.2, 100.0, Vec3::X)], sky(1.0));
    let beside = floor_light(&image(work(&upload(&wall), "occlusion 64 1000m"), &down_from(1.5)));
    for distance_m in [0.005f32, 0.2, 0.7] {
        let near = beside.iter().filter(|(p, _)| (p.x + 0.2 - distance_m).abs() < 0.02 && p.z.abs() < 0.3);
        let got = mean(near.map(|(_, l)| *l));
        assert!((got - 0.5).abs() < 0.03, "{distance_m}: {got}: the angle is the same at every distance");
    }
    let box_around = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::Z, Vec3::NEG_Z].map(|out| (out, 2.0, -out));
    let inside = PinholeCamera::looking_at(Vec3::Y * 0.8, Vec3::ZERO, Vec3::NEG_Z, 0.9, SIZE_PX);
    let closed = floor_light(&image(work(&upload(&floor_under(&box_around, sky(1.0))), "occlusion 16 100m"), &inside));
    assert!(closed.len() > 1000 && closed.iter().all(|(_, l)| *l == 0.0), "light in a closed box");
}

#[test]
fn light_without_rays_equals_the_scalar_reference() {
    let lights = vec![
        Light::Point { position_in_world: Vec3::new(0.3, 0.8, 0.2), intensity_linear: Vec3::splat(0.6), radius_m: 0.1 },
        Light::Spot {
            position_in_world: Vec3::new(-0.5, 1.0, 0.0),
            forward_in_world: Vec3::NEG_Y,
            intensity_linear: Vec3::ONE,
            inner_cone_rad: 0.2,
            outer_cone_rad: 0.6,
            radius_m: 0.0,
        },
    ];
    let environment = Environment::gradient(Vec3::splat(0.3), Vec3::splat(0.1));
    let scene = floor_under(&[], Illumination { lights: lights.clone(), environment });
    for (point, reflected) in floor_light(&image(work(&upload(&scene), "phong"), &down_from(2.0))) {
        let lamp = |light: &Light| {
            let incident = light.from_middle(point);
            incident.irradiance_linear.y * incident.towards_light_in_world.y.max(0.0)
        };
        let wanted = environment.diffuse_linear(Vec3::Y).y + lights.iter().map(lamp).sum::<f32>();
        assert!((reflected - wanted).abs() < 5e-3 * wanted, "{point}: {reflected}, not {wanted}");
    }
}

#[test]
fn still_scenes_do_not_flicker_and_refinement_steps_add_up() {
    let scene = courtyard();
    let on_device = upload(&scene);
    let camera = before(&scene);
    let lit = work(&on_device, "soft 16, occlusion 16");
    let whole = image(lit, &camera);
    assert!(whole == image(lit, &camera), "the same rays give the same picture");
    let steps = lit.lighting.refinement_steps();
    assert_eq!(steps, 5);
    let reference = image(work(&on_device, "soft 1024, occlusion 1024"), &camera);
    let off = |a: &DepthImage, b: &DepthImage| {
        let pairs = a.color_rgb9e5.iter().zip(&b.color_rgb9e5);
        let squares = pairs.map(|(&a, &b)| (linear_from_rgb9e5(a) - linear_from_rgb9e5(b)).length_squared());
        mean(squares).sqrt()
    };
    let refined: Vec<DepthImage> =
        (0..steps).map(|step| image(DrawWork { refinement: Refinement { step, steps }, ..lit }, &camera)).collect();
    assert!(off(&refined[4], &whole) < 1e-3, "all steps together are all rays at once");
    let errors: Vec<f32> = refined.iter().map(|image| off(image, &reference)).collect();
    println!("RMSE of 1, 2, 4, 8, 16 rays: {errors:?}");
    // Doubling the rays four times: faster than 1/√N, which would leave a quarter.
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]) && errors[4] < errors[0] * 0.2, "{errors:?}");
    // The last step alone, with nothing kept from before.
    let alone = image(DrawWork { refinement: Refinement { step: 4, steps }, ..lit }, &camera);
    assert!(off(&alone, &whole) < 1e-3);
}

#[test]
fn each_kind_of_light_alone_refines_to_the_whole() {
    let scene = courtyard();
    let on_device = upload(&scene);
    let camera = before(&scene);
    for lighting in ["soft 8", "phong, occlusion 8", "shadows, occlusion 4", "soft 4, indirect 8", "soft 100"] {
        let lit = work(&on_device, lighting);
        let steps = lit.lighting.refinement_steps();
        let refined = |step| image(DrawWork { refinement: Refinement { step, steps }, ..lit }, &camera);
        let steps: Vec<DepthImage> = (0..steps).map(refined).collect();
        let last = steps.last().expect("steps");
        let whole = image(lit, &camera);
        let far = |(&a, &b): (&u32, &u32)| (linear_from_rgb9e5(a) - linear_from_rgb9e5(b)).length() > 5e-3;
        let differ = last.color_rgb9e5.iter().zip(&whole.color_rgb9e5).filter(|pair| far(*pair)).count();
        assert_eq!(differ, 0, "{lighting}");
    }
}

/// The software device ends an invocation's loops after 65,535 turns: no ray may be lost to that.
#[test]
fn many_rays_through_foliage_are_all_traced() {
    let scene = tree_terrain(30_000, 1);
    let on_device = upload(&scene);
    let camera = PinholeCamera { size_px: UVec2::new(24, 18), ..before(&scene) };
    let mean_light = |lighting: &str| {
        let image = image(work(&on_device, lighting), &camera);
        mean(image.color_rgb9e5.iter().map(|&c| linear_from_rgb9e5(c).y))
    };
    let few = mean_light("soft 64, occlusion 64");
    let many = mean_light("soft 2048, occlusion 2048");
    assert!((few - many).abs() < 2e-3 * few, "{few} {many}");
}

#[test]
fn more_rays_keep_the_mean_brightness() {
    let scene = courtyard();
    let on_device = upload(&scene);
    let camera = before(&scene);
    let reference = image(work(&on_device, "soft 1024, occlusion 1024"), &camera);
    let few = image(work(&on_device, "soft 4, occlusion 4"), &camera);
    let differences: Vec<f32> = few
        .color_rgb9e5
        .iter()
        .zip(&reference.color_rgb9e5)
        .zip(&reference.inverse_depth_per_m)
        .filter(|(_, d)| **d > 0.0)
        .map(|((&a, &b), _)| (linear_from_rgb9e5(a) - linear_from_rgb9e5(b)).y)
        .collect();
    let bias = mean(differences.iter().copied());
    let deviation = mean(differences.iter().map(|d| (d - bias) * (d - bias))).sqrt();
    let half_width = 2.576 * deviation / (differences.len() as f32).sqrt();
    println!("bias {bias}, 99 % within {half_width}");
    assert!(bias.abs() <= half_width, "{bias} {half_width}");
}

/// A glossy sphere under a point lamp, seen by two cameras.
#[test]
fn highlights_equal_the_scalar_reference_and_move_with_the_eye() {
    let mut scene = uv_sphere(1.0, 256);
    scene.materials[0] = scene::Material { roughness: 0.3, metallic: 0.0, ..scene::Material::default() };
    let lamp =
        Light::Point { position_in_world: Vec3::new(2.0, 3.0, 2.0), intensity_linear: Vec3::splat(4.0), radius_m: 0.0 };
    scene.illumination = lamps(vec![lamp]);
    let on_device = upload(&scene);
    assert!(on_device.has_highlights(Highlight::Ggx));
    let reflector = Reflector { reflectance_linear: Vec3::splat(0.04), roughness: 0.3 };
    let reflector = Reflector::unpack(reflector.pack()).expect("a reflector");
    let mut brightest = Vec::new();
    for eye in [Vec3::new(0.0, 1.0, 4.0), Vec3::new(3.0, 1.0, 3.0)] {
        let camera = PinholeCamera::looking_at(eye, Vec3::ZERO, Vec3::Y, 0.7, SIZE_PX);
        let seen = view(work(&on_device, "shadows"), &camera);
        let sample = image(work(&on_device, "shadows"), &camera);
        let normals = sample.normal_oct16.as_ref().expect("normals");
        let mut peak = (0.0, Vec3::ZERO);
        for (x, y) in (0..SIZE_PX.y).flat_map(|y| (0..SIZE_PX.x).map(move |x| (x, y))) {
            let index = (y * SIZE_PX.x + x) as usize;
            let Some(point) = sample.sample_in_world(x, y) else { continue };
            let normal = unit_from_oct16(normals[index]);
            let to_eye = (camera.eye_in_world - point).normalize_or(Vec3::Y);
            let visible = sample.specular.as_ref().map_or(0, |s| s.visibility8[0][index] >> 8 & 255) as f32 / 255.0;
            let share = |i: usize| if i == 0 { 1.0 } else { visible };
            let added =
                highlight_linear(Highlight::Ggx, &scene.illumination, &share, point, normal, to_eye, &reflector);
            let wanted = linear_from_rgb9e5(sample.color_rgb9e5[index]) + added;
            let got = Vec3::from([0, 1, 2].map(|c| linear_from_srgb8(seen.srgb8[3 * index + c])));
            let error = (got - wanted.min(Vec3::ONE)).abs().max_element();
            assert!(error < 0.01 + 0.02 * wanted.max_element(), "{point}: {got}, not {wanted}");
            if added.y > peak.0 {
                peak = (added.y, point);
            }
        }
        assert!(peak.0 > 0.05, "a highlight is seen: {peak:?}");
        brightest.push(peak.1);
    }
    assert!(brightest[0].distance(brightest[1]) > 0.2, "{brightest:?}");
}

#[test]
fn specular_planes_are_made_only_for_scenes_with_highlights() {
    let mut scene = courtyard();
    let camera = before(&scene);
    assert!(image(work(&upload(&scene), "shadows"), &camera).specular.is_none(), "everything is rough");
    scene.materials.iter_mut().for_each(|m| m.roughness = 0.2);
    let on_device = upload(&scene);
    assert!(image(work(&on_device, "unlit"), &camera).specular.is_none(), "nothing is lit");
    let glossy = image(work(&on_device, "shadows"), &camera).specular.expect("planes");
    assert!(glossy.reflectance_srgb8_roughness8.iter().any(|&word| word != 0));
    let lamp = |word: &u32| word >> 8 & 255;
    assert!(glossy.visibility8[0].iter().any(|w| lamp(w) == 255) && glossy.visibility8[0].iter().any(|w| lamp(w) == 0));
}

/// How rough a surface must be for its highlight to be of any height, and that it is never infinite.
#[test]
fn smoothness_makes_highlights_high_but_never_infinite() {
    let camera = PinholeCamera::looking_at(Vec3::Z * 4.0, Vec3::ZERO, Vec3::Y, 0.7, SIZE_PX);
    let mut scene = uv_sphere(1.0, 128);
    let lamp = Light::Point { position_in_world: Vec3::new(0.5, 0.5, 4.0), intensity_linear: Vec3::ONE, radius_m: 0.0 };
    scene.illumination = lamps(vec![lamp]);
    let mut brightest = Vec::new();
    for roughness in [0.9, 0.5, 0.2, 0.05, 0.01, 0.0] {
        scene.materials[0] = scene::Material { roughness, metallic: 1.0, ..scene::Material::default() };
        let seen = view(work(&upload(&scene), "shadows"), &camera);
        let bright = seen.srgb8.iter().filter(|&&code| code > 250).count();
        brightest.push(seen.srgb8.iter().copied().max().unwrap_or(0));
        println!("roughness {roughness}: brightest {:?}, {bright} codes over 250", brightest.last());
    }
    // Higher up to where it slips between pixels; from there on it is a matter of luck, and never more than white.
    assert!(brightest[0] < brightest[1] && brightest[1] < brightest[2], "{brightest:?}");
    assert_eq!(brightest[4], brightest[5], "smoother than the floor counts as the floor");
}

#[test]
fn scenes_without_light_are_black_and_extreme_light_is_finite() {
    let dark = floor_under(&[], Illumination::default());
    let blinding =
        Light::Point { position_in_world: Vec3::Y * 1e-3, intensity_linear: Vec3::splat(1e30), radius_m: 0.0 };
    let bright = floor_under(&[], lamps(vec![blinding]));
    for lighting in ["phong", "shadows", "soft 4, occlusion 4"] {
        let black = image(work(&upload(&dark), lighting), &down_from(3.0));
        assert!(floor_light(&black).iter().all(|(_, l)| *l == 0.0), "{lighting}");
        let white = image(work(&upload(&bright), lighting), &down_from(3.0));
        assert!(floor_light(&white).iter().all(|(_, l)| l.is_finite()), "{lighting}");
        assert!(floor_light(&white).iter().any(|(_, l)| *l > 100.0), "{lighting}");
    }
}

#[test]
fn a_lamp_inside_a_closed_mesh_lights_its_inside_alone() {
    let lamp = Light::Point { position_in_world: Vec3::ZERO, intensity_linear: Vec3::ONE, radius_m: 0.02 };
    let mut scene = uv_sphere(0.5, 48);
    scene.materials[0].double_sided = true;
    scene.illumination = lamps(vec![lamp]);
    let on_device = upload(&scene);
    let outside =
        view(work(&on_device, "soft 4"), &PinholeCamera::looking_at(Vec3::Z * 3.0, Vec3::ZERO, Vec3::Y, 0.7, SIZE_PX));
    assert!(outside.srgb8.iter().all(|&code| code == 0), "none comes out");
    let inside = PinholeCamera::looking_at(Vec3::Z * 0.3, Vec3::NEG_Z, Vec3::Y, 0.7, SIZE_PX);
    assert!(view(work(&on_device, "soft 4"), &inside).srgb8.iter().all(|&code| code > 200), "all of it is lit inside");
}

#[test]
fn a_refitted_tree_finds_the_surfaces_of_a_new_one() {
    let scene: Scene = "tree-terrain-30k-wind"
        .parse::<scene::SceneSpec>()
        .expect("a name")
        .load(&scene::Limits::default(), scene::MissingTextures::Refuse)
        .expect("a scene");
    let camera = before(&scene);
    let moved = upload(&scene);
    let fresh = upload(&scene);
    moved.acceleration(0.0).expect("a tree");
    let refitted = moved.acceleration(0.35).expect("a tree");
    let built = fresh.acceleration(0.35).expect("a tree");
    assert!(refitted.refitted && !built.refitted, "{refitted:?} {built:?}");
    println!("cost of a refitted tree over a new one: {}", refitted.cost / built.cost);
    assert!(refitted.cost / built.cost < 1.3);
    let seen = |scene| {
        let at = DrawWork { scene_time_s: 0.35, visibility: Visibility::Rays, ..work(scene, "shadows") };
        image(at, &camera)
    };
    let a = seen(&moved);
    let b = seen(&fresh);
    let far = |(a, b): (&f32, &f32)| (a - b).abs() > 1e-5 * a.abs().max(1e-3);
    let differ = a.inverse_depth_per_m.iter().zip(&b.inverse_depth_per_m).filter(|pair| far(*pair)).count();
    assert!(differ * 1000 < a.inverse_depth_per_m.len(), "{differ}");
}

#[test]
fn coincident_surfaces_give_the_same_picture_each_time() {
    let scene = floor_under(&[(Vec3::ZERO, 0.5, Vec3::Y)], sky(0.5));
    let on_device = upload(&scene);
    let seen = || image(DrawWork { visibility: Visibility::Rays, ..work(&on_device, "occlusion 4") }, &down_from(3.0));
    let first = seen();
    assert!(first == seen());
    // Neither keeps light off the other: rays begin above both.
    assert!(floor_light(&first).iter().all(|(_, l)| (l - 0.5).abs() < 2e-3));
}

/// One ray a lamp, so that the noise is all there is: a tile's is its image's, not that of another tile.
#[test]
fn tiles_have_the_noise_of_their_image() {
    let scene = upload(&courtyard());
    let camera = before(&courtyard());
    let lit = || work(&scene, "soft 1, occlusion 1");
    let whole = image(lit(), &camera);
    let tiles = (0..3).map(|tile| {
        let tile = Camera::Pinhole(camera).tile(tile, 3);
        image(lit(), tile.reference())
    });
    let tiled = DepthImage::from_tiles(Camera::Pinhole(camera), tiles.collect()).expect("an image");
    let same = whole.color_rgb9e5.iter().zip(&tiled.color_rgb9e5).filter(|(a, b)| a == b).count();
    let share = same as f64 / whole.color_rgb9e5.len() as f64;
    println!("{share:.4} of all texels are lit alike");
    assert!(share > 0.95, "{share}");
}
