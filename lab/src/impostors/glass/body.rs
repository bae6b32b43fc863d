//! A body of glass, and the ways to find where a ray leaves it that do not look inside: none at all, and the paper's (Wyman 2005).

use anyhow::Context as _;
use depth_image::{Aabb, Ray};
use glam::Vec3;
use render::scalar;
use render::scalar::glass::{deflected, fresnel};
use scene::{Material, Mesh, MeshPart, Scene, Volume};

use crate::failures::stand::Stand;
use crate::graph::Met;

/// Surfaces nearer than this share of the body's size are the one that a ray begins on.
const NEAR_SHARE: f32 = 0.002;

/// A closed body of one material.
pub struct Body {
    fronts: scalar::rays::Scene,
    /// The triangles turned over, which a ray inside meets.
    backs: scalar::rays::Scene,
    pub bounds: Aabb,
    pub ior: f32,
    absorption_per_m: Vec3,
}

/// The place where an eye's ray enters a body. Directions and normals are unit vectors.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    pub eye: Vec3,
    pub point: Vec3,
    pub normal: Vec3,
    pub direction: Vec3,
}

/// The ray that leaves a body, and the share of the light from its end that the eye sees.
#[derive(Debug, Clone, Copy)]
pub struct Emerged {
    pub ray: Ray,
    pub throughput_linear: Vec3,
    /// All light was reflected at the last surface, and the ray is what it became there.
    pub is_reflected: bool,
}

/// The parts of a scene's only mesh that have these numbers.
pub fn of_parts(scene: &Scene, numbers: &[usize]) -> Scene {
    let mut some = scene.clone();
    some.meshes = scene.meshes.iter().map(|mesh| mesh_of_parts(mesh, numbers)).collect();
    some
}

fn mesh_of_parts(mesh: &Mesh, numbers: &[usize]) -> Mesh {
    let mut some = Mesh { indices: Vec::new(), parts: Vec::new(), ..mesh.clone() };
    for part in numbers.iter().map(|&number| &mesh.parts[number]) {
        let first_index = some.indices.len() as u32;
        some.indices.extend(&mesh.indices[part.first_index as usize..][..part.index_count as usize]);
        some.parts.push(MeshPart { first_index, ..*part });
    }
    some
}

/// Turns a surface over and makes it opaque.
fn turned_over(scene: &Scene) -> Scene {
    let mut turned = scene.clone();
    for mesh in &mut turned.meshes {
        mesh.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|corners| corners.reverse());
        mesh.vertices.iter_mut().for_each(|vertex| vertex.normal = vertex.normal.map(|part| -part));
    }
    turned.materials = scene.materials.iter().map(|_| Material::default()).collect();
    turned
}

impl Body {
    /// # Errors
    /// The scene has no glass, or the device fails.
    pub fn new(stand: &Stand, scene: &Scene) -> anyhow::Result<Self> {
        let part = scene.meshes.iter().flat_map(|mesh| &mesh.parts).next().context("a body has a part")?;
        let material = &scene.materials[part.material as usize];
        anyhow::ensure!(material.is_transmissive(), "{} is no glass", scene.name);
        let fronts = scalar::rays::Scene::of(&stand.upload(scene)?, 0.0)?;
        let bounds = Aabb::around(fronts.triangles_in_world().flatten());
        Ok(Self {
            fronts,
            backs: scalar::rays::Scene::of(&stand.upload(&turned_over(scene))?, 0.0)?,
            bounds,
            ior: material.ior,
            absorption_per_m: material.volume.as_ref().map_or(Vec3::ZERO, Volume::absorption_per_m),
        })
    }

    pub fn near_m(&self) -> f32 {
        NEAR_SHARE * self.bounds.size().length()
    }

    /// The first back on a ray between two of its parameters.
    pub fn meet_back(&self, ray: &Ray, [near, far]: [f32; 2]) -> Option<Met> {
        let hit = self.backs.closest_between(ray, near, far)?;
        Some(Met { t: hit.t, normal_in_world: self.backs.normal_in_world(&hit), color_linear: Vec3::ONE })
    }

    /// Finds the place where a ray of unit length enters.
    pub fn entry(&self, ray: &Ray) -> Option<Entry> {
        let hit = self.fronts.closest(ray, 0.0).filter(|hit| hit.front)?;
        Some(Entry {
            eye: ray.origin_in_world,
            point: ray.at(hit.t),
            normal: self.fronts.normal_in_world(&hit),
            direction: ray.direction_in_world,
        })
    }

    /// The first ray inside.
    pub fn inner(&self, entry: &Entry) -> Ray {
        let inside = deflected(entry.direction, entry.normal, 1.0 / self.ior);
        Ray { origin_in_world: entry.point, direction_in_world: inside.direction }
    }

    /// The share of light that passes the first surface.
    pub fn passes_first(&self, entry: &Entry) -> f32 {
        1.0 - fresnel((-entry.direction.dot(entry.normal)).clamp(0.0, 1.0), 1.0 / self.ior)
    }

    /// The share that a way inside leaves.
    pub fn left_by(&self, way_m: f32) -> Vec3 {
        (-self.absorption_per_m * way_m).exp()
    }

    /// Leaves through a surface whose normal points inwards. A total reflection is not followed.
    pub fn leave(&self, inner: &Ray, way_m: f32, normal: Vec3, so_far: Vec3) -> Emerged {
        let direction = inner.direction_in_world;
        let deflection = deflected(direction, normal, self.ior);
        let cosine = (-direction.dot(normal)).clamp(0.0, 1.0);
        let passes = if deflection.is_total { 1.0 } else { 1.0 - fresnel(cosine, self.ior) };
        Emerged {
            ray: Ray { origin_in_world: inner.at(way_m), direction_in_world: deflection.direction },
            throughput_linear: so_far * self.left_by(way_m) * passes,
            is_reflected: deflection.is_total,
        }
    }

    /// The body's depth from an entry on, in one direction.
    fn depth_m(&self, entry: &Entry, direction_in_world: Vec3) -> f32 {
        let ray = Ray { origin_in_world: entry.point, direction_in_world };
        self.backs.closest(&ray, self.near_m()).map_or(0.0, |hit| hit.t)
    }

    /// One interface: the ray inside goes on for ever.
    pub fn by_one_interface(&self, entry: &Entry) -> Emerged {
        let throughput_linear = Vec3::splat(self.passes_first(entry));
        Emerged { ray: self.inner(entry), throughput_linear, is_reflected: false }
    }

    /// The way inside is guessed from the body's depth along the eye's ray and along the normal, and the second surface is what the eye
    /// sees of the backs at that place. Backs are looked up by rays, at no texels' cost.
    pub fn by_wyman(&self, entry: &Entry) -> Emerged {
        let inner = self.inner(entry);
        let [outside, inside] =
            [entry.direction, inner.direction_in_world].map(|way| (-way).angle_between(entry.normal));
        let share = if outside > 1e-4 { inside / outside } else { 1.0 / self.ior };
        let way_m = share * self.depth_m(entry, entry.direction) + (1.0 - share) * self.depth_m(entry, -entry.normal);
        let towards = (inner.at(way_m) - entry.eye).normalize_or(entry.direction);
        let look = Ray { origin_in_world: entry.eye, direction_in_world: towards };
        let so_far = Vec3::splat(self.passes_first(entry));
        match self.backs.closest(&look, 0.0) {
            Some(hit) => self.leave(&inner, way_m, self.backs.normal_in_world(&hit), so_far),
            // Beside the body there is no second surface.
            None => Emerged { throughput_linear: so_far * self.left_by(way_m), ..self.by_one_interface(entry) },
        }
    }
}
