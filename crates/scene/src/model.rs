//! The scene as plain data, equal on every node.

use depth_image::{Aabb, EnvironmentMap, Illumination};
use glam::{Affine3A, DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// A renderable scene. All indices of a scene from this crate are valid.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Name of the scene in reports.
    pub name: String,
    /// Triangle meshes in their own space.
    pub meshes: Vec<Mesh>,
    /// Placements of meshes in the world.
    pub instances: Vec<Instance>,
    /// Surface descriptions; never empty.
    pub materials: Vec<Material>,
    /// Images that materials refer to.
    pub textures: Vec<Texture>,
    /// Lamps and environment. A scene without light is black and valid.
    pub illumination: Illumination,
    /// The map of an [environment](Illumination::environment) that is mapped.
    pub environment_map: Option<EnvironmentMap>,
    /// Colour of pixels without a surface, linear RGB.
    pub background_linear: Vec3,
    /// Cameras that the source file listed.
    pub cameras: Vec<SourceCamera>,
    /// Motion as a function of scene time; `None` for a static scene.
    pub wind: Option<Wind>,
    /// The point of the source file's space that became the world's origin.
    pub origin_in_source: DVec3,
}

impl Scene {
    /// The box around all surfaces at every scene time, including the wind's sway. Empty for a scene without vertices.
    #[must_use]
    pub fn bounds(&self) -> Aabb {
        let boxes = self.instances.iter().filter_map(|instance| {
            let mesh = self.meshes.get(instance.mesh as usize)?;
            Some(self.mesh_bounds_in_world(mesh, instance.world_from_mesh))
        });
        boxes.filter(|b| !b.is_empty()).fold(Aabb::EMPTY, |all, b| all.grown_to(b.min).grown_to(b.max))
    }

    fn mesh_bounds_in_world(&self, mesh: &Mesh, world_from_mesh: Affine3A) -> Aabb {
        let points = mesh.vertices.iter().map(|v| world_from_mesh.transform_point3(Vec3::from(v.position)));
        let at_rest = Aabb::around(points);
        let sway = mesh.vertices.iter().fold(0.0f32, |most, v| most.max(v.sway));
        let reach = self.wind.map_or(Vec3::ZERO, |w| (w.direction_in_world * w.amplitude_m * sway).abs());
        Aabb { min: at_rest.min - reach, max: at_rest.max + reach }
    }

    /// Triangles as drawn: a mesh's count once for each of its instances.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        let of = |mesh: u32| self.meshes.get(mesh as usize).map_or(0, Mesh::triangle_count);
        self.instances.iter().map(|i| of(i.mesh)).sum()
    }

    /// Returns whether the picture depends on scene time.
    #[must_use]
    pub fn is_animated(&self) -> bool {
        self.wind.is_some_and(|w| w.amplitude_m > 0.0)
            && self.meshes.iter().any(|m| m.vertices.iter().any(|v| v.sway > 0.0))
    }
}

/// Indexed triangles, split into runs of one material.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Corner data.
    pub vertices: Vec<Vertex>,
    /// Three indices into `vertices` a triangle, counter-clockwise seen from the front.
    pub indices: Vec<u32>,
    /// Runs of `indices`; together they cover it in order.
    pub parts: Vec<MeshPart>,
}

impl Mesh {
    /// Triangles of one instance.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        self.indices.len() as u64 / 3
    }
}

/// A run of triangles with one material.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeshPart {
    /// First of its entries in [`Mesh::indices`]; a multiple of three.
    pub first_index: u32,
    /// Number of entries; a multiple of three.
    pub index_count: u32,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

/// One corner. `#[repr(C)]`, 40 bytes: uploaded as it is.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// Position in the mesh's space, metres.
    pub position: [f32; 3],
    /// Unit normal in the mesh's space.
    pub normal: [f32; 3],
    /// Texture coordinates, (0,0) at the image's top left corner.
    pub uv: [f32; 2],
    /// Vertex colour, sRGB-encoded RGB and linear alpha; white where the source has none.
    pub color_srgba8: [u8; 4],
    /// Share of the wind's displacement, 0 (rooted) to 1.
    pub sway: f32,
}

/// A mesh placed in the world.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Instance {
    /// Index into [`Scene::meshes`].
    pub mesh: u32,
    /// Finite, with a positive determinant: without a mirror, counter-clockwise triangles stay so.
    pub world_from_mesh: Affine3A,
}

/// A surface: metallic-roughness as in glTF 2.0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name in the source, for messages.
    pub name: String,
    /// Factor of texture and vertex colour, linear RGB and alpha.
    pub base_color_linear: [f32; 4],
    /// Index into [`Scene::textures`]; sRGB.
    pub base_color_texture: Option<u32>,
    /// 0 for a dielectric, 1 for a metal; multiplied by the texture's value.
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1; multiplied by the texture's value.
    pub roughness: f32,
    /// Index into [`Scene::textures`]; green is roughness and blue is metallic, linear: `is_srgb` is false.
    pub metallic_roughness_texture: Option<u32>,
    /// Emitted radiance, linear RGB.
    pub emissive_linear: Vec3,
    /// Blinn-Phong specular strength and exponent for `phong` lighting; a texture counts by its mean.
    pub phong_specular: f32,
    /// See `phong_specular`.
    pub phong_exponent: f32,
    /// Fragments with less alpha are discarded; 0 for opaque surfaces.
    pub alpha_cutoff: f32,
    /// The back is visible too; its normal then faces the viewer.
    pub double_sided: bool,
    /// The colour is independent of light (`KHR_materials_unlit`).
    pub unlit: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color_linear: [1.0; 4],
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            emissive_linear: Vec3::ZERO,
            phong_specular: 0.0,
            phong_exponent: 32.0,
            alpha_cutoff: 0.0,
            double_sided: false,
            unlit: false,
        }
    }
}

/// See [`Material::is_specular`].
const LEAST_MATT_ROUGHNESS: f32 = 0.95;

impl Material {
    /// Blinn-Phong strength and exponent of a highlight about as bright and wide as that of a metallic-roughness
    /// surface.
    #[must_use]
    pub fn phong_from_metallic_roughness(metallic: f32, roughness: f32) -> (f32, f32) {
        // Blinn-Phong and GGX agree near the peak for exponent = 2 / alpha^2 - 2 (Karis 2013).
        let alpha = (roughness * roughness).max(0.03);
        let strength = (0.08 + 0.6 * metallic) * (1.0 - roughness);
        (strength, (2.0 / (alpha * alpha) - 2.0).clamp(1.0, 1024.0))
    }

    /// Returns whether the material has a visible highlight under GGX. Samples keep view-dependent light apart, at a
    /// cost that a scene should pay only where it needs it. A dielectric (reflectance 0.04 head on) of roughness 0.95
    /// or more reflects about a hundredth of a white surface's light, and counts as matt. A roughness texture always
    /// counts as visible, because it may vary.
    #[must_use]
    pub fn is_specular(&self) -> bool {
        let is_smooth_or_metal = self.metallic > 0.0 || self.roughness < LEAST_MATT_ROUGHNESS;
        !self.unlit && (is_smooth_or_metal || self.metallic_roughness_texture.is_some())
    }

    /// The perceptual roughness that corresponds to a Blinn-Phong exponent.
    #[must_use]
    pub fn roughness_from_phong_exponent(exponent: f32) -> f32 {
        (2.0 / (exponent.max(0.0) + 2.0)).powf(0.25).clamp(0.0, 1.0)
    }
}

/// An image, rows top-down.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Texture {
    /// Columns, at least 1.
    pub width_px: u32,
    /// Rows, at least 1.
    pub height_px: u32,
    /// RGB is sRGB-encoded (colours) or linear (other data).
    pub is_srgb: bool,
    /// `width_px * height_px` texels of RGB, encoded as in `is_srgb`, and linear alpha.
    pub srgba8: Vec<u8>,
}

/// A camera named by the source file, for use as a view.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SourceCamera {
    /// Name in the source, or its number.
    pub name: String,
    /// Camera to world: looking down -Z, +Y up.
    pub world_from_camera: Affine3A,
    /// Full vertical field of view, radians.
    pub fov_y_rad: f32,
}

/// Sway of vegetation: a vertex moves by
/// `direction · amplitude · sway · sin(2π (frequency · time + waves_per_m · position_in_world))`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Wind {
    /// Unit vector.
    pub direction_in_world: Vec3,
    /// Largest displacement, metres.
    pub amplitude_m: f32,
    /// Frequency, swings a second.
    pub frequency_hz: f32,
    /// Spatial phase: a travelling wave's wave vector over 2π, per metre.
    pub waves_per_m: Vec3,
}

impl Wind {
    /// Displacement, metres, at `scene_time_s` of a vertex whose rest position is `position_in_world`; the vertex
    /// shader's twin.
    #[must_use]
    pub fn displacement_in_world(&self, position_in_world: Vec3, sway: f32, scene_time_s: f32) -> Vec3 {
        let turns = self.frequency_hz * scene_time_s + self.waves_per_m.dot(position_in_world);
        self.direction_in_world * (self.amplitude_m * sway * (std::f32::consts::TAU * turns.fract()).sin())
    }
}
