//! Samples that an image would show, and where other images see them.

use depth_image::{PinholeCamera, Ray, SurfaceId};
use glam::{UVec2, Vec2, Vec3};
use render::scalar::{
    LEAST_FACING,
    rays::{Hit, Scene},
};

/// A sample that an image would show.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// The point on the surface.
    pub point_in_world: Vec3,
    /// Unit length, towards the camera.
    pub normal: Vec3,
    /// The triangle's own, towards the camera.
    pub triangle_normal: Vec3,
    /// The triangle.
    pub id: SurfaceId,
    /// A pixel's length on the surface.
    pub footprint_m: f32,
    pub(super) planar_depth_m: f32,
    pub(super) pixel: UVec2,
}

impl Candidate {
    pub(super) fn of(scene: &Scene, camera: &PinholeCamera, pixel: UVec2, ray: &Ray, hit: &Hit) -> Self {
        let sight = ray.direction_in_world * hit.t;
        let normal = scene.normal_in_world(hit);
        Self {
            point_in_world: ray.origin_in_world + sight,
            normal,
            triangle_normal: scene.triangle_normal_in_world(hit),
            id: scene.surface_id(hit),
            footprint_m: stretched_footprint(hit.t, camera, normal, sight),
            planar_depth_m: hit.t,
            pixel,
        }
    }
}

/// A pixel's length on a surface at this depth that is met along `sight`.
pub(super) fn stretched_footprint(planar_depth_m: f32, camera: &PinholeCamera, normal: Vec3, sight: Vec3) -> f32 {
    let facing = normal.dot(sight).abs() / sight.length().max(1e-15);
    planar_depth_m / camera.focal_px.min_element() / facing.max(LEAST_FACING)
}

/// The pixel and planar depth at which a camera sees a point, if it does.
pub(super) fn place(camera: &PinholeCamera, point_in_world: Vec3) -> Option<(Vec2, f32)> {
    let seen = camera.project(point_in_world)?;
    let inside = seen.pixel.cmpge(Vec2::ZERO).all() && seen.pixel.cmplt(camera.size_px.as_vec2()).all();
    (inside && seen.planar_depth_m > camera.near_m).then_some((seen.pixel, seen.planar_depth_m))
}

pub(super) fn index_of(camera: &PinholeCamera, pixel: UVec2) -> usize {
    (pixel.y * camera.size_px.x + pixel.x) as usize
}
