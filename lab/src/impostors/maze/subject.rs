//! A maze, and the rays off its teapot.

use depth_image::{PinholeCamera, Ray};
use fixtures::{Maze, maze_teapot};
use glam::{UVec2, Vec3};
use rayon::prelude::*;
use render::{GpuScene, scalar};
use scene::Scene;

use crate::failures::stand::Stand;
use crate::graph::Met;
use crate::impostors::surfaces::Surfaces;

/// Nothing is met nearer to the teapot.
pub const NEAR_M: f32 = 0.002;
const FAR_M: f32 = 1e3;
/// The viewer of the teapot, from its foot: back along the way, and up.
const BACK_M: f32 = 0.42;
const UP_M: f32 = 0.36;
const FOV_DEG: f32 = 48.0;

/// A maze without its teapot, on the device and on the host.
pub struct Subject<'s> {
    pub stand: &'s Stand,
    pub maze: Maze,
    pub scene: Scene,
    pub on_device: GpuScene,
    surfaces: Surfaces,
    teapot: scalar::rays::Scene,
}

/// A ray off the teapot, and the way to what it meets.
#[derive(Debug, Clone, Copy)]
pub struct MirroredRay {
    pub ray: Ray,
    pub way_m: f32,
}

/// What a pixel of a view of the teapot shows.
pub enum Shown {
    /// The teapot, which mirrors this ray.
    Mirror(Ray),
    Surface(Vec3),
    Sky,
}

impl<'s> Subject<'s> {
    /// # Errors
    /// The device fails.
    pub fn new(stand: &'s Stand, maze: Maze) -> anyhow::Result<Self> {
        let scene = maze.scene(None);
        let on_device = stand.upload(&scene)?;
        let surfaces = Surfaces::new(&on_device)?;
        let teapot = scalar::rays::Scene::of(&stand.upload(&maze_teapot())?, 0.0)?;
        Ok(Self { stand, maze, scene, on_device, surfaces, teapot })
    }

    pub fn name(&self) -> String {
        format!("maze:{}{}", self.maze.height_m, if self.maze.is_roofed { ":roofed" } else { "" })
    }

    /// The maze's surface on a ray, in its own colour.
    pub fn meet(&self, ray: &Ray, span: [f32; 2]) -> Option<Met> {
        self.surfaces.meet(ray, span)
    }

    /// The colour that a ray meets.
    pub fn color_linear(&self, ray: &Ray) -> Option<Vec3> {
        self.meet(ray, [NEAR_M, FAR_M]).map(|met| met.color_linear)
    }

    /// A viewer behind the teapot at one of its places.
    pub fn view(&self, place: usize, size_px: UVec2) -> PinholeCamera {
        let places = self.maze.teapot_places();
        let foot = places[place];
        let before = if place == 0 { foot + Vec3::Z } else { places[place - 1] };
        let back = (before - foot).normalize_or(Vec3::Z);
        let eye = foot + back * BACK_M + Vec3::Y * UP_M;
        let target = foot + Vec3::Y * 0.1;
        PinholeCamera { near_m: 1e-3, ..PinholeCamera::looking_at(eye, target, Vec3::Y, FOV_DEG.to_radians(), size_px) }
    }

    /// What each pixel of a view shows, row by row.
    pub fn shown(&self, place: usize, camera: &PinholeCamera) -> Vec<Shown> {
        let foot = self.maze.teapot_places()[place];
        let size_px = camera.size_px;
        let pixels = (0..size_px.element_product()).into_par_iter().map(|pixel| {
            let ray = scalar::rays::pixel_ray(camera, UVec2::new(pixel % size_px.x, pixel / size_px.x));
            let surface = self.meet(&ray, [camera.near_m, FAR_M]);
            match self.off_teapot(&ray, foot) {
                Some((t, mirrored)) if surface.is_none_or(|met| met.t > t) => Shown::Mirror(mirrored),
                _ => surface.map_or(Shown::Sky, |met| Shown::Surface(met.color_linear)),
            }
        });
        pixels.collect()
    }

    /// Where a ray meets the teapot, and the ray that it becomes.
    fn off_teapot(&self, ray: &Ray, foot: Vec3) -> Option<(f32, Ray)> {
        let from_foot = Ray { origin_in_world: ray.origin_in_world - foot, ..*ray };
        let hit = self.teapot.closest(&from_foot, 0.0)?;
        let normal = self.teapot.normal_in_world(&hit);
        let towards = ray.direction_in_world.normalize_or_zero().reflect(normal).normalize_or_zero();
        Some((hit.t, Ray { origin_in_world: ray.at(hit.t), direction_in_world: towards }))
    }

    /// The rays off the teapot at all of its places that meet the maze, and not the teapot itself before.
    pub fn mirrored_rays(&self, view_px: UVec2) -> Vec<MirroredRay> {
        let places = self.maze.teapot_places();
        let rays = places.iter().enumerate().flat_map(|(place, &foot)| {
            let shown = self.shown(place, &self.view(place, view_px));
            let rays = shown.into_iter().filter_map(move |shown| match shown {
                Shown::Mirror(ray) => Some(ray),
                Shown::Surface(_) | Shown::Sky => None,
            });
            rays.filter_map(move |ray| self.mirrored_ray(ray, foot)).collect::<Vec<_>>()
        });
        rays.collect()
    }

    fn mirrored_ray(&self, ray: Ray, foot: Vec3) -> Option<MirroredRay> {
        let way_m = self.meet(&ray, [NEAR_M, FAR_M])?.t;
        let from_foot = Ray { origin_in_world: ray.origin_in_world - foot, ..ray };
        let meets_itself = self.teapot.closest_between(&from_foot, NEAR_M, way_m).is_some();
        (!meets_itself).then_some(MirroredRay { ray, way_m })
    }
}
