//! Layered light fields: the light of all surfaces on the lines of many directions, towards each.

use depth_image::{
    Aabb, Environment, LayeredLightField, Light, LightDirections, LightFieldCamera, ParallelCamera, PinholeCamera,
    PixelDepth, Reflector, SampleCamera, environment_reflectance_linear, linear_from_rgb9e5,
};
use fixtures::{mirror_box, quad, teapot_mirror, uv_sphere};
use glam::{Affine3A, UVec2, Vec3};
use render::{GpuScene, LayerSelection, scalar};
use scene::{Material, Scene};

use crate::layered::fronts;
use crate::reflections::{code_of, floor_mirror, glowing, linear_at, mirror, of_parts, view_of};
use crate::stage::{device, lamps, upload, work};

const MIRRORED: &str = "shadows, reflections 2";

/// A sample, where it lies, and what it sends to its direction.
struct LightSample {
    point_in_world: Vec3,
    radiance_linear: Vec3,
}

/// The lines of a direction, and the samples of each.
struct Direction {
    towards: Vec3,
    lines: ParallelCamera,
    samples: Vec<Vec<LightSample>>,
}

fn around(scene: &Scene, side_px: u32) -> LightFieldCamera {
    LightFieldCamera::around(scene.bounds(), LightDirections::D66, side_px)
}

fn drawn(scene: &GpuScene, camera: &LightFieldCamera, lighting: &str) -> LayeredLightField {
    let field = device().1.draw_light_field(work(scene, lighting), camera).expect("a light field");
    assert_eq!(field.validate(), Ok(()));
    field
}

fn directions(field: &LayeredLightField) -> Vec<Direction> {
    let lines_of_one = (field.camera.side_px * field.camera.side_px) as usize;
    let direction = |(number, towards): (usize, Vec3)| {
        let lines = field.camera.lines(towards);
        let first = number * lines_of_one;
        let samples = (0..lines_of_one).map(|line| samples_of(field, &lines, [first, line])).collect();
        Direction { towards, lines, samples }
    };
    field.camera.directions.all().iter().map(|direction| direction.towards).enumerate().map(direction).collect()
}

fn samples_of(field: &LayeredLightField, lines: &ParallelCamera, [first, line]: [usize; 2]) -> Vec<LightSample> {
    let own = field.first[first + line] as usize..field.first[first + line + 1] as usize;
    let sample = |sample: usize| LightSample {
        point_in_world: lines.unproject(PixelDepth {
            pixel: pixel_of(lines, line).as_vec2() + 0.5,
            planar_depth_m: field.planar_depth_m[sample],
        }),
        radiance_linear: linear_from_rgb9e5(field.radiance_rgb9e5[sample]),
    };
    own.map(sample).collect()
}

fn pixel_of(lines: &ParallelCamera, line: usize) -> UVec2 {
    UVec2::new(line as u32 % lines.size_px.x, line as u32 / lines.size_px.x)
}

fn all_samples(directions: &[Direction]) -> impl Iterator<Item = (Vec3, &LightSample)> {
    directions.iter().flat_map(|d| d.samples.iter().flatten().map(|sample| (d.towards, sample)))
}

/// Noise follows from a sample's point: it is the same in each tile.
#[test]
fn tiles_are_the_whole_to_the_bit() {
    let scene = teapot_mirror();
    let on_device = upload(&scene);
    let camera = around(&scene, 24);
    let lighting = "soft 4, occlusion 4, reflections 2";
    let whole = drawn(&on_device, &camera, lighting);
    for count in [2, 5, 33] {
        let tile = |number| *SampleCamera::from(camera).tile(number, count).light_field().expect("a light field");
        let tiles: Vec<_> = (0..count).map(|number| drawn(&on_device, &tile(number), lighting)).collect();
        assert!(tiles.iter().all(|tile| tile.sample_count() > 0), "{count}");
        let joined = LayeredLightField::from_tiles(camera, &tiles).expect("tiles of the whole");
        assert_eq!((joined.sample_count(), &joined.first), (whole.sample_count(), &whole.first), "{count}");
        assert!(joined == whole, "{count}: samples differ");
    }
    println!("{} samples", whole.sample_count());
    assert!(whole.sample_count() > 5000, "{}", whole.sample_count());
}

#[test]
fn a_mirror_sends_what_its_mirrored_rays_meet() {
    let glow = 0.5;
    let sky = 0.1;
    let height_m = 2.0;
    let half_m = 1.0;
    let bright = Material { base_color_linear: [glow, glow, glow, 1.0], ..glowing() };
    let plate = quad(Vec3::Y * height_m, half_m, Vec3::NEG_Y, [255; 3]);
    let mut scene = of_parts(vec![floor_mirror(0.9), (plate, bright, Affine3A::IDENTITY)]);
    scene.illumination.environment = Environment::uniform(Vec3::splat(sky));
    let reflector = Reflector { reflectance_linear: Vec3::splat(0.9), roughness: 0.0 };
    let field = directions(&drawn(&upload(&scene), &around(&scene, 32), "shadows, reflections 2"));
    let mut by_end = [0; 2];
    let mut farthest_off = 0.0_f32;
    for (towards, sample) in all_samples(&field) {
        let LightSample { point_in_world: point, radiance_linear: radiance } = sample;
        if point.y > 1.0 {
            assert!(towards.y < 0.0 && radiance.abs_diff_eq(Vec3::splat(glow), 0.002), "the plate: {radiance}");
            continue;
        }
        assert!(towards.y > 0.0 && point.y.abs() < 1e-4, "the floor: {point}");
        let mirrored = (-towards).reflect(Vec3::Y);
        let in_plate = (point + mirrored * (height_m / mirrored.y)).with_y(0.0).abs();
        let inside_m = half_m - in_plate.max_element();
        if inside_m.abs() < 0.01 {
            continue;
        }
        let arriving = if inside_m > 0.0 { glow } else { sky };
        let expected = environment_reflectance_linear(Vec3::Y, towards, &reflector) * arriving;
        by_end[usize::from(inside_m > 0.0)] += 1;
        farthest_off = farthest_off.max((radiance / expected - 1.0).abs().max_element());
    }
    println!("{} samples show the sky, {} the plate; off by {farthest_off}", by_end[0], by_end[1]);
    assert!(by_end.into_iter().all(|count| count > 500), "{by_end:?}");
    assert!(farthest_off < 0.01, "{farthest_off}");
}

#[test]
fn samples_of_a_direction_are_the_surfaces_that_its_twins_rays_meet() {
    let scene = teapot_mirror();
    let on_device = upload(&scene);
    let twin = scalar::rays::Scene::of(&on_device, 0.0).expect("a tree");
    let field = directions(&drawn(&on_device, &around(&scene, 16), "shadows, reflections 1"));
    let mut same = 0;
    let mut met = 0;
    for Direction { lines, samples, .. } in &field {
        for (line, found) in samples.iter().enumerate() {
            let ray = lines.ray(pixel_of(lines, line).as_vec2() + 0.5);
            let expected = fronts(&twin, ray, lines.range_m);
            let is_near = |(sample, &depth_m): (&LightSample, &f32)| {
                sample.point_in_world.distance(ray.at(depth_m)) < 2e-3 * lines.range_m
            };
            met += usize::from(!expected.is_empty());
            same += usize::from(
                !expected.is_empty() && found.len() == expected.len() && found.iter().zip(&expected).all(is_near),
            );
            assert!(!expected.is_empty() || found.len() < 2, "{line}: {} surfaces", found.len());
        }
    }
    println!("{same} of {met} lines");
    assert!(same * 100 >= met * 98 && met > 3000, "{same} of {met}");
}

/// The opposite direction counts columns and depths from their other ends.
#[test]
fn two_opposite_directions_have_each_surface_once() {
    let scene = mirror_box();
    let on_device = upload(&scene);
    let field = directions(&drawn(&on_device, &around(&scene, 16), "shadows, reflections 1"));
    let mut sides = [0; 2];
    for pair in field.chunks(2) {
        let Direction { towards, lines, samples } = &pair[0];
        let all = device().1.draw_layers(work(&on_device, "unlit"), lines, LayerSelection::All).expect("layers");
        for (line, found) in samples.iter().enumerate() {
            let pixel = pixel_of(lines, line);
            let point = |sample: usize| {
                let planar_depth_m = all.planar_depth_m[sample];
                lines.unproject(PixelDepth { pixel: pixel.as_vec2() + 0.5, planar_depth_m })
            };
            let faces = |&sample: &usize| all.plane_normal_in_world(sample).dot(*towards) > 0.0;
            let (own, others): (Vec<usize>, Vec<usize>) = all.line(line).partition(faces);
            let opposite = (pixel.y * lines.size_px.x + lines.size_px.x - 1 - pixel.x) as usize;
            assert!(lie_at(found.iter(), own.into_iter().map(point)), "{towards}, {line}");
            let found_there = pair[1].samples[opposite].iter();
            sides[0] += found.len();
            sides[1] += found_there.len();
            assert!(lie_at(found_there.rev(), others.into_iter().map(point)), "against {towards}, {line}");
        }
    }
    println!("{sides:?} surfaces");
    assert!(sides.into_iter().all(|count| count > 2000), "{sides:?}");
}

fn lie_at<'a>(
    samples: impl ExactSizeIterator<Item = &'a LightSample>,
    points: impl ExactSizeIterator<Item = Vec3>,
) -> bool {
    samples.len() == points.len()
        && samples.zip(points).all(|(sample, point)| sample.point_in_world.distance(point) < 1e-4)
}

#[test]
fn a_matt_scene_and_lighting_without_mirrors_have_no_samples() {
    let matt = uv_sphere(1.0, 32);
    let mirrors = mirror_box();
    for (scene, lighting, is_empty) in [
        (&matt, "shadows, reflections 1", true),
        (&matt, "shadows, glossy 1", true),
        (&mirrors, "shadows", true),
        (&mirrors, "soft 2, occlusion 2", true),
        (&mirrors, "shadows, reflections 1", false),
        (&mirrors, "shadows, glossy 1", false),
    ] {
        let camera = around(scene, 16);
        let field = drawn(&upload(scene), &camera, lighting);
        assert_eq!(field.sample_count() == 0, is_empty, "{} by {lighting}", scene.name);
        assert_eq!(field.first.len(), camera.line_count() + 1);
    }
}

/// A rough ball and a matt one over a floor that mirrors them, under a lamp.
fn balls_over_a_mirror() -> Scene {
    let rough = Material { roughness: 0.4, ..mirror(0.6) };
    let ball = |x: f32, material| (uv_sphere(0.8, 128), material, Affine3A::from_translation(Vec3::new(x, 1.2, 0.0)));
    let mut scene = of_parts(vec![floor_mirror(0.8), ball(-1.0, rough), ball(1.0, Material::default())]);
    let position_in_world = Vec3::new(1.5, 5.0, 2.0);
    let lamp = Light::Point { position_in_world, intensity_linear: Vec3::splat(9.0), radius_m: 0.0 };
    scene.illumination = lamps(vec![lamp]);
    scene.illumination.environment = Environment::uniform(Vec3::splat(0.1));
    scene
}

/// Codes between what samples send to a direction and what a view from far away shows there; none of what it does not see.
fn codes_off(scene: &GpuScene, direction: &Direction, bounds: &Aabb) -> Vec<Vec<Option<f32>>> {
    let far_m = 400.0;
    let side_px = 256;
    let towards = direction.towards;
    let eye = bounds.center() + towards * far_m;
    let across = towards.any_orthonormal_vector();
    let fov_rad = bounds.size().length() / far_m;
    let camera = PinholeCamera::looking_at(eye, bounds.center(), across, fov_rad, UVec2::splat(side_px));
    let view = view_of(scene, MIRRORED, &camera);
    let inverse_depth_per_m = view.inverse_depth_per_m.as_ref().expect("depth");
    let off = |LightSample { point_in_world, radiance_linear }: &LightSample| {
        let at = camera.project(*point_in_world).filter(|at| camera.contains(at.pixel))?;
        let pixel = at.pixel.as_uvec2();
        let seen_m = inverse_depth_per_m[(pixel.y * side_px + pixel.x) as usize].recip();
        let codes = (code_of(linear_at(&view, pixel)) - code_of(*radiance_linear)).abs().max_element();
        ((seen_m - at.planar_depth_m).abs() < 0.05).then_some(codes)
    };
    direction.samples.iter().map(|line| line.iter().map(off).collect()).collect()
}

#[test]
fn a_sample_sends_what_is_seen_of_its_surface_from_afar() {
    let scene = balls_over_a_mirror();
    let on_device = upload(&scene);
    let bounds = scene.bounds();
    let camera = around(&scene, 56);
    // Without rays mirrors show the sky alone.
    let [field, without_rays] =
        [MIRRORED, "shadows, glossy 1"].map(|lighting| directions(&drawn(&on_device, &camera, lighting)));
    let mut off = [Vec::new(), Vec::new()];
    // The floor is not seen from below.
    for (own, plain) in field.iter().zip(&without_rays).filter(|(d, _)| d.towards.y > 0.2).step_by(3) {
        let samples = own.samples.iter().flatten().zip(plain.samples.iter().flatten());
        for ((sample, plain), codes) in samples.zip(codes_off(&on_device, own, &bounds).into_iter().flatten()) {
            let is_mirror = sample.point_in_world.y.abs() < 1e-3;
            let shows_balls = !sample.radiance_linear.abs_diff_eq(plain.radiance_linear, 0.01);
            let Some(codes) = codes.filter(|_| !is_mirror || shows_balls) else { continue };
            off[usize::from(is_mirror)].push(codes);
        }
    }
    for (what, mut codes) in ["balls", "balls in the mirror"].into_iter().zip(off) {
        codes.sort_by(f32::total_cmp);
        let [median, most] = [codes.len() / 2, codes.len() * 9 / 10].map(|place| codes[place]);
        println!("{what}: median {median}, of nine tenths {most} codes, over {} samples", codes.len());
        assert!(codes.len() > 300 && median < 1.5 && most < 8.0, "{what}: {median} {most} {}", codes.len());
    }
}

/// A damaged camera is refused before anything is drawn.
#[test]
fn a_camera_that_cannot_be_used_is_refused() {
    let scene = mirror_box();
    let on_device = upload(&scene);
    let good = around(&scene, 16);
    for camera in [
        LightFieldCamera { side_px: 15, ..good },
        LightFieldCamera { first_pair: 33, ..good },
        LightFieldCamera { bounds: Aabb::EMPTY, ..good },
    ] {
        let refused = device().1.draw_light_field(work(&on_device, "shadows, reflections 1"), &camera);
        assert!(matches!(refused, Err(render::RenderError::Camera { index: 0, .. })), "{camera:?}");
    }
}
