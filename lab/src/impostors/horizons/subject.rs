//! The block behind a block, points of the floor beside it, and a viewer on an arc.

use depth_image::{Aabb, PinholeCamera, Ray};
use fixtures::{FRONT_BLOCK, HIDDEN_BLOCK};
use glam::{DVec3, UVec2, Vec2, Vec3};
use rayon::prelude::*;

use super::search::SurfacePoint;
use crate::failures::stand::Stand;
use crate::graph::{GraphCamera, GraphImage, Layout, Met, behind};
use crate::impostors::surfaces::Surfaces;

/// How far surfaces shade each other.
pub const RADIUS_M: f64 = 1.0;
const TRUTH_RAYS: u32 = 256;

const DISTANCE_M: f32 = 8.0;
const HEIGHT_M: f32 = 1.6;
const FOV_DEG: f32 = 24.0;
/// The viewer's way: this far to each side of the line through both blocks.
pub const ARC_RAD: f32 = 0.5;
/// The eyes of the graph camera's halves lie this share of their distance beside the viewer's.
const EYE_OFFSET: f64 = 0.25;
/// The sample cameras lie a little outside of the viewer's way.
const SET_ARC_RAD: f32 = 0.55;
const SET_HEIGHTS_M: [f32; 2] = [1.3, 1.9];

/// Points of the floor are this far apart, and at most so far from the hidden block.
const POINT_SPACING_M: f32 = 0.04;
const POINTS_AWAY_M: f32 = 0.3;
/// Rays begin this far above a surface.
const ABOVE_M: f32 = 1e-3;

/// The scene on the host.
pub struct Blocks(Surfaces);

/// A point of the floor beside the hidden block.
pub struct FloorPoint {
    pub at: Vec3,
    /// The share of light that nearby surfaces take, by rays.
    pub truth: f64,
}

impl FloorPoint {
    pub fn surface(&self) -> SurfacePoint {
        SurfacePoint { point: self.at.as_dvec3(), normal: DVec3::Y }
    }
}

/// A viewer at an angle of the arc.
pub fn view(angle_rad: f32, size_px: UVec2) -> PinholeCamera {
    camera(angle_rad, HEIGHT_M, size_px)
}

/// The four sample cameras at the corners of the viewer's way.
pub fn set_cameras(size_px: UVec2) -> Vec<PinholeCamera> {
    let corners = [-SET_ARC_RAD, SET_ARC_RAD].into_iter().flat_map(|angle| SET_HEIGHTS_M.map(|height| (angle, height)));
    corners.map(|(angle_rad, height_m)| camera(angle_rad, height_m, size_px)).collect()
}

/// The camera that sees behind the front block.
///
/// # Errors
/// Its frusta cannot be used.
pub fn behind_block(view: &PinholeCamera) -> anyhow::Result<GraphCamera> {
    Ok(GraphCamera::new(&behind(view, &FRONT_BLOCK, EYE_OFFSET), &Layout::Nested)?)
}

fn camera(angle_rad: f32, height_m: f32, size_px: UVec2) -> PinholeCamera {
    let target = FRONT_BLOCK.center().midpoint(HIDDEN_BLOCK.center());
    let (sin, cos) = angle_rad.sin_cos();
    let eye = Vec3::new(sin * DISTANCE_M, height_m, cos * DISTANCE_M);
    PinholeCamera::looking_at(eye, target, Vec3::Y, FOV_DEG.to_radians(), size_px)
}

impl Blocks {
    /// # Errors
    /// The device fails.
    pub fn new(stand: &Stand) -> anyhow::Result<Self> {
        Ok(Self(Surfaces::new(&stand.upload(&fixtures::hidden_block())?)?))
    }

    pub fn image<'c>(&self, camera: &'c GraphCamera) -> GraphImage<'c> {
        GraphImage::take(camera, |ray, span| self.meet(ray, span))
    }

    fn meet(&self, ray: &Ray, span: [f32; 2]) -> Option<Met> {
        self.0.meet(ray, span)
    }

    /// Points of the floor around the hidden block.
    pub fn points(&self) -> Vec<FloorPoint> {
        let [min, max] = [HIDDEN_BLOCK.min - POINTS_AWAY_M, HIDDEN_BLOCK.max + POINTS_AWAY_M];
        let steps = ((max - min) / POINT_SPACING_M).as_uvec3();
        let grid = (0..=steps.x).flat_map(|x| (0..=steps.z).map(move |z| Vec2::new(x as f32, z as f32)));
        let on_floor = grid.map(|at| Vec3::new(min.x + at.x * POINT_SPACING_M, 0.0, min.z + at.y * POINT_SPACING_M));
        let free: Vec<Vec3> =
            on_floor.filter(|at| !is_under(&FRONT_BLOCK, *at) && !is_under(&HIDDEN_BLOCK, *at)).collect();
        free.into_par_iter().map(|at| FloorPoint { at, truth: self.by_rays(at, Vec3::Y, TRUTH_RAYS, 0.0) }).collect()
    }

    /// The share of rays, spread by the cosine and turned around the normal, that meet a surface within the radius.
    pub fn by_rays(&self, at: Vec3, normal: Vec3, rays: u32, turned_rad: f32) -> f64 {
        let (right, ahead) = normal.any_orthonormal_pair();
        let blocked = (0..rays).filter(|&number| {
            let share = (number as f32 + 0.5) / rays as f32;
            let (sin, cos) = f32::sin_cos(turned_rad + std::f32::consts::TAU * radical_inverse(number));
            let out = share.sqrt();
            let towards = right * (out * cos) + ahead * (out * sin) + normal * (1.0 - share).sqrt();
            self.0.is_blocked(
                &Ray { origin_in_world: at + normal * ABOVE_M, direction_in_world: towards },
                RADIUS_M as f32,
            )
        });
        blocked.count() as f64 / f64::from(rays)
    }

    /// Whether a viewer sees a point.
    pub fn is_seen(&self, eye: Vec3, at: Vec3) -> bool {
        let way = eye - at;
        let lifted = Ray { origin_in_world: at + Vec3::Y * ABOVE_M, direction_in_world: way };
        !self.0.is_blocked(&lifted, 1.0)
    }
}

fn is_under(block: &Aabb, at: Vec3) -> bool {
    at.cmpge(block.min).all() && at.cmple(block.max).all()
}

/// The bits of a number in reverse, from 0 to 1.
fn radical_inverse(number: u32) -> f32 {
    number.reverse_bits() as f32 / (u32::MAX as f32 + 1.0)
}

#[cfg(test)]
mod tests {
    use engine::GpuEngine;
    use gpu::DevicePreference;

    use super::*;
    use crate::graph::pinhole;
    use crate::impostors::horizons::methods::FINE;

    /// A point whose occlusion the hidden block alone makes.
    #[test]
    fn a_views_own_image_misses_the_hidden_block_and_others_do_not() {
        let blocks = Blocks::new(&Stand::new(&GpuEngine::shared(DevicePreference::Software).unwrap(), true)).unwrap();
        let at = SurfacePoint { point: DVec3::new(0.66, 0.0, -1.1), normal: DVec3::Y };
        let truth = blocks.by_rays(at.point.as_vec3(), Vec3::Y, TRUTH_RAYS, 0.0);
        assert!(truth > 0.15, "{truth}");
        let head_on = view(0.0, UVec2::new(320, 240));
        let camera = pinhole(&head_on).unwrap();
        let own = FINE.in_image(&blocks.image(&camera), at).unwrap();
        let camera = behind_block(&head_on).unwrap();
        let graph = FINE.in_image(&blocks.image(&camera), at).unwrap();
        let cameras: Vec<GraphCamera> =
            set_cameras(head_on.size_px).iter().map(|view| pinhole(view).unwrap()).collect();
        let images: Vec<GraphImage<'_>> = cameras.iter().map(|camera| blocks.image(camera)).collect();
        let shared = FINE.in_any_image(&images, at);
        assert!(
            own < 0.05 && (graph - truth).abs() < 0.15 && (shared - truth).abs() < 0.1,
            "{own} {graph} {shared} {truth}"
        );
    }
}
