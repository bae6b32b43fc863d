//! Light that depends on the viewer: against its closed form at the true point, and against the scalar twin.

use std::sync::Arc;

use depth_image::{
    Aabb, Camera, DepthImage, Environment, EnvironmentMap, Highlight, Illumination, Light, PinholeCamera,
    ProvenanceKind, Ray, Reflector, SpecularPlanes, View, ViewPlanes, highlight_linear, oct16_from_unit,
    rgb9e5_from_linear, srgb8_from_linear,
};
use glam::{UVec2, Vec2, Vec3};
use gpu::{GpuEnvironment, Turn};
use reconstruction::{ReconstructionError, SetDescription, scalar};

use crate::stage::{
    Agreement, CARVE, Corners, SEARCH, VIEW_PX, assert_sane, colors_differ_by, count, gpu, kinds, reconstruct,
    reconstructor,
};

const KINDS: [Highlight; 2] = [Highlight::BlinnPhong, Highlight::Ggx];
const BASE_LINEAR: Vec3 = Vec3::new(0.05, 0.1, 0.15);
const SAMPLE_PX: UVec2 = UVec2::new(200, 150);

/// A wall through the origin, and a ball before it.
#[derive(Clone)]
struct Room {
    ball_m: f32,
    wall: Reflector,
    ball: Reflector,
    illumination: Illumination,
    /// A sample sees a light only where this is above 0, at its place and of the light's number.
    lit: Option<fn(Vec3, usize) -> f32>,
}

const BALL_AT: Vec3 = Vec3::new(0.3, 0.2, 0.6);
const MATT: Reflector = Reflector { reflectance_linear: Vec3::ZERO, roughness: 0.0 };
const SATIN: Reflector = Reflector { reflectance_linear: Vec3::new(0.5, 0.3, 0.2), roughness: 0.4 };

struct Met {
    t: f32,
    point: Vec3,
    normal: Vec3,
    reflector: Reflector,
}

fn lamp(position_in_world: Vec3) -> Light {
    Light::Point { position_in_world, intensity_linear: Vec3::splat(0.8), radius_m: 0.05 }
}

fn lamps(count: usize) -> Illumination {
    let places = [(0.4, 0.5), (-0.6, 0.3), (0.0, -0.7), (0.8, 0.0), (-0.3, -0.3)];
    let lights = places.iter().take(count).map(|&(x, y)| lamp(Vec3::new(x, y, 1.5))).collect();
    let environment = Environment::gradient(Vec3::splat(0.2), Vec3::splat(0.05));
    Illumination { lights, environment }
}

fn wall_only() -> Room {
    Room { ball_m: 0.0, wall: SATIN, ball: SATIN, illumination: lamps(2), lit: None }
}

fn corners() -> Corners {
    Corners { eye: Vec3::new(0.1, 0.2, 3.0), target: Vec3::ZERO, half_m: 0.4 }
}

impl Room {
    fn meet(&self, ray: &Ray) -> Met {
        let origin = ray.origin_in_world - BALL_AT;
        let direction = ray.direction_in_world;
        let a = direction.length_squared();
        let b = origin.dot(direction);
        let root = b * b - a * (origin.length_squared() - self.ball_m * self.ball_m);
        if self.ball_m > 0.0 && root > 0.0 {
            let t = (-b - root.sqrt()) / a;
            let point = ray.at(t);
            return Met { t, point, normal: (point - BALL_AT).normalize_or_zero(), reflector: self.ball };
        }
        let t = -ray.origin_in_world.z / direction.z;
        Met { t, point: ray.at(t), normal: Vec3::Z, reflector: self.wall }
    }

    fn share(&self, point: Vec3, place: usize) -> f32 {
        self.lit.map_or(1.0, |lit| lit(point, place))
    }

    fn image(&self, camera: &PinholeCamera) -> DepthImage {
        let met: Vec<Met> = pixels(camera.size_px).map(|pixel| self.meet(&camera.ray(pixel))).collect();
        let planes = SpecularPlanes::visibility_planes(self.illumination.lights.len());
        let byte = |point, place| u32::from((self.share(point, place) * 255.0).round() as u8);
        let word = |point, plane: usize| (0..4).map(|i| byte(point, 4 * plane + i) << (8 * i)).sum();
        let visibility8 = (0..planes).map(|plane| met.iter().map(|m| word(m.point, plane)).collect());
        DepthImage {
            camera: Camera::Pinhole(*camera),
            inverse_depth_per_m: met.iter().map(|m| m.t.recip()).collect(),
            color_rgb9e5: vec![rgb9e5_from_linear(BASE_LINEAR); met.len()],
            normal_oct16: Some(met.iter().map(|m| oct16_from_unit(m.normal)).collect()),
            surface_id: None,
            specular: Some(SpecularPlanes {
                reflectance_srgb8_roughness8: met.iter().map(|m| m.reflector.pack()).collect(),
                visibility8: if self.lit.is_some() { visibility8.collect() } else { Vec::new() },
            }),
            passed: None,
            corner_inverse_depth_per_m: None,
            light: None,
        }
    }

    fn images(&self) -> Vec<DepthImage> {
        let at = |x, y| self.image(&corners().camera(x, y, SAMPLE_PX));
        [(-1.0, -1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0)].map(|(x, y)| at(x, y)).to_vec()
    }

    fn description(&self, highlight: Option<Highlight>) -> SetDescription<'_> {
        let volume = Aabb { min: Vec3::new(-4.0, -4.0, 0.0), max: Vec3::new(4.0, 4.0, 1.2) };
        SetDescription {
            volume,
            background: Environment::default(),
            illumination: &self.illumination,
            highlight,
            environment: None,
            mips: false,
        }
    }

    /// The colour of a view's pixel, as an eye sees it.
    fn expected(&self, kind: Highlight, camera: &PinholeCamera, eye: Vec3, pixel: Vec2) -> [u8; 3] {
        let met = self.meet(&camera.ray(pixel));
        let reflector = Reflector::unpack(met.reflector.pack()).expect("a reflector");
        let towards_eye = (eye - met.point).normalize_or_zero();
        let share = |place| self.share(met.point, place);
        let added = highlight_linear(kind, &self.illumination, &share, met.point, met.normal, towards_eye, &reflector);
        (BASE_LINEAR + added).to_array().map(srgb8_from_linear)
    }
}

fn pixels(size_px: UVec2) -> impl Iterator<Item = Vec2> {
    (0..size_px.y).flat_map(move |y| (0..size_px.x).map(move |x| Vec2::new(x as f32, y as f32) + 0.5))
}

fn view(images: &[DepthImage], set: &SetDescription<'_>, camera: &PinholeCamera) -> View {
    let set = reconstructor().upload(images, set, Turn::default()).expect("a sample set");
    reconstruct(&set, &[*camera], CARVE, ViewPlanes::ALL).expect("a view").remove(0)
}

/// Share of the pixels within two codes of what `eye` would see there.
fn share_as_seen_from(room: &Room, kind: Highlight, camera: &PinholeCamera, eye: Vec3, seen: &View) -> f32 {
    let close = pixels(camera.size_px).zip(seen.srgb8.as_chunks::<3>().0).filter(|(pixel, found)| {
        let expected = room.expected(kind, camera, eye, *pixel);
        (0..3).all(|c| expected[c].abs_diff(found[c]) <= 2)
    });
    close.count() as f32 / camera.size_px.element_product() as f32
}

fn brightest_px(seen: &View) -> Vec2 {
    let brightest = seen.srgb8.as_chunks::<3>().0.iter().map(|rgb| u32::from(rgb[0])).max();
    let mut sum = Vec2::ZERO;
    let mut number = 0.0;
    for (pixel, rgb) in pixels(seen.size_px).zip(seen.srgb8.as_chunks::<3>().0) {
        if Some(u32::from(rgb[0])) == brightest {
            (sum, number) = (sum + pixel, number + 1.0);
        }
    }
    sum / number
}

#[test]
fn each_eye_sees_its_own_highlight() {
    let room = Room { illumination: lamps(1), ..wall_only() };
    let images = room.images();
    for kind in KINDS {
        let set = room.description(Some(kind));
        let mut places = Vec::new();
        for x in [-0.8, 0.0, 0.8] {
            let camera = corners().camera(x, 0.1, VIEW_PX);
            let seen = view(&images, &set, &camera);
            assert_eq!(count(&seen, ProvenanceKind::Hit), kinds(&seen).len(), "the wall is everywhere");
            let own = share_as_seen_from(&room, kind, &camera, camera.eye_in_world, &seen);
            // The nearest sample's highlight, as if it had been baked into its colours.
            let baked = *images[usize::from(x > 0.0) * 2].camera.reference();
            let others = share_as_seen_from(&room, kind, &camera, baked.eye_in_world, &seen);
            println!("{kind:?} at {x}: {own:.4} as seen from there, {others:.4} as seen from a sample");
            assert!(own > 0.995 && others < 0.9, "{kind:?} at {x}: {own} {others}");
            let met = room.meet(&camera.ray(brightest_px(&seen)));
            places.push(met.point.x);
        }
        // On a flat mirror it goes the lamp's way: by lamp/(lamp + eye) of the eye's move.
        assert!(places.is_sorted() && places[2] - places[0] > 0.1, "{kind:?}: {places:?}");
    }
}

#[test]
fn a_surface_in_shadow_does_not_shine() {
    let room = Room {
        illumination: lamps(5),
        lit: Some(|point, place| if (place % 2 == 0) == (point.x > 0.1) { 1.0 } else { 0.0 }),
        ..wall_only()
    };
    let camera = corners().camera(0.3, -0.2, VIEW_PX);
    for kind in KINDS {
        let seen = view(&room.images(), &room.description(Some(kind)), &camera);
        let own = share_as_seen_from(&room, kind, &camera, camera.eye_in_world, &seen);
        let open = Room { lit: None, ..room.clone() };
        let unshadowed = share_as_seen_from(&open, kind, &camera, camera.eye_in_world, &seen);
        println!("{kind:?}: {own:.4} with shadows, {unshadowed:.4} without");
        // A column of pixels lies on the shadow's edge.
        assert!(own > 0.97 && unshadowed < 0.8, "{kind:?}: {own} {unshadowed}");
    }
}

fn with_ball() -> Room {
    Room { ball_m: 0.35, ..wall_only() }
}

#[test]
fn highlights_are_the_twins() {
    let soft = |point: Vec3, place: usize| (0.5 + point.x + 0.1 * place as f32).clamp(0.0, 1.0);
    let rooms = [
        ("satin", with_ball()),
        ("ball only", Room { wall: MATT, lit: Some(soft), ..with_ball() }),
        ("wall only", Room { ball: MATT, lit: Some(soft), illumination: lamps(5), ..with_ball() }),
        ("no lamp", Room { illumination: lamps(0), ..with_ball() }),
    ];
    let mut bad = Vec::new();
    let camera = corners().camera(0.23, -0.31, VIEW_PX);
    for (name, room) in rooms {
        let mut images = room.images();
        // Some samples are missing.
        images[0].inverse_depth_per_m[4000..4100].fill(depth_image::HOLE_INVERSE_DEPTH);
        for (kind, method) in [(KINDS[0], CARVE), (KINDS[1], CARVE), (KINDS[1], SEARCH)] {
            let set = room.description(Some(kind));
            let uploaded = reconstructor().upload(&images, &set, Turn::default()).expect("a sample set");
            let seen = reconstruct(&uploaded, &[camera], method, ViewPlanes::ALL).expect("a view").remove(0);
            let twin = scalar::reconstruct(&images, &set, &camera, method);
            let agreement = Agreement::of(&seen, &twin);
            let matt = scalar::reconstruct(&images, &room.description(None), &camera, method);
            let shining = (0..kinds(&twin).len()).filter(|&i| colors_differ_by(&twin, &matt, i) > 2).count();
            println!("{name:<10} {kind:?} {method}: {agreement:?}, {shining} pixels shine");
            let dark = room.illumination.lights.is_empty() && kind == Highlight::BlinnPhong;
            bad.extend((!agreement.is_good() || (shining < 20 && !dark)).then(|| format!("{name} {kind:?} {method}")));
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

#[test]
fn filled_pixels_do_not_shine() {
    let room = with_ball();
    // From the left only: what is right of the ball is hidden.
    let images = vec![room.image(&corners().camera(-1.0, 0.0, SAMPLE_PX))];
    let camera = corners().camera(1.0, 0.0, VIEW_PX);
    let seen = view(&images, &room.description(Some(Highlight::Ggx)), &camera);
    let matt = view(&images, &room.description(None), &camera);
    assert!(seen.provenance == matt.provenance && seen.inverse_depth_per_m == matt.inverse_depth_per_m);
    let kinds = kinds(&seen);
    let of = |kind| (0..kinds.len()).filter(|&i| kinds[i] == kind).collect::<Vec<_>>();
    let filled = of(ProvenanceKind::Filled);
    let hit = of(ProvenanceKind::Hit);
    assert!(filled.len() > 30, "{} pixels are filled", filled.len());
    assert!(filled.iter().all(|&i| colors_differ_by(&seen, &matt, i) == 0));
    let shining = hit.iter().filter(|&&i| colors_differ_by(&seen, &matt, i) > 2).count();
    assert!(shining > 1000, "{shining} pixels shine");
}

#[test]
fn matt_surfaces_stay_as_they_are() {
    let room = Room { wall: MATT, ball: MATT, ..with_ball() };
    let camera = corners().camera(0.23, -0.31, VIEW_PX);
    let black = room.images();
    let mut bare = black.clone();
    bare.iter_mut().for_each(|image| (image.specular, image.normal_oct16) = (None, None));
    let matt = view(&bare, &room.description(None), &camera);
    for images in [&black, &bare] {
        assert!(view(images, &room.description(Some(Highlight::Ggx)), &camera) == matt);
    }
    // One image of four has planes: its own pixels shine, and nothing else is read from the others.
    let mut mixed = bare.clone();
    mixed[2] = with_ball().images()[2].clone();
    let seen = view(&mixed, &room.description(Some(Highlight::Ggx)), &camera);
    let own = |i: usize| matt.provenance.as_ref().expect("provenance")[i].camera_mask() & 4 != 0;
    let changed: Vec<usize> = (0..kinds(&matt).len()).filter(|&i| colors_differ_by(&seen, &matt, i) > 0).collect();
    assert!(changed.len() > 100 && changed.into_iter().all(own));
}

#[test]
fn any_normal_and_reflector_only_adds_light() {
    let room = with_ball();
    let camera = corners().camera(0.23, -0.31, VIEW_PX);
    let mut images = room.images();
    let random = |i: usize| (i as u32).wrapping_mul(2_654_435_761) ^ (i as u32) << 7;
    for image in &mut images {
        let normals = image.normal_oct16.iter_mut().flatten();
        normals.enumerate().for_each(|(i, normal)| *normal = if i % 3 == 0 { 0 } else { random(i) });
        let planes = image.specular.as_mut().expect("planes");
        planes.reflectance_srgb8_roughness8.iter_mut().enumerate().for_each(|(i, word)| *word = random(i + 99));
    }
    for kind in KINDS {
        let seen = view(&images, &room.description(Some(kind)), &camera);
        let matt = view(&images, &room.description(None), &camera);
        assert_sane(&seen, "nonsense");
        assert!(seen.srgb8.iter().zip(&matt.srgb8).all(|(shining, matt)| shining >= matt), "{kind:?}");
        assert!(seen.srgb8 != matt.srgb8);
    }
}

#[test]
fn planes_that_do_not_fit_are_refused() {
    let room = Room { lit: Some(|_, _| 1.0), illumination: lamps(5), ..wall_only() };
    let good = room.images();
    let refused = |images: &[DepthImage]| {
        let done = reconstructor().upload(images, &room.description(Some(Highlight::Ggx)), Turn::default());
        matches!(done.err(), Some(ReconstructionError::Sample { index: 2, .. }))
    };
    assert!(reconstructor().upload(&good, &room.description(Some(Highlight::Ggx)), Turn::default()).is_ok());
    let mut no_normals = good.clone();
    no_normals[2].normal_oct16 = None;
    let mut too_few = good.clone();
    too_few[2].specular.as_mut().expect("planes").visibility8.pop();
    let mut short = good.clone();
    short[2].specular.as_mut().expect("planes").reflectance_srgb8_roughness8.pop();
    for images in [no_normals, too_few, short] {
        assert!(refused(&images));
    }
}

#[test]
fn a_uniform_map_is_mirrored_as_the_constant_environment() {
    let grey = Vec3::splat(0.5);
    let map = EnvironmentMap::new(UVec2::new(8, 4), &[grey; 32]).expect("a map");
    let on_device = Arc::new(GpuEnvironment::upload(gpu(), &map).expect("a map"));
    let lit_by = |environment| Room { illumination: Illumination { environment, ..lamps(1) }, ..with_ball() };
    let constant = lit_by(Environment::uniform(grey));
    let mapped = lit_by(Environment::mapped());
    let dark = lit_by(Environment::default());
    let images = constant.images();
    for kind in KINDS {
        let seen = |room: &Room, environment| {
            let set = SetDescription { environment, ..room.description(Some(kind)) };
            view(&images, &set, &corners().view()).srgb8
        };
        let constant = seen(&constant, None);
        let mapped = seen(&mapped, Some(&on_device));
        let dark = seen(&dark, None);
        assert!(constant.iter().zip(&mapped).all(|(a, b)| a.abs_diff(*b) <= 1), "{kind:?}");
        assert_eq!(constant != dark, kind == Highlight::Ggx, "{kind:?}: only microfacets mirror the environment");
    }
}
