//! The scalar reference of this crate: one ray a pixel, one after the other, which goes on behind what is left out.

use depth_image::{
    BACKGROUND_INVERSE_DEPTH, Camera, DepthImage, HOLE_INVERSE_DEPTH, PinholeCamera, Ray, SurfaceId, oct16_from_unit,
    unit_from_oct16,
};
use glam::{UVec2, Vec2, Vec3};
use render::{
    scalar::rays::{Hit, Scene, pixel_ray},
    view_cell_m,
};

use crate::{Redundancy, SamplingMethod};

/// A sample that an image would show.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Where it lies.
    pub point_in_world: Vec3,
    /// Unit length, towards the camera.
    pub normal: Vec3,
    /// Of which triangle.
    pub id: SurfaceId,
    /// A pixel's length on the surface.
    pub footprint_m: f32,
    planar_depth_m: f32,
    pixel: UVec2,
}

/// As in the shaders.
const LEAST_FACING: f32 = 0.01;
const SAME_DEPTH: f32 = 2e-5;
const SAME_FOOTPRINTS: f32 = 0.0625;
const DEPTH_FOOTPRINTS: f32 = 2.0;
const SLOPE_PX: f32 = 1.0;
const SAME_FACING: f32 = 0.906_307_8;
const COARSER: f32 = 1.5;
const CLEARLY: f32 = 0.8;
const CLEARLY_SAME_FACING: f32 = 0.939_692_6;
const SETTLED_FOOTPRINTS: f32 = 4.0;
const MOST_LAYERS: usize = 64;
const RING: u32 = 16;
const BLOCKER_FOOTPRINTS: f32 = 4.0;

/// Depth, normals and surface ids of a set; colours are left black.
#[must_use]
pub fn sample(scene: &Scene, cameras: &[PinholeCamera], method: SamplingMethod) -> Vec<DepthImage> {
    sample_with(scene, cameras, method, Settings::default())
}

/// What the test by tolerance may be varied by.
#[derive(Debug, Clone, Copy)]
pub struct Settings<'a> {
    /// The same images at another moment, what they hold of which is kept on to.
    pub before: Option<&'a [DepthImage]>,
    /// Depths and footprints may differ by so many times what the method allows.
    pub allowed: f32,
}

impl Default for Settings<'_> {
    fn default() -> Self {
        Self { before: None, allowed: 1.0 }
    }
}

/// As [`sample`], with the test by tolerance varied.
#[must_use]
pub fn sample_with(
    scene: &Scene,
    cameras: &[PinholeCamera],
    method: SamplingMethod,
    settings: Settings<'_>,
) -> Vec<DepthImage> {
    let mut images: Vec<DepthImage> = Vec::with_capacity(cameras.len());
    for (number, camera) in cameras.iter().enumerate() {
        let before = settings.before.map(|before| &before[number]);
        let asked = Asked { scene, images: &images, method, before, allowed: settings.allowed };
        let pixels = (0..camera.size_px.y).flat_map(|y| (0..camera.size_px.x).map(move |x| UVec2::new(x, y)));
        let mut texels: Vec<Texel> = pixels.map(|pixel| texel(&asked, camera, pixel)).collect();
        if let SamplingMethod::Useful(_) = method {
            leave_out_useless(&mut texels, camera, view_cell_m(cameras));
        }
        images.push(image(camera, &texels));
    }
    images
}

struct Texel {
    inverse_depth_per_m: f32,
    normal_oct16: u32,
    id: SurfaceId,
    /// Planar depth of the nearest surface that was left out before it, if any was.
    passed_m: Option<f32>,
}

/// What is asked whether it holds a candidate.
struct Asked<'a> {
    scene: &'a Scene,
    /// Before the candidate's own.
    images: &'a [DepthImage],
    method: SamplingMethod,
    /// The candidate's own, at the moment that the set settled at.
    before: Option<&'a DepthImage>,
    allowed: f32,
}

fn texel(asked: &Asked<'_>, camera: &PinholeCamera, pixel: UVec2) -> Texel {
    let scene = asked.scene;
    let ray = pixel_ray(camera, pixel);
    let (mut near, mut passed_m) = (camera.near_m, None);
    for _ in 0..MOST_LAYERS {
        let Some(hit) = scene.closest(&ray, near).0 else { break };
        let candidate = candidate(scene, camera, pixel, &ray, &hit);
        let was_kept = asked.before.is_some_and(|before| was_kept(&candidate, before));
        if !asked.images.iter().any(|image| is_known(asked, &candidate, was_kept, image)) {
            let (id, normal_oct16) = (candidate.id, oct16_from_unit(candidate.normal));
            return Texel { inverse_depth_per_m: hit.t.recip(), normal_oct16, id, passed_m };
        }
        (near, passed_m) = (hit.t, passed_m.or(Some(hit.t)));
    }
    let inverse_depth_per_m = if passed_m.is_some() { HOLE_INVERSE_DEPTH } else { BACKGROUND_INVERSE_DEPTH };
    Texel { inverse_depth_per_m, normal_oct16: 0, id: SurfaceId { instance: 0, primitive: 0 }, passed_m }
}

/// As in `useful.wgsl`: what lies behind a blocker that fills the whole ring around it is not seen from the cell.
fn leave_out_useless(texels: &mut [Texel], camera: &PinholeCamera, view_cell_m: f32) {
    let front = |texel: &Texel| texel.passed_m.map_or(texel.inverse_depth_per_m.max(0.0), |m: f32| m.recip());
    let fronts: Vec<f32> = texels.iter().map(front).collect();
    let width = camera.size_px.x;
    for (place, texel) in (0..).zip(texels).filter(|(_, texel)| texel.inverse_depth_per_m > 0.0) {
        let Some(blocker_m) = texel.passed_m else { continue };
        let sample_m = texel.inverse_depth_per_m.recip();
        let footprint_m = blocker_m / camera.focal_px.min_element();
        let radius_px = (view_cell_m * (sample_m - blocker_m) / sample_m / footprint_m).max(1.0);
        let center = Vec2::new((place % width) as f32, (place / width) as f32) + 0.5;
        let is_seen_past = |step: u32| {
            let offset = Vec2::from_angle(step as f32 * std::f32::consts::TAU / RING as f32) * radius_px;
            let at = (center + offset).floor();
            let inside = at.cmpge(Vec2::ZERO).all() && at.cmplt(camera.size_px.as_vec2()).all();
            let front = if inside { fronts[index_of(camera, at.as_uvec2())] } else { 0.0 };
            front <= 0.0 || (front.recip() - blocker_m).abs() > BLOCKER_FOOTPRINTS * footprint_m
        };
        if !(0..RING).any(is_seen_past) {
            texel.inverse_depth_per_m = HOLE_INVERSE_DEPTH;
        }
    }
}

fn candidate(scene: &Scene, camera: &PinholeCamera, pixel: UVec2, ray: &Ray, hit: &Hit) -> Candidate {
    let sight = ray.direction_in_world * hit.t;
    let normal = scene.normal_in_world(hit);
    Candidate {
        point_in_world: ray.origin_in_world + sight,
        normal,
        id: scene.surface_id(hit),
        footprint_m: stretched_footprint(hit.t, camera, normal, sight),
        planar_depth_m: hit.t,
        pixel,
    }
}

fn stretched_footprint(planar_depth_m: f32, camera: &PinholeCamera, normal: Vec3, sight: Vec3) -> f32 {
    let facing = normal.dot(sight).abs() / sight.length().max(1e-15);
    planar_depth_m / camera.focal_px.min_element() / facing.max(LEAST_FACING)
}

fn image(camera: &PinholeCamera, texels: &[Texel]) -> DepthImage {
    DepthImage {
        camera: Camera::Pinhole(*camera),
        inverse_depth_per_m: texels.iter().map(|texel| texel.inverse_depth_per_m).collect(),
        color_rgb9e5: vec![0; texels.len()],
        normal_oct16: Some(texels.iter().map(|texel| texel.normal_oct16).collect()),
        surface_id: Some(texels.iter().map(|texel| texel.id).collect()),
        specular: None,
        passed: texels
            .iter()
            .any(|texel| texel.passed_m.is_some())
            .then(|| texels.iter().map(|texel| texel.passed_m.is_some()).collect()),
        corner_inverse_depth_per_m: None,
    }
}

fn is_known(asked: &Asked<'_>, candidate: &Candidate, was_kept: bool, image: &DepthImage) -> bool {
    match asked.method {
        SamplingMethod::Conventional => false,
        SamplingMethod::NonRedundant(Redundancy::Pixel) | SamplingMethod::Useful(Redundancy::Pixel) => {
            is_pixel_redundant(candidate, image)
        }
        SamplingMethod::NonRedundant(Redundancy::Visibility) | SamplingMethod::Useful(Redundancy::Visibility) => {
            let Camera::Pinhole(camera) = &image.camera;
            is_visibility_redundant(asked.scene, candidate.point_in_world, candidate.footprint_m, camera)
        }
        SamplingMethod::NonRedundant(Redundancy::Tolerance) | SamplingMethod::Useful(Redundancy::Tolerance) => {
            is_tolerance_redundant(candidate, was_kept, asked.allowed, image)
        }
        SamplingMethod::DepthPeeling { .. } => is_in_layer(candidate, image),
    }
}

/// Where a point is seen by a camera, if it is: its pixel and planar depth.
fn place(camera: &PinholeCamera, point_in_world: Vec3) -> Option<(Vec2, f32)> {
    let seen = camera.project(point_in_world)?;
    let inside = seen.pixel.cmpge(Vec2::ZERO).all() && seen.pixel.cmplt(camera.size_px.as_vec2()).all();
    (inside && seen.planar_depth_m > camera.near_m).then_some((seen.pixel, seen.planar_depth_m))
}

/// Xie, Algorithm 3. False for an image without surface ids.
#[must_use]
pub fn is_pixel_redundant(candidate: &Candidate, image: &DepthImage) -> bool {
    holds(image, candidate.point_in_world, candidate.id)
}

/// Whether an image has a sample of a triangle at the pixel that a point is seen at.
#[must_use]
pub fn holds(image: &DepthImage, point_in_world: Vec3, id: SurfaceId) -> bool {
    let Camera::Pinhole(camera) = &image.camera;
    let (Some((pixel, _)), Some(ids)) = (place(camera, point_in_world), &image.surface_id) else { return false };
    let index = index_of(camera, pixel.as_uvec2());
    image.inverse_depth_per_m[index] > 0.0 && ids[index] == id
}

/// Xie, Algorithm 2: whether the first thing on the way from a camera to a point is the point itself.
#[must_use]
pub fn is_visibility_redundant(scene: &Scene, point_in_world: Vec3, footprint_m: f32, camera: &PinholeCamera) -> bool {
    let Some((_, depth_m)) = place(camera, point_in_world) else { return false };
    let room_m = SAME_DEPTH * depth_m + SAME_FOOTPRINTS * footprint_m;
    let direction_in_world = (point_in_world - camera.eye_in_world) / depth_m;
    let ray = Ray { origin_in_world: camera.eye_in_world, direction_in_world };
    let met = scene.closest_between(&ray, camera.near_m, depth_m + room_m).0;
    met.is_some_and(|hit| hit.t >= depth_m - room_m)
}

/// How many rays sampling by visibility sends for the images after the first: those through pixels, and those from
/// earlier viewpoints.
#[must_use]
pub fn rays_of_visibility(scene: &Scene, cameras: &[PinholeCamera]) -> usize {
    let of_image = |(number, camera): (usize, &PinholeCamera)| -> usize {
        let pixels = (0..camera.size_px.y).flat_map(|y| (0..camera.size_px.x).map(move |x| UVec2::new(x, y)));
        pixels.map(|pixel| rays_of_pixel(scene, camera, pixel, &cameras[..number])).sum()
    };
    cameras.iter().enumerate().skip(1).map(of_image).sum()
}

fn rays_of_pixel(scene: &Scene, camera: &PinholeCamera, pixel: UVec2, earlier: &[PinholeCamera]) -> usize {
    let ray = pixel_ray(camera, pixel);
    let (mut near, mut rays) = (camera.near_m, 0);
    for _ in 0..MOST_LAYERS {
        rays += 1;
        let Some(hit) = scene.closest(&ray, near).0 else { break };
        let candidate = candidate(scene, camera, pixel, &ray, &hit);
        let asked: Vec<_> = earlier.iter().filter(|other| place(other, candidate.point_in_world).is_some()).collect();
        let seen = |other: &PinholeCamera| {
            is_visibility_redundant(scene, candidate.point_in_world, candidate.footprint_m, other)
        };
        // Asked one after the other, until one sees it.
        let Some(place) = asked.iter().position(|other| seen(other)) else {
            rays += asked.len();
            break;
        };
        rays += place + 1;
        near = hit.t;
    }
    rays
}

/// As in `known.wgsl`: whether an image has a sample where a candidate is.
fn was_kept(candidate: &Candidate, before: &DepthImage) -> bool {
    let Camera::Pinhole(camera) = &before.camera;
    let (Some((pixel, depth_m)), Some(normals)) = (place(camera, candidate.point_in_world), &before.normal_oct16)
    else {
        return false;
    };
    let texel = pixel.as_uvec2();
    let index = index_of(camera, texel);
    let inverse_depth = before.inverse_depth_per_m[index];
    let held_m = footprint_m(camera, texel, inverse_depth, unit_from_oct16(normals[index]));
    let room_m = SETTLED_FOOTPRINTS * held_m.max(candidate.footprint_m);
    inverse_depth > 0.0 && (inverse_depth.recip() - depth_m).abs() < room_m
}

fn is_tolerance_redundant(candidate: &Candidate, was_kept: bool, allowed: f32, image: &DepthImage) -> bool {
    let Camera::Pinhole(camera) = &image.camera;
    let (Some((pixel, depth_m)), Some(normals)) = (place(camera, candidate.point_in_world), &image.normal_oct16) else {
        return false;
    };
    let sight = candidate.point_in_world - camera.eye_in_world;
    let steps = [Vec3::X / camera.focal_px.x, Vec3::NEG_Y / camera.focal_px.y].map(|s| camera.world_from_camera * s);
    let across: f32 = steps.iter().map(|step| candidate.normal.dot(*step).abs()).sum();
    let slope = depth_m * across / (candidate.normal.dot(sight).abs() / depth_m).max(1e-6);
    let (share, least_facing) = if was_kept { (CLEARLY, CLEARLY_SAME_FACING) } else { (1.0, SAME_FACING) };
    let allowed = share * allowed;
    let room_m = allowed * (DEPTH_FOOTPRINTS * depth_m / camera.focal_px.min_element()).max(SLOPE_PX * slope);
    let first = (pixel - 0.5).floor().as_ivec2();
    let last = camera.size_px.as_ivec2() - 1;
    let stands_for_it = |(x, y): (i32, i32)| {
        let texel = (first + glam::IVec2::new(x, y)).clamp(glam::IVec2::ZERO, last).as_uvec2();
        let index = index_of(camera, texel);
        let inverse_depth = image.inverse_depth_per_m[index];
        let normal = unit_from_oct16(normals[index]);
        inverse_depth > 0.0
            && (inverse_depth.recip() - depth_m).abs() < room_m
            && normal.dot(candidate.normal) > least_facing
            && footprint_m(camera, texel, inverse_depth, normal) <= allowed * COARSER * candidate.footprint_m
    };
    let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
    if was_kept { four.into_iter().all(stands_for_it) } else { four.into_iter().any(stands_for_it) }
}

/// Of a held sample.
fn footprint_m(camera: &PinholeCamera, texel: UVec2, inverse_depth_per_m: f32, normal: Vec3) -> f32 {
    let sight = pixel_ray(camera, texel).direction_in_world;
    stretched_footprint(inverse_depth_per_m.recip(), camera, normal, sight)
}

fn is_in_layer(candidate: &Candidate, image: &DepthImage) -> bool {
    let Camera::Pinhole(camera) = &image.camera;
    let inverse_depth = image.inverse_depth_per_m[index_of(camera, candidate.pixel)];
    inverse_depth <= 0.0 || candidate.planar_depth_m * inverse_depth <= 1.0 + 1e-6
}

fn index_of(camera: &PinholeCamera, pixel: UVec2) -> usize {
    (pixel.y * camera.size_px.x + pixel.x) as usize
}
