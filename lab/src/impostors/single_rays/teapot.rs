//! The teapot alone, rays towards it, and what they meet.

use depth_image::{Aabb, Camera, Environment, Illumination, PinholeCamera, Ray, SinglePoleCamera};
use glam::{UVec2, Vec3};
use gpu::Turn;
use rayon::prelude::*;
use reconstruction::{SampleSet, SetDescription};
use render::{GpuScene, Lighting, SamplePlanes, scalar};
use scene::{Limits, MissingTextures, Scene};

use crate::failures::stand::Stand;
use crate::impostors::measure::around;

/// The scene whose mirror and teapot are used.
const SCENE: &str = "teapot-mirror";
/// What rises less is the floor.
const FLOOR_M: f32 = 1e-3;
/// From the middle of the teapot to a flat patch.
const DISTANCE_M: f32 = 7.0;
/// The boxes around the places on a patch or a mirror from which images are taken, in widths of it.
pub const ASIDE: f32 = 0.3;

/// The teapot alone.
pub struct Teapot<'s> {
    pub stand: &'s Stand,
    whole: Scene,
    on_device: GpuScene,
    twin: scalar::rays::Scene,
    pub bounds: Aabb,
}

/// Rays off a reflector, and what they meet.
pub struct Rays {
    /// Of the reflector.
    pub middle: Vec3,
    pub width_m: f32,
    pub rays: Vec<Ray>,
    /// The way to the teapot's surface and its colour, where it is met.
    pub truth: Vec<Option<(f32, Vec3)>>,
}

impl<'s> Teapot<'s> {
    /// # Errors
    /// The device fails.
    pub fn new(stand: &'s Stand) -> anyhow::Result<Self> {
        let whole = fixtures::spec(SCENE)?.load(&Limits::default(), MissingTextures::Refuse)?;
        let alone = alone(&whole);
        let on_device = stand.upload(&alone)?;
        let twin = scalar::rays::Scene::of(&on_device, 0.0)?;
        let bounds = Aabb::around(twin.triangles_in_world().flatten());
        Ok(Self { stand, whole, on_device, twin, bounds })
    }

    /// A camera around the teapot; without distortion it is a pinhole's.
    pub fn camera(&self, eye: Vec3, distortion_px: f32, side_px: u32) -> SinglePoleCamera {
        SinglePoleCamera::around(&self.bounds, eye, distortion_px, UVec2::splat(side_px))
    }

    pub fn set(&self, cameras: &[Camera]) -> anyhow::Result<SampleSet> {
        unlit_set(self.stand, &self.on_device, cameras, self.bounds)
    }

    /// The cosine between a ray and the surface that it meets.
    pub fn facing(&self, ray: &Ray) -> Option<f32> {
        let hit = self.twin.closest(ray, NEAR_M).0?;
        Some(self.twin.normal_in_world(&hit).dot(ray.direction_in_world.normalize_or_zero()).abs().min(1.0))
    }

    fn truth(&self, rays: &[Ray]) -> Vec<Option<(f32, Vec3)>> {
        let met = |ray: &Ray| self.twin.closest(ray, NEAR_M).0.map(|hit| (hit.t, self.twin.look(&hit).base_linear));
        rays.par_iter().map(met).collect()
    }
}

/// Images of a scene in its own colours.
///
/// # Errors
/// The device fails.
pub fn unlit_set(stand: &Stand, scene: &GpuScene, cameras: &[Camera], volume: Aabb) -> anyhow::Result<SampleSet> {
    let images = stand.images(scene, Lighting::UNLIT, cameras, SamplePlanes::default())?;
    let dark = Illumination { lights: Vec::new(), environment: Environment::uniform(Vec3::ZERO) };
    let description = SetDescription {
        volume,
        background: Environment::uniform(Vec3::ZERO),
        illumination: &dark,
        highlight: None,
        environment: None,
        mips: false,
    };
    Ok(stand.reconstructor().upload(&images, &description, Turn::default())?)
}

/// Nothing is met nearer to a reflector.
pub const NEAR_M: f32 = 0.02;

/// The part of the scene that is neither floor nor mirror.
fn alone(whole: &Scene) -> Scene {
    let mut alone = whole.clone();
    let mesh = &mut alone.meshes[0];
    mesh.parts.truncate(1);
    let first = &mut mesh.parts[0];
    let of_matt = &mesh.indices[first.first_index as usize..][..first.index_count as usize];
    let rises = |triangle: &&[u32; 3]| triangle.iter().any(|&at| mesh.vertices[at as usize].position[1] > FLOOR_M);
    let kept: Vec<u32> = of_matt.as_chunks::<3>().0.iter().filter(rises).flatten().copied().collect();
    (first.first_index, first.index_count) = (0, kept.len() as u32);
    mesh.indices = kept;
    alone
}

fn spread(number: usize, step: f64) -> f32 {
    (0.5 + step * number as f64).fract() as f32 - 0.5
}

/// Rays from a square towards points in the teapot's box. The square is `ratio` times as wide as it is far.
pub fn off_patch(teapot: &Teapot<'_>, ratio: f32, count: usize) -> Rays {
    let middle = teapot.bounds.center() - Vec3::Z * DISTANCE_M;
    let width_m = ratio * DISTANCE_M;
    let ray = |number: usize| {
        let [x, y] = [0.754_877_666, 0.569_840_296].map(|step| spread(number, step));
        let [u, v, w] = [0.819_172_514, 0.671_043_606, 0.549_700_478].map(|step| spread(number, step));
        let origin_in_world = middle + Vec3::new(x, y, 0.0) * width_m;
        let target = teapot.bounds.center() + teapot.bounds.size() * Vec3::new(u, v, w);
        Ray { origin_in_world, direction_in_world: (target - origin_in_world).normalize_or(Vec3::Z) }
    };
    let rays: Vec<Ray> = (0..count).map(ray).collect();
    Rays { middle, width_m, truth: teapot.truth(&rays), rays }
}

/// Views on a circle around the scene.
pub fn views(teapot: &Teapot<'_>, count: usize) -> Vec<PinholeCamera> {
    around(&teapot.whole.bounds(), count)
}

/// Rays off the scene's mirror, from these views at another size.
///
/// # Errors
/// The device fails.
pub fn off_mirror(teapot: &Teapot<'_>, views: &[PinholeCamera], view_px: UVec2) -> anyhow::Result<Rays> {
    let whole = teapot.stand.upload(&teapot.whole)?;
    let twin = scalar::rays::Scene::of(&whole, 0.0)?;
    let (mirrors, _) = sampling::mirrors(&teapot.whole, sampling::Impostors::Pinholes { images: 1 });
    let bounds = mirrors.first().map_or(teapot.bounds, |mirror| mirror.bounds);
    let rays = mirrored(&twin, views, view_px);
    Ok(Rays { middle: bounds.center(), width_m: bounds.size().min_element(), truth: teapot.truth(&rays), rays })
}

/// The rays off the mirrors that these views show, at another size.
pub fn mirrored(twin: &scalar::rays::Scene, cameras: &[PinholeCamera], view_px: UVec2) -> Vec<Ray> {
    let places = |camera: &PinholeCamera| {
        let camera = camera.resized(view_px);
        let places = (0..view_px.y).flat_map(move |y| (0..view_px.x).map(move |x| UVec2::new(x, y)));
        places.map(move |place| (scalar::rays::pixel_ray(&camera, place), camera.near_m)).collect::<Vec<_>>()
    };
    let off = |(ray, near_m): (Ray, f32)| {
        let hit = twin.closest(&ray, near_m).0?;
        twin.look(&hit).reflector?;
        let towards = ray.direction_in_world.normalize_or_zero().reflect(twin.normal_in_world(&hit));
        Some(Ray { origin_in_world: ray.at(hit.t), direction_in_world: towards })
    };
    cameras.par_iter().flat_map(places).filter_map(off).collect()
}
