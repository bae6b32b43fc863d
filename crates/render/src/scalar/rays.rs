//! The twin of `rays/traverse.wgsl`: the same tree and triangles, the same operations on `f32` in the same order.
//! A device may differ where WGSL leaves it open: in the last bits of quotients, and in whether a product
//! and a sum are rounded once or twice.

use depth_image::{PinholeCamera, Ray, Reflector, SurfaceId, linear_from_srgb8, unit_from_oct16};
use glam::{FloatExt as _, UVec2, Vec2, Vec3, Vec4};
use obvhs::cwbvh::node::CwBvhNode;
use scene::Wrap;

use super::hashed_alpha::hashed_cutoff;
use crate::rays::flat::{
    ALPHA_HASHED, ALPHA_TESTED, CORNER_FLAGS, DOUBLE_SIDED, FlatDetail, FlatTriangle, FlatVertex, GLASS, SPECULAR,
    THIN, UNLIT,
};
use crate::rays::ray_scene::MATERIAL_TEXELS;
use crate::rays::traversal::{BOX_SLACK, EDGE_ROUNDINGS};
use crate::{GpuScene, RenderError, pixel_camera::PixelCamera};

/// The tables that a device has of a scene at one time, with triangles in the order of the tree's leaves.
#[derive(Debug, Clone)]
pub struct Scene {
    nodes: Vec<CwBvhNode>,
    /// Corners, and their numbers with the triangle's flags.
    corners: Vec<[[u32; 4]; 3]>,
    triangles: Vec<FlatTriangle>,
    vertices: Vec<FlatVertex>,
    details: Vec<FlatDetail>,
    materials: Vec<[u32; 4]>,
    texels: Vec<[u8; 4]>,
    /// The side of a pixel on a surface where a ray's parameter is 1: the size of cells of hashed alpha.
    pub footprint: f32,
}

/// A ray's crossing of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// The ray's parameter.
    pub t: f32,
    /// Place of the triangle in the order of the tree's leaves.
    pub slot: u32,
    /// Barycentric coordinates of the second and third corner.
    pub barycentric: [f32; 2],
    /// Whether the front was met.
    pub front: bool,
}

/// What a surface shows, under GGX.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// The material's colour and the vertices', linear.
    pub base_linear: Vec3,
    /// The share of light that it scatters.
    pub albedo_linear: Vec3,
    /// What it sends without light.
    pub emission_linear: Vec3,
    /// `None` where there are no highlights.
    pub reflector: Option<Reflector>,
}

/// What a surface lets through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Glass {
    pub transmission: f32,
    pub ior: f32,
    pub tint_linear: Vec3,
    pub absorption_per_m: Vec3,
    pub is_thin: bool,
}

/// The ray through the middle of a pixel, as on a device; its parameter is planar depth.
#[must_use]
pub fn pixel_ray(camera: &PinholeCamera, pixel: UVec2) -> Ray {
    let rays = PixelCamera::of(&(*camera).into(), Vec2::ZERO);
    let [column, row, corner] = [rays.column_in_world, rays.row_in_world, rays.corner_in_world].map(Vec3::from);
    let center = pixel.as_vec2() + 0.5;
    let direction_in_world = column * center.x + row * center.y + corner;
    Ray { origin_in_world: camera.eye_in_world, direction_in_world }
}

/// Greater than any parameter of a hit.
const FAR_AWAY: f32 = 3.0e38;

struct Traveller {
    origin: Vec3,
    direction: Vec3,
    inverse: Vec3,
    octant4: u32,
}

impl Traveller {
    fn of(ray: &Ray) -> Self {
        let direction = ray.direction_in_world;
        let octant: u32 = (0..3).map(|axis| if direction[axis] < 0.0 { 0 } else { 4 >> axis }).sum();
        Self {
            origin: ray.origin_in_world,
            direction,
            inverse: direction.map(|d| {
                let least = if d < 0.0 { -1e-20 } else { 1e-20 };
                1.0 / if d.abs() < 1e-20 { least } else { d }
            }),
            octant4: octant * 0x0101_0101,
        }
    }
}

/// Children of one node that are to be visited: inner ones in bits 24 to 31, by their distance.
#[derive(Clone, Copy)]
struct Todo {
    first_child: u32,
    hits: u32,
}

impl Todo {
    const ROOT: Self = Self { first_child: 0, hits: 0x8000_0000 };

    fn is_done(self) -> bool {
        self.hits <= 0x00ff_ffff
    }

    fn nearest_child(self, ray: &Traveller) -> u32 {
        let slot = (self.hits.ilog2() - 24) ^ (ray.octant4 & 255);
        self.first_child + (self.hits & !(u32::MAX << slot)).count_ones()
    }

    fn without_nearest(self) -> Self {
        Self { hits: self.hits & !(1 << self.hits.ilog2()), ..self }
    }
}

impl Scene {
    /// The tables that the device has of a scene at a scene time.
    ///
    /// # Errors
    /// When the device's textures are too small for the scene.
    pub fn of(scene: &GpuScene, scene_time_s: f32) -> Result<Self, RenderError> {
        let rays = &scene.rays;
        let mut state = rays.state.lock();
        let bvh = &rays.moved_to(scene_time_s, &mut state)?.bvh;
        Ok(Self {
            nodes: bvh.tree.nodes.clone(),
            corners: rays.corner_texels(bvh, &rays.corners_in_world(scene_time_s)),
            triangles: rays.triangles_of_leaves(bvh),
            vertices: rays.flat.vertices_at(scene_time_s).into_owned(),
            details: rays.flat.details_at(scene_time_s).into_owned(),
            materials: rays.materials.clone(),
            texels: rays.texels.clone(),
            footprint: 0.0,
        })
    }

    /// The nearest triangle beyond `near`; backs of single-sided ones are not there.
    #[must_use]
    pub fn closest(&self, ray: &Ray, near: f32) -> Option<Hit> {
        self.closest_between(ray, near, FAR_AWAY)
    }

    /// As [`Scene::closest`], among the triangles before `far`.
    #[must_use]
    pub fn closest_between(&self, ray: &Ray, near: f32, far: f32) -> Option<Hit> {
        let mut hit = None;
        self.search(ray, far, |ray, slot, t_max| {
            let crossing = self.crossing(slot, ray, t_max)?;
            let seen = crossing.front || self.has(slot, DOUBLE_SIDED);
            if seen && crossing.t > near && self.is_there(&crossing) {
                hit = Some(crossing);
            }
            hit.map(|hit| hit.t)
        });
        hit
    }

    /// Whether anything but glass lies before `t_max`, whichever way it faces.
    #[must_use]
    pub fn is_blocked(&self, ray: &Ray, t_max: f32) -> bool {
        let mut blocked = false;
        self.search(ray, t_max, |ray, slot, t_max| {
            let opaque = self.crossing(slot, ray, t_max).filter(|_| !self.has(slot, GLASS));
            blocked = opaque.is_some_and(|crossing| self.is_there(&crossing));
            blocked.then_some(f32::NEG_INFINITY)
        });
        blocked
    }

    /// All glass before `t_max`, in no order.
    pub(super) fn glass_before(&self, ray: &Ray, t_max: f32) -> Vec<(Hit, Glass)> {
        let mut found = Vec::new();
        self.search(ray, t_max, |ray, slot, t_max| {
            let hit = self.crossing(slot, ray, t_max).filter(|hit| self.is_there(hit));
            found.extend(hit.and_then(|hit| Some((hit, self.glass(&hit)?))));
            None
        });
        found
    }

    /// What a surface whose material has no textures lets through; `None` for opaque ones.
    pub(super) fn glass(&self, hit: &Hit) -> Option<Glass> {
        let FlatTriangle { material, flags, .. } = self.triangles[hit.slot as usize];
        let [coat, open, medium] =
            [2, 6, 7].map(|part| self.materials[(material * MATERIAL_TEXELS + part) as usize].map(f32::from_bits));
        let [r, g, b, ior] = medium;
        (flags & GLASS != 0).then(|| Glass {
            transmission: open[3] * (1.0 - coat[0]),
            ior,
            tint_linear: self.look(hit).base_linear,
            absorption_per_m: Vec3::new(r, g, b),
            is_thin: flags & THIN != 0,
        })
    }

    /// The surface that a hit lies on.
    #[must_use]
    pub fn surface_id(&self, hit: &Hit) -> SurfaceId {
        let FlatTriangle { instance, primitive, .. } = self.triangles[hit.slot as usize];
        SurfaceId { instance, primitive }
    }

    /// Between the corners', towards the side that was met; unit length.
    #[must_use]
    pub fn normal_in_world(&self, hit: &Hit) -> Vec3 {
        let [b, c] = hit.barycentric;
        let corners = self.corners[hit.slot as usize].map(|corner| corner[3] & !CORNER_FLAGS);
        let normals = corners.map(|number| unit_from_oct16(self.vertices[number as usize].normal_oct16));
        let normal = normals[0] * (1.0 - b - c) + normals[1] * b + normals[2] * c;
        normal.normalize_or_zero() * if hit.front { 1.0 } else { -1.0 }
    }

    /// The triangle's own, towards the side that was met; unit length.
    #[must_use]
    pub fn triangle_normal_in_world(&self, hit: &Hit) -> Vec3 {
        let [a, b, c] = self.corners_of(hit.slot);
        (b - a).cross(c - a).normalize_or_zero() * if hit.front { 1.0 } else { -1.0 }
    }

    /// The look of a triangle whose material has no textures.
    #[must_use]
    pub fn look(&self, hit: &Hit) -> Look {
        let FlatTriangle { material, flags, .. } = self.triangles[hit.slot as usize];
        let [base, emission, coat, dielectric] = [0, 1, 2, 3]
            .map(|part| Vec4::from(self.materials[(material * MATERIAL_TEXELS + part) as usize].map(f32::from_bits)));
        let [metallic, roughness, ..] = coat.to_array();
        let numbers = self.numbers_of(hit);
        let shares = hit.shares();
        let vertex_linear = (0..3).map(|i| {
            let [r, g, b, _] = self.vertices[numbers[i]].color_srgba8;
            Vec3::from([r, g, b].map(linear_from_srgb8)) * shares[i]
        });
        let base_linear = base.truncate() * vertex_linear.sum::<Vec3>();
        let reflectance_linear = dielectric.truncate().lerp(base_linear, metallic);
        let is_unlit = flags & UNLIT != 0;
        let is_glossy = flags & SPECULAR != 0 && !is_unlit;
        Look {
            base_linear,
            albedo_linear: if is_unlit { Vec3::ZERO } else { base_linear * (1.0 - metallic) },
            emission_linear: emission.truncate() + if is_unlit { base_linear } else { Vec3::ZERO },
            // In the bits that a device has of it.
            reflector: Reflector::unpack(Reflector { reflectance_linear, roughness }.pack()).filter(|_| is_glossy),
        }
    }

    /// Mean curvature of a triangle's surface, by how its normal turns along the edges; positive where convex.
    pub(super) fn curvature_per_m(&self, hit: &Hit) -> f32 {
        let corners = self.corners_of(hit.slot);
        let normals = self.numbers_of(hit).map(|number| unit_from_oct16(self.vertices[number].normal_oct16));
        let turns = (0..3).map(|i| {
            let edge = corners[(i + 1) % 3] - corners[i];
            let next = normals[(i + 1) % 3];
            (next - normals[i]).dot(edge) / edge.length_squared().max(1e-20)
        });
        turns.sum::<f32>() / 3.0 * if hit.front { 1.0 } else { -1.0 }
    }

    /// Corners of all triangles.
    pub fn triangles_in_world(&self) -> impl Iterator<Item = [Vec3; 3]> {
        (0..self.corners.len() as u32).map(|slot| self.corners_of(slot))
    }

    /// Walks the tree front to back. `test` is asked about triangles with the greatest parameter that matters, and
    /// gives a lesser one once it is known; below zero the search is over.
    fn search(&self, ray: &Ray, mut t_max: f32, mut test: impl FnMut(&Traveller, u32, f32) -> Option<f32>) {
        let ray = &Traveller::of(ray);
        let mut stack = Vec::new();
        let mut todo = Todo::ROOT;
        while !todo.is_done() && t_max >= 0.0 {
            let child = todo.nearest_child(ray);
            let rest = todo.without_nearest();
            if !rest.is_done() {
                stack.push(rest);
            }
            let node = &self.nodes[child as usize];
            let hits = met_children(node, ray, t_max);
            todo = Todo { first_child: node.child_base_idx, hits: hits & 0xff00_0000 | u32::from(node.imask) };
            let mut triangles = hits & 0x00ff_ffff;
            while triangles != 0 && t_max >= 0.0 {
                let slot = node.primitive_base_idx + triangles.trailing_zeros();
                t_max = test(ray, slot, t_max).unwrap_or(t_max);
                triangles &= triangles - 1;
            }
            if todo.is_done() {
                todo = stack.pop().unwrap_or(todo);
            }
        }
    }

    fn corners_of(&self, slot: u32) -> [Vec3; 3] {
        self.corners[slot as usize].map(|[x, y, z, _]| Vec3::from([x, y, z].map(f32::from_bits)))
    }

    fn has(&self, slot: u32, flag: u32) -> bool {
        self.corners[slot as usize][0][3] & flag != 0
    }

    fn crossing(&self, slot: u32, ray: &Traveller, t_max: f32) -> Option<Hit> {
        let [a, b, c] = self.corners_of(slot).map(|corner| corner - ray.origin);
        let from_b = dot((c - a).cross(c + a), ray.direction);
        let from_c = dot((a - b).cross(a + b), ray.direction);
        let from_a = dot((b - c).cross(b + c), ray.direction);
        let least = from_a.min(from_b).min(from_c);
        let greatest = from_a.max(from_b).max(from_c);
        let normal = (a - b).cross(c - a);
        let along = dot(normal, ray.direction);
        let t = dot(a, normal) / if along == 0.0 { 1e-30 } else { along };
        let sum = from_a + from_b + from_c;
        let share = 1.0 / if sum == 0.0 { 1e-30 } else { sum };
        let reach = taxicab(a).max(taxicab(b)).max(taxicab(c));
        let slack = EDGE_ROUNDINGS * reach * taxicab(c - a).max(taxicab(a - b)) * taxicab(ray.direction);
        let beside = least >= -slack || greatest <= slack;
        let met = beside && sum.abs() > 2.0 * slack && along != 0.0 && t > 0.0 && t < t_max;
        met.then_some(Hit { t, slot, barycentric: [from_b * share, from_c * share], front: along > 0.0 })
    }

    /// Whether a texture leaves the triangle where it is met.
    fn is_there(&self, hit: &Hit) -> bool {
        if !self.has(hit.slot, ALPHA_TESTED) {
            return true;
        }
        let FlatTriangle { material, flags, .. } = self.triangles[hit.slot as usize];
        let material = (material * MATERIAL_TEXELS) as usize;
        let cutoff = if flags & ALPHA_HASHED != 0 {
            let places = self.numbers_of(hit).map(|number| Vec3::from(self.details[number].place_m));
            let place_m = (0..3).map(|i| places[i] * hit.shares()[i]).sum();
            hashed_cutoff(place_m, hit.t * self.footprint)
        } else {
            f32::from_bits(self.materials[material + 1][3])
        };
        self.alpha(material, hit) >= cutoff
    }

    /// Numbers of a triangle's vertices.
    fn numbers_of(&self, hit: &Hit) -> [usize; 3] {
        self.corners[hit.slot as usize].map(|corner| (corner[3] & !CORNER_FLAGS) as usize)
    }

    fn alpha(&self, material: usize, hit: &Hit) -> f32 {
        let numbers = self.numbers_of(hit);
        let shares = hit.shares();
        let used = self.materials[material + 2][3] & 31;
        let uvs = numbers.map(|number| {
            let second = used & 1 != 0;
            Vec2::from(if second { self.details[number].uv } else { self.vertices[number].uv })
        });
        let uv: Vec2 = (0..3).map(|i| uvs[i] * shares[i]).sum();
        let alphas = numbers.map(|number| f32::from(self.vertices[number].color_srgba8[3]) / 255.0);
        let vertex_alpha: f32 = (0..3).map(|i| alphas[i] * shares[i]).sum();
        let [first, packed_size, ..] = self.materials[material + 4];
        let wraps = [used >> 1 & 3, used >> 3 & 3];
        f32::from_bits(self.materials[material][3]) * vertex_alpha * self.texture_alpha(first, packed_size, uv, wraps)
    }

    /// Bilinear, of the finest level; 1 where there is no texture.
    fn texture_alpha(&self, first: u32, packed_size: u32, uv: Vec2, wraps: [u32; 2]) -> f32 {
        if packed_size == 0 {
            return 1.0;
        }
        let size = UVec2::new(packed_size & 0xffff, packed_size >> 16);
        let wrapped = Vec2::new(wrapped(uv.x, wraps[0]), wrapped(uv.y, wraps[1]));
        let at = wrapped * size.as_vec2() - 0.5;
        let low = at.floor();
        let share = at - at.floor();
        let [a, b, c, d] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| {
            let x = texel_place(low.x as i32 + x, size.x, wraps[0]);
            let y = texel_place(low.y as i32 + y, size.y, wraps[1]);
            f32::from(self.texels[(first + y * size.x + x) as usize][3]) / 255.0
        });
        mix(mix(a, b, share.x), mix(c, d, share.x), share.y)
    }
}

fn texel_place(at: i32, size: u32, wrap: u32) -> u32 {
    if wrap == Wrap::Repeat as u32 { at.rem_euclid(size as i32) as u32 } else { at.clamp(0, size as i32 - 1) as u32 }
}

fn mix(a: f32, b: f32, share: f32) -> f32 {
    a * (1.0 - share) + b * share
}

impl Hit {
    /// Barycentric coordinates of all corners.
    fn shares(&self) -> [f32; 3] {
        let [second, third] = self.barycentric;
        [1.0 - second - third, second, third]
    }
}

/// A place in a texture, from 0 to 1.
fn wrapped(at: f32, wrap: u32) -> f32 {
    if wrap == Wrap::Mirror as u32 {
        1.0 - (1.0 - 2.0 * (at * 0.5).fract_gl()).abs()
    } else if wrap == Wrap::Clamp as u32 {
        at.clamp(0.0, 1.0)
    } else {
        at.fract_gl()
    }
}

fn taxicab(v: Vec3) -> f32 {
    v.x.abs() + v.y.abs() + v.z.abs()
}

/// The sum from the last to the first product, as the software device has it.
fn dot(a: Vec3, b: Vec3) -> f32 {
    a.z * b.z + a.y * b.y + a.x * b.x
}

/// Inner children that the ray meets as bits 24 to 31 in the order of their distance, triangles below.
fn met_children(node: &CwBvhNode, ray: &Traveller, t_max: f32) -> u32 {
    let slope = Vec3::from(node.e.map(|e| f32::from_bits(u32::from(e) << 23))) * ray.inverse;
    let start = (node.p - ray.origin) * ray.inverse;
    let planes = [
        (&node.child_min_x, &node.child_max_x),
        (&node.child_min_y, &node.child_max_y),
        (&node.child_min_z, &node.child_max_z),
    ];
    (0..8).fold(0, |hits, child| {
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let (min, max) = planes[axis];
            let [near, far] = if ray.direction[axis] < 0.0 { [max, min] } else { [min, max] };
            [near, far].map(|bytes| f32::from(bytes[child]) * slope[axis] + start[axis])
        });
        let enter = x[0].max(y[0]).max(z[0].max(0.0));
        let leave = x[1].min(y[1]).min(z[1].min(t_max));
        let meta = u32::from(node.child_meta[child]);
        let is_inner = meta & (meta << 1) & 0x10 != 0;
        let place = (meta ^ if is_inner { ray.octant4 & 255 } else { 0 }) & 31;
        if enter <= leave * BOX_SLACK { hits | (meta >> 5) << place } else { hits }
    })
}
