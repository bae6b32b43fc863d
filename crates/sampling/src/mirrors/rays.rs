//! Rays off mirrors through the triangles of a scene.

use std::time::Duration;

use depth_image::Aabb;
use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use scene::Scene;

use super::groups::{SurfacePoint, spread_2d};

/// Eyes are spread over the scene's volume, made this many times as large.
const EYES: f32 = 2.0;
/// Eyes that are tried for a point; it is left out if none of them sees it.
const TRIES: usize = 8;
/// Places along a way, its end among them.
pub(super) const PLACES: usize = 8;
/// Rays begin this far off a surface, and end this far before another, in diagonals of the scene.
const OFF: f32 = 1e-4;

/// The triangles of a scene as it first is.
pub(super) struct Triangles {
    tree: CwBvh,
    triangles: Vec<Triangle>,
    double_sided: Vec<bool>,
    pub volume: Aabb,
}

/// The way of a ray off a mirror, to a surface or to where it leaves the scene.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    origin_in_world: Vec3,
    /// To its end.
    to_end: Vec3,
    pub ends_at_surface: bool,
}

impl Way {
    /// Places along the way that must be seen to be free, and its end.
    pub fn places(&self) -> impl Iterator<Item = Vec3> {
        (1..=PLACES).map(|place| self.origin_in_world + self.to_end * (place as f32 / PLACES as f32))
    }
}

impl Triangles {
    pub fn of(scene: &Scene, volume: Aabb) -> Self {
        let (mut triangles, mut double_sided) = (Vec::new(), Vec::new());
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh as usize];
            let corner = |index: &u32| {
                let in_mesh = Vec3A::from(mesh.vertices[*index as usize].position);
                instance.world_from_mesh.transform_point3a(in_mesh)
            };
            for part in &mesh.parts {
                let indices = &mesh.indices[part.first_index as usize..][..part.index_count as usize];
                let corners = indices.as_chunks::<3>().0.iter().map(|triangle| triangle.each_ref().map(corner));
                triangles.extend(corners.map(|[v0, v1, v2]| Triangle { v0, v1, v2 }));
                double_sided.resize(triangles.len(), scene.materials[part.material as usize].double_sided);
            }
        }
        let tree = build_cwbvh_from_tris(&triangles, BvhBuildParams::fast_build(), &mut Duration::default());
        Self { tree, triangles, double_sided, volume }
    }

    /// The way to the nearest surface, before `far_m`. Backs of single-sided ones are not there.
    fn nearest_m(&self, origin_in_world: Vec3, direction: Vec3, far_m: f32) -> Option<f32> {
        let ray = Ray::new(origin_in_world.into(), direction.into(), OFF * self.volume.size().length(), far_m);
        let met = |ray: &Ray, slot: usize| {
            let index = self.tree.primitive_indices[slot] as usize;
            let triangle = &self.triangles[index];
            let is_back = triangle.compute_normal().dot(ray.direction) > 0.0;
            if is_back && !self.double_sided[index] { f32::INFINITY } else { triangle.intersect(ray) }
        };
        let mut hit = RayHit::none();
        self.tree.ray_traverse(ray, &mut hit, met).then_some(hit.t)
    }

    /// Whether nothing lies between two points.
    pub fn is_free(&self, from: Vec3, to: Vec3) -> bool {
        let way_m = from.distance(to);
        let before_m = way_m - 10.0 * OFF * self.volume.size().length();
        before_m <= 0.0 || self.nearest_m(from, (to - from) / way_m, before_m).is_none()
    }

    /// The way of a ray from an eye that sees a mirror's point. The number decides the eye. `None` where no eye sees it.
    pub fn way(&self, mirror: &SurfacePoint, number: usize) -> Option<Way> {
        let (point, normal) = (mirror.point_in_world, mirror.normal);
        let eye = |attempt: usize| {
            let number = number * TRIES + attempt;
            let [x, y] = spread_2d(number);
            let z = (number as f32 * 0.381_966).fract();
            self.volume.center() + (Vec3::new(x, y, z) - 0.5) * self.volume.size() * EYES
        };
        let sees = |eye: &Vec3| (*eye - point).dot(normal) > 0.0 && self.is_free(*eye, point);
        let towards = (point - (0..TRIES).map(eye).find(sees)?).normalize_or(Vec3::NEG_Y);
        let direction = towards - normal * (2.0 * towards.dot(normal));
        let met_m = self.nearest_m(point, direction, f32::MAX);
        let way_m = met_m.unwrap_or_else(|| self.way_out_m(point, direction));
        Some(Way { origin_in_world: point, to_end: direction * way_m, ends_at_surface: met_m.is_some() })
    }

    /// The way from a point within the volume to its border.
    fn way_out_m(&self, point: Vec3, direction: Vec3) -> f32 {
        let border = Vec3::select(direction.cmpgt(Vec3::ZERO), self.volume.max, self.volume.min);
        ((border - point) / direction).abs().min_element().max(0.0)
    }
}
