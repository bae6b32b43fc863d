//! A regular grid of places on rectangle lamps: closed forms, shadow maps and rays, and the scalar twin.

use depth_image::{Camera, DepthImage, Illumination, LampRig, Light, PinholeCamera, unit_from_oct16};
use glam::{UVec2, Vec2, Vec3};
use render::scalar::{LitPoint, bits_of_lamp, faces, grid_place, seen_in_map};
use render::{DrawWork, GpuScene, LampMaps, RenderError, SamplePlanes, Visibility};
use scene::Scene;
use scene::procedural::tree_terrain;

use crate::stage::{device, down_from, floor_under, image, upload, work};

const SIDE: u32 = 8;
const HALF_LAMP_M: f32 = 0.5;
const LAMP_HEIGHT_M: f32 = 2.0;
const BLOCKER_HEIGHT_M: f32 = 1.0;
const HALF_BLOCKER_M: f32 = 0.25;

fn lamp(center_in_world: Vec3, half_m: f32) -> Light {
    let half_edges_in_world = [Vec3::X * half_m, Vec3::Z * half_m];
    Light::Rectangle { center_in_world, half_edges_in_world, radiance_linear: Vec3::ONE }
}

fn lit_by(lights: Vec<Light>) -> Illumination {
    Illumination { lights, ..Illumination::default() }
}

/// A floor under a square blocker under a square lamp that is twice as wide and as high.
fn blocked_floor() -> Scene {
    let light = lamp(Vec3::Y * LAMP_HEIGHT_M, HALF_LAMP_M);
    floor_under(&[(Vec3::Y * BLOCKER_HEIGHT_M, HALF_BLOCKER_M, Vec3::Y)], lit_by(vec![light]))
}

/// Sees the floor from below the blocker.
fn below() -> PinholeCamera {
    let camera = PinholeCamera::looking_at(Vec3::Y * 0.9, Vec3::ZERO, Vec3::NEG_Z, 1.6, UVec2::new(96, 72));
    PinholeCamera { near_m: 0.05, ..camera }
}

fn place_in_world(light: &Light, place: Vec2) -> Vec3 {
    let &Light::Rectangle { center_in_world, half_edges_in_world: [u, v], .. } = light else { panic!("a rectangle") };
    let square = place * 2.0 - 1.0;
    center_in_world + u * square.x + v * square.y
}

fn bits(work: DrawWork<'_>, camera: &PinholeCamera) -> Vec<u32> {
    device().1.draw_lamp_bits(work, camera).expect("bits")
}

/// The points of an image with their pixels.
fn points(image: &DepthImage, camera: &PinholeCamera) -> Vec<(usize, LitPoint)> {
    let normals = image.normal_oct16.as_ref().expect("normals");
    let lit = image.inverse_depth_per_m.iter().enumerate().filter(|(_, inverse)| **inverse > 0.0);
    let points = lit.map(|(pixel, inverse)| {
        let place = UVec2::new(pixel as u32 % camera.size_px.x, pixel as u32 / camera.size_px.x);
        let point_in_world = camera.ray(place.as_vec2() + 0.5).at(inverse.recip());
        (pixel, LitPoint { point_in_world, normal_in_world: unit_from_oct16(normals[pixel]) })
    });
    points.collect()
}

#[test]
fn a_square_blocker_hides_the_places_that_geometry_says() {
    let scene = blocked_floor();
    let light = scene.illumination.lights[0];
    let on_device = upload(&scene);
    let camera = below();
    let shown = image(work(&on_device, "unlit"), &camera);
    // A texel of a map, as it is on the blocker's plane, lies on the lamp's other side in the shadow.
    let texel_m = 2.0 * (1.0 + HALF_LAMP_M) / 1024.0;
    for (lighting, margin_m) in [("soft 8x8", 1e-3), ("soft 8x8 by maps", 1.5 * texel_m)] {
        let words = bits(work(&on_device, lighting), &camera);
        let mut blocked = 0;
        for (pixel, lit) in points(&shown, &camera) {
            for (number, open) in (0..).zip(bits_of_lamp(&words, SIDE, 1, 0, pixel)) {
                let from = place_in_world(&light, grid_place(SIDE, number));
                let crossing = from.lerp(lit.point_in_world, (LAMP_HEIGHT_M - BLOCKER_HEIGHT_M) / LAMP_HEIGHT_M);
                let beyond_edge_m = crossing.x.abs().max(crossing.z.abs()) - HALF_BLOCKER_M;
                blocked += u32::from(!open);
                if beyond_edge_m.abs() > margin_m {
                    assert_eq!(open, beyond_edge_m > 0.0, "{lighting}, {:?}, {beyond_edge_m}", lit.point_in_world);
                }
            }
        }
        assert!(blocked > 1000, "{lighting}: {blocked}");
    }
}

#[test]
fn half_of_the_lamp_lights_the_shadows_edge() {
    let on_device = upload(&blocked_floor());
    // The lamp's middle shines past the blocker's edge to twice its distance from the axis.
    let edge = Vec3::new(2.0 * HALF_BLOCKER_M, 0.0, 0.0);
    let camera = below();
    let pixel = camera.project(edge).expect("a pixel").pixel.as_uvec2();
    for lighting in ["soft 16x16", "soft 16x16 by maps"] {
        let words = bits(work(&on_device, lighting), &camera);
        let open = bits_of_lamp(&words, 16, 1, 0, (pixel.y * camera.size_px.x + pixel.x) as usize);
        let share = open.filter(|open| *open).count() as f32 / 256.0;
        assert!((share - 0.5).abs() <= 1.0 / 16.0 + 0.01, "{lighting}: {share}");
    }
}

#[test]
fn maps_are_asked_as_the_twin_asks_them() {
    const MAP_PX: u32 = 256;
    let mut scene = tree_terrain(30_000, 1);
    let bounds = scene.bounds();
    let light = lamp(bounds.center() + Vec3::Y * bounds.size().length(), 0.3 * bounds.size().length());
    scene.illumination = lit_by(vec![light]);
    let on_device = upload(&scene);
    let camera = PinholeCamera {
        size_px: UVec2::new(64, 48),
        ..PinholeCamera::looking_at(bounds.center() + bounds.size(), bounds.center(), Vec3::Y, 0.6, UVec2::new(64, 48))
    };
    let with_maps = DrawWork {
        visibility: Visibility::Rays,
        lamp_maps: LampMaps { side_px: MAP_PX, ..LampMaps::default() },
        ..work(&on_device, "soft 4x4 by maps")
    };
    let words = bits(with_maps, &camera);
    let shown = image(DrawWork { visibility: Visibility::Rays, ..work(&on_device, "unlit") }, &camera);
    let rig = LampRig::new(&light, bounds, MAP_PX).expect("a rig");
    let cameras: Vec<PinholeCamera> = (0..16).map(|number| rig.camera(grid_place(4, number))).collect();
    let maps = maps(&on_device, &cameras);
    let mut asked = 0;
    let mut differ = 0;
    let mut blocked = 0;
    for (pixel, lit) in points(&shown, &camera) {
        let seen = cameras.iter().zip(&maps).zip(bits_of_lamp(&words, 4, 1, 0, pixel));
        for ((camera, map), open) in seen {
            let faced = faces(&light, lit, camera.eye_in_world);
            let expected = seen_in_map(camera, &map.inverse_depth_per_m, lit).map(|seen| seen && faced);
            asked += 1;
            differ += usize::from(expected != Some(open));
            blocked += usize::from(!open);
        }
    }
    assert!(asked > 10_000 && blocked > asked / 20 && blocked < asked, "{blocked} of {asked}");
    assert!(differ * 1000 <= asked, "{differ} of {asked} differ");
}

/// What cameras see from both sides.
fn maps(scene: &GpuScene, cameras: &[PinholeCamera]) -> Vec<DepthImage> {
    let both = DrawWork { both_faces: true, ..work(scene, "unlit") };
    let cameras: Vec<Camera> = cameras.iter().copied().map(Camera::Pinhole).collect();
    device().1.draw_depth_images(both, &cameras, SamplePlanes::default()).expect("maps")
}

/// Light by maps is that of rays but for the bias, in steps and at several positions in a pixel, too.
#[test]
fn light_by_maps_is_nearly_that_of_rays() {
    let on_device = upload(&blocked_floor());
    let camera = below();
    let by_rays = image(work(&on_device, "soft 8x8"), &camera);
    let by_maps = image(work(&on_device, "soft 8x8 by maps"), &camera);
    let far = |a: &u32, b: &u32| {
        let [a, b] = [*a, *b].map(depth_image::linear_from_rgb9e5);
        (a - b).abs().max_element() > 0.05
    };
    let differ = by_rays.color_rgb9e5.iter().zip(&by_maps.color_rgb9e5).filter(|(a, b)| far(a, b)).count();
    assert!(differ * 100 < by_rays.color_rgb9e5.len(), "{differ}");
    assert_eq!(by_rays.inverse_depth_per_m, by_maps.inverse_depth_per_m);
    let steps = 4;
    let refined: Vec<DepthImage> = (0..steps)
        .map(|step| {
            let refinement = render::Refinement { step, steps };
            image(DrawWork { refinement, ..work(&on_device, "soft 8x8 by maps") }, &camera)
        })
        .collect();
    assert!(refined[0].color_rgb9e5 != by_maps.color_rgb9e5, "the first step has few places");
    assert!(refined[steps as usize - 1].color_rgb9e5 == by_maps.color_rgb9e5, "the last step has all");
}

#[test]
fn a_lamp_in_the_midst_of_the_scene_asks_rays_where_maps_end() {
    // Its plane cuts the blocker's stand: maps see 80° to each side.
    let mut scene = floor_under(
        &[(Vec3::new(0.4, 0.3, 0.0), 0.3, Vec3::X), (Vec3::Y * 0.2, 0.05, Vec3::Y)],
        lit_by(vec![lamp(Vec3::Y * 0.3, 0.05)]),
    );
    let camera = down_from(3.0);
    let by_rays = image(work(&upload(&scene), "soft 4x4"), &camera);
    let by_maps = image(work(&upload(&scene), "soft 4x4 by maps"), &camera);
    let far = |a: &u32, b: &u32| {
        let [a, b] = [*a, *b].map(depth_image::linear_from_rgb9e5);
        !a.is_finite() || !b.is_finite() || (a - b).abs().max_element() > 0.05
    };
    let differ = by_rays.color_rgb9e5.iter().zip(&by_maps.color_rgb9e5).filter(|(a, b)| far(a, b)).count();
    assert!(differ * 50 < by_rays.color_rgb9e5.len(), "{differ}");
    // A lamp that shines away lights nothing, by any answer.
    scene.illumination = lit_by(vec![lamp(Vec3::NEG_Y, 0.5)]);
    let away = upload(&scene);
    let [rays, maps] = ["soft 4x4", "soft 4x4 by maps"].map(|lighting| image(work(&away, lighting), &camera));
    assert!(rays.color_rgb9e5 == maps.color_rgb9e5);
}

#[test]
fn light_by_samples_or_cube_without_them_is_refused() {
    let on_device = upload(&blocked_floor());
    for lighting in ["soft 4x4 by samples", "soft 4x4 by cube"] {
        let drawn = device().1.draw_lamp_bits(work(&on_device, lighting), &below());
        assert!(matches!(drawn, Err(RenderError::LampSamples { .. })), "{lighting}");
    }
}
