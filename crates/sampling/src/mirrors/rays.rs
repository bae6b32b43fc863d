//! Rays off mirrors through the triangles of a scene.

use depth_image::Aabb;
use glam::{Vec3, Vec3A};
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use scene::Scene;

use super::groups::{SurfacePoint, spread_2d};

/// A tree over more triangles is not built.
const MOST_TRIANGLES: u64 = 4_000_000;
/// Eyes are spread over the scene's volume, made this many times as large.
const EYES: f32 = 2.0;
/// Eyes that are tried for a point; it is left out if none of them sees it.
const TRIES: usize = 8;
/// Rays begin this far off a surface, in diagonals of the scene.
const OFF: f32 = 1e-4;
/// The last part of a way, in which nothing hides its end: in diagonals of the scene, and at most this share of the way.
const LAST: f32 = 1e-3;
const LAST_PART: f32 = 0.01;
/// Rays leave the scene this far beyond its volume, in diagonals.
const BEYOND: f32 = 0.01;
/// Places along a way, its end among them.
pub(super) const PLACES: usize = 8;

/// The triangles of a scene as it first is.
pub(super) struct Triangles {
    tree: CwBvh,
    corners: Vec<[Vec3; 3]>,
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
    /// `None` where there are too many, or too many in one place.
    pub fn of(scene: &Scene, volume: Aabb) -> Option<Self> {
        if scene.triangle_count() > MOST_TRIANGLES {
            return None;
        }
        let (mut corners, mut double_sided) = (Vec::new(), Vec::new());
        for instance in &scene.instances {
            let mesh = &scene.meshes[instance.mesh as usize];
            let corner = |index: &u32| {
                instance.world_from_mesh.transform_point3(Vec3::from(mesh.vertices[*index as usize].position))
            };
            for part in &mesh.parts {
                let indices = &mesh.indices[part.first_index as usize..][..part.index_count as usize];
                corners.extend(indices.as_chunks::<3>().0.iter().map(|triangle| triangle.each_ref().map(corner)));
                double_sided.resize(corners.len(), scene.materials[part.material as usize].double_sided);
            }
        }
        let tree = render::host_tree(&corners)?;
        Some(Self { tree, corners, double_sided, volume })
    }

    fn ray(&self, origin_in_world: Vec3, direction: Vec3, far_m: f32) -> Ray {
        Ray::new(origin_in_world.into(), direction.into(), OFF * self.volume.size().length(), far_m)
    }

    /// Where a ray meets a triangle. Backs of single-sided ones are not there.
    fn met(&self, ray: &Ray, slot: usize) -> f32 {
        let index = self.tree.primitive_indices[slot] as usize;
        let [v0, v1, v2] = self.corners[index].map(Vec3A::from);
        let triangle = Triangle { v0, v1, v2 };
        let is_back = (v1 - v0).cross(v2 - v0).dot(ray.direction) > 0.0;
        if is_back && !self.double_sided[index] { f32::INFINITY } else { triangle.intersect(ray) }
    }

    /// Whether nothing lies between two points.
    pub fn is_free(&self, from: Vec3, to: Vec3) -> bool {
        let way_m = from.distance(to);
        let last_m = (LAST * self.volume.size().length()).min(LAST_PART * way_m);
        let ray = self.ray(from, (to - from) / way_m.max(f32::MIN_POSITIVE), way_m - last_m);
        ray.tmax <= ray.tmin || self.tree.ray_traverse_miss(ray, |ray, slot| self.met(ray, slot))
    }

    /// The way of a ray from an eye that sees a mirror's point. The number decides the eye. `None` where no eye sees it.
    pub fn way(&self, mirror: &SurfacePoint, number: usize) -> Option<Way> {
        let point = mirror.point_in_world;
        let eye = |attempt: usize| {
            let number = number * TRIES + attempt;
            let [x, y] = spread_2d(number);
            let z = (number as f32 * 0.381_966).fract();
            self.volume.center() + (Vec3::new(x, y, z) - 0.5) * self.volume.size() * EYES
        };
        let faces = |eye: Vec3| mirror.double_sided || (eye - point).dot(mirror.normal) > 0.0;
        let eye = (0..TRIES).map(eye).find(|eye| faces(*eye) && self.is_free(*eye, point))?;
        // A reflection does not depend on the normal's sign.
        let direction = (point - eye).normalize_or(Vec3::NEG_Y).reflect(mirror.normal);
        let met = self.first_met(point, direction);
        let way_m = met.unwrap_or_else(|| self.way_out_m(point, direction));
        Some(Way { origin_in_world: point, to_end: direction * way_m, ends_at_surface: met.is_some() })
    }

    /// The parameter at which a ray first meets a surface.
    pub fn first_met(&self, origin_in_world: Vec3, direction: Vec3) -> Option<f32> {
        let mut hit = RayHit::none();
        let ray = self.ray(origin_in_world, direction, f32::MAX);
        self.tree.ray_traverse(ray, &mut hit, |ray, slot| self.met(ray, slot)).then_some(hit.t)
    }

    /// The way from a point within the volume to beyond its border.
    fn way_out_m(&self, point: Vec3, direction: Vec3) -> f32 {
        let beyond = self.volume.padded(BEYOND * self.volume.size().length());
        let border = Vec3::select(direction.cmpgt(Vec3::ZERO), beyond.max, beyond.min);
        let ways = (border - point) / direction;
        // A ray along a face never leaves through it.
        Vec3::select(direction.abs().cmpgt(Vec3::splat(1e-6)), ways, Vec3::MAX).min_element().max(0.0)
    }
}
