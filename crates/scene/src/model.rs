//! The scene as plain data, equal on every node.

use depth_image::{Environment, EnvironmentMap, Illumination, SourceSpace};
use glam::{Affine3A, Vec3};
use serde::{Deserialize, Serialize};

use crate::{Animation, MovingInstance, UnknownClip};

/// A renderable scene. All indices of a scene from this crate are valid. Serde leaves out the large arrays, which
/// [`pack`](crate::pack) copies.
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
    #[serde(skip)]
    pub environment_map: Option<EnvironmentMap>,
    /// Radiance of rays that meet no surface, by their direction, where there is no map.
    pub background: Environment,
    /// Cameras that the source file listed.
    pub cameras: Vec<SourceCamera>,
    /// Sway as a function of scene time; `None` without wind.
    pub wind: Option<Wind>,
    /// Motion by nodes, joints and clips; `None` for a scene without it.
    pub animation: Option<Animation>,
    /// The space of the source file.
    pub source_space: SourceSpace,
}

impl Scene {
    /// Every vertex of every instance, at rest.
    pub fn vertices_in_world(&self) -> impl Iterator<Item = Vec3> + Clone {
        self.instances.iter().flat_map(|instance| {
            let vertices = self.meshes.get(instance.mesh as usize).map_or(&[][..], |mesh| &mesh.vertices);
            vertices.iter().map(move |v| instance.world_from_mesh.transform_point3(Vec3::from(v.position)))
        })
    }

    /// Triangles as drawn: a mesh's count once for each of its instances.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        let meshes = self.instances.iter().filter_map(|i| self.meshes.get(i.mesh as usize));
        meshes.map(Mesh::triangle_count).sum()
    }

    /// The number of triangles, and the clips with their durations, as in "12 triangles; clips: walk (1.5 s, plays), run
    /// (0.8 s)".
    #[must_use]
    pub fn contents(&self) -> String {
        let triangles = format!("{} triangles", self.triangle_count());
        let Some(animation) = self.animation.as_ref().filter(|animation| !animation.clips.is_empty()) else {
            return triangles;
        };
        let clips = (0..).zip(&animation.clips).map(|(number, clip)| {
            let plays = if animation.playing == Some(number) { ", plays" } else { "" };
            format!("{} ({} s{plays})", clip.name, clip.duration_s())
        });
        format!("{triangles}; clips: {}", clips.collect::<Vec<_>>().join(", "))
    }

    /// The mesh of an instance that moves.
    pub(crate) fn mesh_of(&self, moving: &MovingInstance) -> Option<&Mesh> {
        self.meshes.get(self.instances.get(moving.instance as usize)?.mesh as usize)
    }

    /// Plays the first clip of a name.
    ///
    /// # Errors
    /// When no clip has the name: lists all.
    pub fn play(&mut self, name: &str) -> Result<(), UnknownClip> {
        let clips = self.animation.as_ref().map_or(&[][..], |animation| &animation.clips);
        let Some(number) = clips.iter().position(|clip| clip.name == name) else {
            let clips = clips.iter().map(|clip| clip.name.clone()).collect();
            return Err(UnknownClip { name: name.to_owned(), clips });
        };
        self.animation.iter_mut().for_each(|animation| animation.playing = Some(number as u32));
        Ok(())
    }

    /// The time after which the motion repeats, seconds: that of the clip that plays, or else of the wind. `None` where
    /// nothing moves.
    #[must_use]
    pub fn period_s(&self) -> Option<f32> {
        let of_clip = self.animation.as_ref().and_then(Animation::period_s);
        of_clip.or_else(|| {
            let wind = self.wind.filter(|wind| wind.amplitude_m > 0.0 && wind.frequency_hz != 0.0)?;
            let sways = self.meshes.iter().any(|m| m.vertices.iter().any(|v| v.sway > 0.0));
            Some(wind.frequency_hz.abs().recip()).filter(|period_s| sways && period_s.is_finite())
        })
    }
}

/// Indexed triangles, split into runs of one material.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Corner data.
    #[serde(skip)]
    pub vertices: Vec<Vertex>,
    /// Further corner data: empty, or one for each of `vertices`.
    #[serde(skip)]
    pub details: Vec<VertexDetail>,
    /// Three indices into `vertices` a triangle, counter-clockwise seen from the front.
    #[serde(skip)]
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
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
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

/// The data of a corner that only some materials need. `#[repr(C)]`, 24 bytes: uploaded as it is.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct VertexDetail {
    /// A second pair of texture coordinates.
    pub uv: [f32; 2],
    /// Unit tangent in the mesh's space, along u of the normal map, and the sign s of the bitangent
    /// `s · normal × tangent`, which points against v.
    pub tangent: [f32; 4],
}

impl Default for VertexDetail {
    fn default() -> Self {
        Self { uv: [0.0; 2], tangent: [1.0, 0.0, 0.0, 1.0] }
    }
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
    /// Colours.
    pub base_color_texture: Option<TextureUse>,
    /// 0 for a dielectric, 1 for a metal; multiplied by the texture's value.
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1; multiplied by the texture's value.
    pub roughness: f32,
    /// Green is roughness and blue is metallic, linear: `is_srgb` is false.
    pub metallic_roughness_texture: Option<TextureUse>,
    /// Reflectance of the surface at normal incidence where it is a dielectric, linear RGB, 0 to 1.
    pub dielectric_reflectance_linear: Vec3,
    /// Normals in the tangent space of [`VertexDetail`], linear; each channel's 0…1 stands for -1…1.
    pub normal_texture: Option<TextureUse>,
    /// Factor of the normal map's x and y.
    pub normal_scale: f32,
    /// Red is the share of the environment's light that arrives, linear. A surface that emits light is not occluded.
    pub occlusion_texture: Option<TextureUse>,
    /// Share of the occlusion that counts, 0 to 1.
    pub occlusion_strength: f32,
    /// Emitted radiance, linear RGB; multiplied by the texture's value.
    pub emissive_linear: Vec3,
    /// Colours.
    pub emissive_texture: Option<TextureUse>,
    /// Blinn-Phong specular strength and exponent for `phong` lighting; a texture counts by its mean.
    pub phong_specular: f32,
    /// See `phong_specular`.
    pub phong_exponent: f32,
    /// Fragments with less alpha are discarded; 0 for opaque surfaces.
    pub alpha_cutoff: f32,
    /// The cutoff is a hash of the place instead, so that the share of the surface that remains is its alpha.
    pub alpha_hashed: bool,
    /// The back is visible too; its normal then faces the viewer.
    pub double_sided: bool,
    /// The colour is independent of light (`KHR_materials_unlit`).
    pub unlit: bool,
    /// Share of the light that enters the surface and goes through it, tinted by the base colour, 0 to 1. Metals transmit
    /// nothing.
    pub transmission: f32,
    /// Refractive index of what transmits, 1 to [`MAX_IOR`].
    pub ior: f32,
    /// The medium that a transmissive surface encloses; light goes straight through surfaces without one.
    pub volume: Option<Volume>,
}

/// The medium inside a closed surface. White light that has gone through `attenuation_distance_m` of it has the attenuation
/// colour (Beer and Lambert).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Volume {
    /// Linear RGB, 0 to 1.
    pub attenuation_color_linear: Vec3,
    /// Above 0; infinite in a medium that takes no light.
    pub attenuation_distance_m: f32,
}

impl Volume {
    /// A medium that takes no light.
    pub const CLEAR: Self = Self { attenuation_color_linear: Vec3::ONE, attenuation_distance_m: f32::INFINITY };

    /// The exponent of what a metre takes, finite and at least 0.
    #[must_use]
    pub fn absorption_per_m(&self) -> Vec3 {
        let color = self.attenuation_color_linear.max(Vec3::splat(LEAST_ATTENUATION));
        color.map(|share| (-share.ln() / self.attenuation_distance_m).clamp(0.0, MAX_ABSORPTION_PER_M))
    }
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
            dielectric_reflectance_linear: Vec3::splat(DIELECTRIC_REFLECTANCE),
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive_linear: Vec3::ZERO,
            emissive_texture: None,
            phong_specular: 0.0,
            phong_exponent: 32.0,
            alpha_cutoff: 0.0,
            alpha_hashed: false,
            double_sided: false,
            unlit: false,
            transmission: 0.0,
            ior: DEFAULT_IOR,
            volume: None,
        }
    }
}

/// The refractive index of glTF 2.0 where a file names none.
pub const DEFAULT_IOR: f32 = 1.5;
/// The greatest refractive index; that of germanium, 4, is among the greatest of known materials.
pub const MAX_IOR: f32 = 4.0;
/// An attenuation colour of 0 counts as this: its logarithm is finite.
const LEAST_ATTENUATION: f32 = 1e-6;
/// A thicker medium lets nothing through a micrometre.
const MAX_ABSORPTION_PER_M: f32 = 1e9;

/// Reflectance at normal incidence of a dielectric with a refractive index of 1.5, as in glTF 2.0.
pub const DIELECTRIC_REFLECTANCE: f32 = 0.04;

/// The share of light that a surface of a refractive index reflects at normal incidence.
#[must_use]
pub fn reflectance_of_ior(ior: f32) -> f32 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

/// See [`Material::is_specular`].
const LEAST_MATT_ROUGHNESS: f32 = 0.95;

impl Material {
    /// Blinn-Phong strength and exponent of a highlight about as bright and wide as that of a metallic-roughness
    /// surface with this reflectance at normal incidence of its dielectric part.
    #[must_use]
    pub fn phong_from_metallic_roughness(metallic: f32, roughness: f32, dielectric_reflectance: f32) -> (f32, f32) {
        // Blinn-Phong and GGX agree near the peak for exponent = 2 / alpha^2 - 2 (Karis 2013).
        let alpha = (roughness * roughness).max(0.03);
        let strength = (2.0 * dielectric_reflectance + 0.6 * metallic) * (1.0 - roughness);
        (strength, (2.0 / (alpha * alpha) - 2.0).clamp(1.0, 1024.0))
    }

    /// Returns whether the material has a visible highlight under GGX. Samples keep view-dependent light apart, at a
    /// cost that a scene should pay only where it needs it. A dielectric of roughness 0.95 or more reflects about a
    /// hundredth of a white surface's light, and counts as matt. A roughness texture always counts as visible, because
    /// it may vary. A transmissive surface is specular whatever its roughness.
    #[must_use]
    pub fn is_specular(&self) -> bool {
        if self.is_transmissive() {
            return true;
        }
        let reflects = self.metallic > 0.0 || self.dielectric_reflectance_linear.max_element() > 0.0;
        let is_smooth_or_metal = self.metallic > 0.0 || self.roughness < LEAST_MATT_ROUGHNESS;
        !self.unlit && reflects && (is_smooth_or_metal || self.metallic_roughness_texture.is_some())
    }

    /// Returns whether light goes through the surface.
    #[must_use]
    pub fn is_transmissive(&self) -> bool {
        !self.unlit && self.transmission > 0.0 && self.metallic < 1.0
    }

    /// Returns whether backs are met: those of a surface around a volume are where light leaves it.
    #[must_use]
    pub fn has_two_sides(&self) -> bool {
        self.double_sided || self.is_transmissive() && self.volume.is_some()
    }

    /// Its textures: base colour, metallic and roughness, normals, emission, occlusion.
    #[must_use]
    pub fn textures(&self) -> [Option<TextureUse>; 5] {
        [
            self.base_color_texture,
            self.metallic_roughness_texture,
            self.normal_texture,
            self.emissive_texture,
            self.occlusion_texture,
        ]
    }

    /// Returns whether alpha decides where the surface is.
    #[must_use]
    pub fn is_alpha_tested(&self) -> bool {
        self.alpha_hashed || self.alpha_cutoff > 0.0
    }

    /// Returns whether more than base colour, metallic and roughness at the first texture coordinates is needed:
    /// further textures, [`VertexDetail`], or hashed alpha.
    #[must_use]
    pub fn is_mapped(&self) -> bool {
        let [_, _, further @ ..] = self.textures();
        let has_second_uv = self.textures().iter().flatten().any(|texture| texture.second_uv);
        self.alpha_hashed || has_second_uv || further.iter().any(Option::is_some)
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
    #[serde(skip)]
    pub srgba8: Vec<u8>,
}

/// A texture as a material uses it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TextureUse {
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// The coordinates are the second pair: [`VertexDetail::uv`].
    pub second_uv: bool,
    /// The texture beyond its borders, along u and v.
    pub wrap: [Wrap; 2],
}

/// A texture beyond its borders, along one axis. The numbers are those of shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub enum Wrap {
    /// It begins again.
    #[default]
    Repeat = 0,
    /// It runs back and forth.
    Mirror = 1,
    /// Its border goes on.
    Clamp = 2,
}

/// The first pair of coordinates, repeated along both axes.
impl From<u32> for TextureUse {
    fn from(texture: u32) -> Self {
        Self { texture, second_uv: false, wrap: [Wrap::Repeat; 2] }
    }
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
