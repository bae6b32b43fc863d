//! A scene's triangles on the device, as rays need them: made when rays are first traced, moved when scene time is.

use std::borrow::Cow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytemuck::NoUninit;
use glam::{Vec3, Vec4};
use gpu::{Binding, Gpu, GpuError, Table};
use parking_lot::Mutex;
use rayon::prelude::*;
use scene::{Material, Scene, Texture, TextureUse, Volume};
use wgpu::TextureFormat;

use super::bvh::{Bvh, MAX_DEPTH};
use super::flat::{CORNER_FLAGS, FlatScene, FlatTriangle, MAX_VERTICES, OrderedMesh};
use super::traversal::Traversal;
use crate::material::{normal_scale, phong_reflector};
use crate::{few_cores::on_free_cores, motion::Motion, texture};

/// The making of the tree over a scene's triangles.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AccelerationReport {
    /// Boxes were moved, not made anew.
    pub refitted: bool,
    /// Expected visits and tests of a random ray through the scene's box.
    pub cost: f32,
    /// Instances counted each.
    pub triangles: usize,
    /// Nodes from the root to the deepest.
    pub depth: u32,
}

/// The part of a scene that rays are traced against. Trees stand for one scene time, the last that was asked for.
pub struct RayScene {
    gpu: Arc<Gpu>,
    pub(crate) flat: FlatScene,
    pub(crate) materials: Vec<[u32; 4]>,
    pub(crate) texels: Vec<[u8; 4]>,
    pub(crate) traversal: Traversal,
    pub(crate) state: Mutex<Option<Built>>,
}

pub(crate) struct Built {
    pub bvh: Bvh,
    scene_time_s: f32,
    traced: Arc<Traced>,
    last_refit: Option<Duration>,
    last_build: Duration,
}

/// The tables of `traverse.wgsl`: two of the tree, two of vertices, which change where normals turn, and three that stay while
/// triangles move.
const TABLES: [&str; 7] =
    ["bvh_nodes", "triangle_corners", "flat_vertices", "flat_details", "flat_triangles", "materials", "texels"];

/// Bound to shaders that trace rays.
pub struct Traced {
    /// One for each of the variables [`TABLES`].
    tables: [Arc<Table>; 7],
    pub(crate) traversal: Traversal,
    /// The making of the tree.
    pub report: AccelerationReport,
}

impl RayScene {
    /// Keeps what trees are made of, with the scene's textures at the levels that fit one table; nothing is built or uploaded
    /// before it is needed.
    pub(crate) fn of(
        gpu: &Arc<Gpu>,
        scene: &Scene,
        textures: &[Cow<'_, Texture>],
        ordered: &[OrderedMesh<'_>],
        motion: Option<Arc<Motion>>,
    ) -> Self {
        let mut texels: Vec<[u8; 4]> = Vec::new();
        let mut places = Vec::with_capacity(textures.len());
        for texture in textures {
            places.push([texels.len() as u32, texture.width_px | texture.height_px << 16]);
            texture::mips(texture).for_each(|level| texels.extend(level.srgba8.as_chunks::<4>().0));
        }
        let materials = scene.materials.iter().flat_map(|material| material_texels(material, &places)).collect();
        let traversal = Traversal::new(scene);
        let flat = FlatScene::of(scene, ordered, motion, traversal.mapped);
        Self { gpu: gpu.clone(), flat, materials, texels, traversal, state: Mutex::default() }
    }

    /// Triangles and the tree over them at a scene time. A tree of another time is refitted where that costs less
    /// than a new one and its boxes have not grown too far.
    ///
    /// # Errors
    /// When the device's textures are too small for the scene.
    pub fn at(&self, scene_time_s: f32) -> Result<Arc<Traced>, GpuError> {
        let mut state = self.state.lock();
        Ok(self.moved_to(scene_time_s, &mut state)?.traced.clone())
    }

    /// The bytes of all tables on the device: none before rays are traced, nor while a tree is being made.
    pub fn bytes(&self) -> u64 {
        let state = self.state.try_lock();
        state.and_then(|state| state.as_ref().map(|built| built.traced.bytes())).unwrap_or(0)
    }

    pub(crate) fn moved_to<'s>(&self, scene_time_s: f32, state: &'s mut Option<Built>) -> Result<&'s Built, GpuError> {
        let next = match state.take() {
            Some(built) if !self.flat.moves() || built.scene_time_s == scene_time_s => built,
            // Whichever took less time when it was last done.
            Some(built) if built.last_refit.is_none_or(|refit| refit < built.last_build) => {
                self.refitted(built, scene_time_s)?
            }
            _ => self.built(scene_time_s)?,
        };
        Ok(state.insert(next))
    }

    pub(crate) fn corners_in_world(&self, scene_time_s: f32) -> Vec<[Vec3; 3]> {
        let positions = self.flat.positions_in_world(scene_time_s);
        self.flat.corners.par_iter().map(|corners| corners.map(|i| positions[i as usize])).collect()
    }

    fn built(&self, scene_time_s: f32) -> Result<Built, GpuError> {
        GpuError::check_limit("the vertices of all instances", self.flat.vertices.len() as u64, MAX_VERTICES)?;
        let start = Instant::now();
        let (corners, bvh) = on_free_cores(self.gpu.device_queue.cuts(), || {
            let corners = self.corners_in_world(scene_time_s);
            let bvh = Bvh::build(&corners);
            (corners, bvh)
        });
        GpuError::check_limit("levels of the tree over the scene", u64::from(bvh.depth), u64::from(MAX_DEPTH))?;
        let took = start.elapsed();
        let fixed = [
            self.table("triangle attributes", &self.triangles_of_leaves(&bvh))?,
            self.table("materials", &self.materials)?,
            Arc::new(Table::new(&self.gpu, "texels", TextureFormat::R32Uint, &self.texels)?),
        ];
        let attributes = self.attributes(scene_time_s)?;
        let traced = self.traced(&bvh, &corners, attributes, fixed, false)?;
        Ok(Built { bvh, scene_time_s, traced, last_refit: None, last_build: took })
    }

    fn refitted(&self, mut built: Built, scene_time_s: f32) -> Result<Built, GpuError> {
        let start = Instant::now();
        let corners = on_free_cores(self.gpu.device_queue.cuts(), || {
            let corners = self.corners_in_world(scene_time_s);
            built.bvh.refit(&corners);
            corners
        });
        if built.bvh.is_worn() {
            return self.built(scene_time_s);
        }
        let took = start.elapsed();
        let [_, _, vertices, details, fixed @ ..] = built.traced.tables.clone();
        let attributes = if self.flat.turns() { self.attributes(scene_time_s)? } else { [vertices, details] };
        let traced = self.traced(&built.bvh, &corners, attributes, fixed, true)?;
        Ok(Built { scene_time_s, traced, last_refit: Some(took), ..built })
    }

    /// Attributes of vertices at a scene time.
    fn attributes(&self, scene_time_s: f32) -> Result<[Arc<Table>; 2], GpuError> {
        let details = self.flat.details_at(scene_time_s);
        let details = bytemuck::cast_slice::<_, [u32; 4]>(&details);
        let vertices = self.table("vertex attributes", &self.flat.vertices_at(scene_time_s))?;
        Ok([vertices, self.table("vertex details", details)?])
    }

    /// A table of texels of four words.
    fn table<T: NoUninit>(&self, label: &str, elements: &[T]) -> Result<Arc<Table>, GpuError> {
        Ok(Arc::new(Table::new(&self.gpu, label, TextureFormat::Rgba32Uint, elements)?))
    }

    fn traced(
        &self,
        bvh: &Bvh,
        corners_in_world: &[[Vec3; 3]],
        [vertices, details]: [Arc<Table>; 2],
        [triangles, materials, texels]: [Arc<Table>; 3],
        refitted: bool,
    ) -> Result<Arc<Traced>, GpuError> {
        let nodes = self.table("nodes", &bvh.tree.nodes)?;
        let corners = self.table("triangles", &self.corner_texels(bvh, corners_in_world))?;
        let report =
            AccelerationReport { refitted, cost: bvh.cost, triangles: corners_in_world.len(), depth: bvh.depth };
        tracing::debug!(?report, "rays are ready");
        let tables = [nodes, corners, vertices, details, triangles, materials, texels];
        Ok(Arc::new(Traced { tables, traversal: self.traversal.with_depth(bvh.depth), report }))
    }

    /// Three texels a triangle in the order of the tree's leaves: a corner's position, and its number with the
    /// triangle's flags.
    pub(crate) fn corner_texels(&self, bvh: &Bvh, corners_in_world: &[[Vec3; 3]]) -> Vec<[[u32; 4]; 3]> {
        let triangles = bvh.tree.primitive_indices.par_iter().map(|&triangle| {
            let triangle = triangle as usize;
            let points = corners_in_world[triangle];
            let numbers = self.flat.corners[triangle];
            let flags = self.flat.triangles[triangle].flags & CORNER_FLAGS;
            std::array::from_fn(|i| {
                let [x, y, z] = points[i].to_array().map(f32::to_bits);
                [x, y, z, numbers[i] | flags]
            })
        });
        triangles.collect()
    }

    pub(crate) fn triangles_of_leaves(&self, bvh: &Bvh) -> Vec<FlatTriangle> {
        bvh.tree.primitive_indices.iter().map(|&triangle| self.flat.triangles[triangle as usize]).collect()
    }
}

impl Traced {
    fn bytes(&self) -> u64 {
        self.tables.iter().map(|table| gpu::texture_bytes(table.texture())).sum()
    }

    /// The variables of `traverse.wgsl`.
    pub fn bindings(&self) -> [Binding<'_>; 7] {
        std::array::from_fn(|number| Binding::texture(TABLES[number], &self.tables[number]))
    }
}

/// Texels of a material, which rays/material.wgsl lists.
pub(crate) const MATERIAL_TEXELS: u32 = 8;

/// `places` are the first texel and the packed size of each texture.
fn material_texels(material: &Material, places: &[[u32; 2]]) -> [[u32; 4]; MATERIAL_TEXELS as usize] {
    let emission = Vec4::from((material.emissive_linear, material.alpha_cutoff));
    let dielectric = Vec4::from((material.dielectric_reflectance_linear, normal_scale(material)));
    let [[base, base_size], [coat, coat_size], [normal, normal_size], [emissive, emissive_size], [open, open_size]] =
        material.textures().map(|texture| texture.map_or([0, 0], |used| places[used.texture as usize]));
    let uses = material.textures().map(|texture| texture.map_or(0, use_bits));
    let uses = uses.into_iter().rev().fold(0, |all, bits| all << 5 | bits);
    let strength = material.occlusion_strength.to_bits();
    let absorption_per_m = material.volume.as_ref().map_or(Vec3::ZERO, Volume::absorption_per_m);
    let medium = Vec4::from((absorption_per_m, material.ior));
    [
        material.base_color_linear.map(f32::to_bits),
        emission.to_array().map(f32::to_bits),
        [material.metallic.to_bits(), material.roughness.to_bits(), phong_reflector(material), uses],
        dielectric.to_array().map(f32::to_bits),
        [base, base_size, coat, coat_size],
        [normal, normal_size, emissive, emissive_size],
        [open, open_size, strength, material.transmission.to_bits()],
        medium.to_array().map(f32::to_bits),
    ]
}

/// The five bits of a texture's use that `use_of` of rays/material.wgsl returns.
fn use_bits(texture: TextureUse) -> u32 {
    u32::from(texture.second_uv) | (texture.wrap[0] as u32) << 1 | (texture.wrap[1] as u32) << 3
}
