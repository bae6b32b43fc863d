//! Validation of scenes from any source.

use depth_image::LightError;
use glam::{Affine3A, Vec3};

use crate::error::{Fault, at_most};
use crate::limits::MAX_COORDINATE_M;
use crate::{
    Instance, Light, Limits, Material, Mesh, MeshPart, Scene, SceneError, SourceCamera, Texture, TextureUse, Vertex,
    VertexDetail, Wind,
};

/// Smallest determinant relative to the cube of the largest column that counts as invertible.
const MIN_RELATIVE_DETERMINANT: f32 = 1e-12;

impl Scene {
    /// Checks every guarantee of the model: indices in range, numbers finite, sizes within `limits`.
    ///
    /// # Errors
    /// The first element that violates one.
    pub fn validate(&self, limits: &Limits) -> Result<(), SceneError> {
        self.check(limits).map_err(|fault| fault.in_file(&*self.name))
    }

    pub(crate) fn check(&self, limits: &Limits) -> Result<(), Fault> {
        self.check_sizes(limits)?;
        each("mesh", &self.meshes, |mesh| check_mesh(mesh, self.materials.len()))?;
        each("instance", &self.instances, |instance| self.check_instance(instance))?;
        each("material", &self.materials, |material| check_material(material, &self.textures))?;
        each("texture", &self.textures, |texture| check_texture(texture, limits))?;
        self.check_illumination()?;
        each("camera", &self.cameras, check_camera)?;
        self.background.validate().map_err(|e| Fault::light("background", &e))?;
        require(!self.background.is_mapped, "background", "it is a map, which only the environment may be")?;
        self.wind.as_ref().map_or(Ok(()), check_wind)?;
        self.check_animation(limits)?;
        require(self.source_space.is_valid(), "source space", "its origin or unit is not finite or has no length")
    }

    fn check_sizes(&self, limits: &Limits) -> Result<(), Fault> {
        let vertices = self.meshes.iter().map(|m| m.vertices.len() as u64).sum();
        let texture_bytes = self.textures.iter().map(|t| t.srgba8.len() as u64).sum();
        at_most("instances", self.instances.len() as u64, limits.instances)?;
        at_most("meshes", self.meshes.len() as u64, limits.nodes)?;
        at_most("vertices", vertices, limits.vertices)?;
        at_most("textures, in bytes", texture_bytes, limits.texture_bytes)?;
        at_most("materials", self.materials.len() as u64, limits.attributes)?;
        at_most("lights", self.illumination.lights.len() as u64, limits.lights)?;
        at_most("cameras", self.cameras.len() as u64, limits.attributes)?;
        at_most("triangles of all instances", self.triangle_count(), limits.triangles)?;
        let stored = self.meshes.iter().map(Mesh::triangle_count).sum();
        at_most("triangles of all meshes", stored, limits.triangles)?;
        require(!self.materials.is_empty(), "materials", "there are none")?;
        require(self.triangle_count() > 0, "scene", "it has no triangles")
    }

    fn check_illumination(&self) -> Result<(), Fault> {
        for (number, light) in self.illumination.lights.iter().enumerate() {
            check_light(light).map_err(|e| Fault::light(format_args!("light {number}"), &e))?;
        }
        let environment = &self.illumination.environment;
        environment.validate().map_err(|e| Fault::light("environment", &e))?;
        let is_there = environment.is_mapped == self.environment_map.is_some();
        require(is_there, "environment map", "it is missing, or there beside a gradient")?;
        let checked = self.environment_map.as_ref().map_or(Ok(()), |map| map.validate());
        checked.map_err(|e| Fault::malformed("environment map", e.to_string()))
    }

    fn check_instance(&self, instance: &Instance) -> Result<(), String> {
        ensure((instance.mesh as usize) < self.meshes.len(), || format!("mesh {} does not exist", instance.mesh))?;
        check_transform(&instance.world_from_mesh)
    }
}

pub(crate) fn each<T>(kind: &str, items: &[T], check: impl Fn(&T) -> Result<(), String>) -> Result<(), Fault> {
    let mut numbered = items.iter().enumerate();
    numbered.try_for_each(|(i, item)| check(item).map_err(|why| Fault::malformed(format!("{kind} {i}"), why)))
}

pub(crate) fn require(holds: bool, element: &str, reason: &str) -> Result<(), Fault> {
    if holds { Ok(()) } else { Err(Fault::malformed(element, reason)) }
}

pub(crate) fn ensure(holds: bool, reason: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(reason()) }
}

fn check_mesh(mesh: &Mesh, material_count: usize) -> Result<(), String> {
    if let Some(bad) = mesh.vertices.iter().position(|v| !is_vertex_valid(v)) {
        return Err(format!("vertex {bad} is not finite, out of range or without a unit normal"));
    }
    let details = mesh.details.len();
    ensure(details == 0 || details == mesh.vertices.len(), || {
        format!("{details} vertex details for {} vertices", mesh.vertices.len())
    })?;
    if let Some(bad) = mesh.details.iter().position(|d| !is_detail_valid(d)) {
        return Err(format!("the detail of vertex {bad} is not finite or without a unit tangent"));
    }
    if let Some(bad) = mesh.indices.iter().find(|&&i| i as usize >= mesh.vertices.len()) {
        return Err(format!("index {bad} is beyond its {} vertices", mesh.vertices.len()));
    }
    check_parts(&mesh.parts, mesh.indices.len(), material_count)
}

fn check_parts(parts: &[MeshPart], index_count: usize, material_count: usize) -> Result<(), String> {
    let mut covered = 0u64;
    for (i, part) in parts.iter().enumerate() {
        ensure(part.index_count.is_multiple_of(3), || format!("part {i} does not hold whole triangles"))?;
        ensure(u64::from(part.first_index) == covered, || format!("part {i} does not follow the one before"))?;
        ensure((part.material as usize) < material_count, || {
            format!("part {i} has material {}, which does not exist", part.material)
        })?;
        covered += u64::from(part.index_count);
    }
    ensure(covered == index_count as u64, || format!("parts cover {covered} of {index_count} indices"))
}

fn is_vertex_valid(vertex: &Vertex) -> bool {
    let normal_length_squared = Vec3::from(vertex.normal).length_squared();
    // A comparison with NaN is false, so that each range check is a check for NaN too.
    vertex.position.iter().all(|c| c.abs() <= MAX_COORDINATE_M)
        && (normal_length_squared - 1.0).abs() < 1e-2
        && vertex.uv.iter().all(|c| c.is_finite())
        && is_share(vertex.sway)
}

/// Returns whether a number is from 0 to 1, which NaN is not.
fn is_share(v: f32) -> bool {
    (0.0..=1.0).contains(&v)
}

fn is_detail_valid(detail: &VertexDetail) -> bool {
    let [x, y, z, sign] = detail.tangent;
    let is_unit = (Vec3::new(x, y, z).length_squared() - 1.0).abs() < 1e-2;
    is_unit && sign.abs() == 1.0 && detail.uv.iter().all(|c| c.is_finite())
}

fn check_transform(world_from_mesh: &Affine3A) -> Result<(), String> {
    ensure(world_from_mesh.is_finite(), || "its transform is not finite".into())?;
    let columns = [world_from_mesh.matrix3.x_axis, world_from_mesh.matrix3.y_axis, world_from_mesh.matrix3.z_axis];
    let largest = columns.iter().fold(0f32, |most, c| most.max(c.length()));
    let relative = (world_from_mesh.matrix3 * largest.recip()).determinant();
    ensure(relative.abs() > MIN_RELATIVE_DETERMINANT, || "its transform is singular".into())?;
    ensure(relative > 0.0, || "its transform mirrors; the mesh must be mirrored instead".into())?;
    ensure(world_from_mesh.translation.abs().max_element() <= MAX_COORDINATE_M && largest <= MAX_COORDINATE_M, || {
        "its transform is out of range".into()
    })
}

fn check_material(material: &Material, textures: &[Texture]) -> Result<(), String> {
    let names = ["base colour", "metallic-roughness", "normal", "emissive", "occlusion"];
    for (name, texture) in names.into_iter().zip(material.textures()) {
        let Some(TextureUse { texture: number, .. }) = texture else { continue };
        let texture = textures.get(number as usize);
        let texture = texture.ok_or_else(|| format!("its {name} texture {number} does not exist"))?;
        let holds_colors = matches!(name, "base colour" | "emissive");
        ensure(holds_colors || !texture.is_srgb, || format!("its {name} texture holds colours"))?;
    }
    ensure(material.base_color_linear.iter().all(|c| c.is_finite() && *c >= 0.0), || "bad base colour".into())?;
    let emissive = material.emissive_linear;
    ensure(emissive.is_finite() && emissive.min_element() >= 0.0, || "bad emissive colour".into())?;
    ensure(is_share(material.metallic), || "metallic is not from 0 to 1".into())?;
    ensure(is_share(material.roughness), || "roughness is not from 0 to 1".into())?;
    ensure(is_share(material.occlusion_strength), || "occlusion strength is not from 0 to 1".into())?;
    ensure(material.normal_scale.is_finite(), || "normal scale is not finite".into())?;
    let reflectance = material.dielectric_reflectance_linear;
    ensure(reflectance.to_array().into_iter().all(is_share), || "bad dielectric reflectance".into())?;
    let phong = [material.phong_specular, material.phong_exponent, material.alpha_cutoff];
    ensure(phong.iter().all(|v| v.is_finite() && *v >= 0.0), || "bad Phong terms or alpha cutoff".into())
}

fn check_texture(texture: &Texture, limits: &Limits) -> Result<(), String> {
    let side = texture.width_px.max(texture.height_px);
    ensure(texture.width_px.min(texture.height_px) > 0, || "it has no texels".into())?;
    ensure(side <= limits.texture_side_px, || format!("side {side} px is over {}", limits.texture_side_px))?;
    let expected = u64::from(texture.width_px) * u64::from(texture.height_px) * 4;
    ensure(texture.srgba8.len() as u64 == expected, || {
        format!("{} bytes where its size needs {expected}", texture.srgba8.len())
    })
}

fn check_light(light: &Light) -> Result<(), LightError> {
    light.validate()?;
    let reach = match *light {
        Light::Directional { .. } => Vec::new(),
        Light::Point { position_in_world, radius_m, .. } | Light::Spot { position_in_world, radius_m, .. } => {
            vec![("position", position_in_world), ("radius", Vec3::splat(radius_m))]
        }
        Light::Rectangle { center_in_world, half_edges_in_world: [u, v], .. } => {
            vec![("center", center_in_world), ("half_edges", u), ("half_edges", v)]
        }
    };
    let far = reach.into_iter().find(|(_, v)| !is_near(*v));
    far.map_or(Ok(()), |(field, _)| Err(LightError { field, reason: "over 1e9 m" }))
}

/// Returns whether all coordinates are within [`MAX_COORDINATE_M`], which NaN is not.
pub(crate) fn is_near(v: Vec3) -> bool {
    v.abs().max_element() <= MAX_COORDINATE_M
}

fn check_camera(camera: &SourceCamera) -> Result<(), String> {
    ensure(camera.world_from_camera.is_finite(), || "its pose is not finite".into())?;
    let fov = camera.fov_y_rad;
    ensure(fov > 0.0 && fov < std::f32::consts::PI, || format!("field of view {fov} is out of range"))
}

fn check_wind(wind: &Wind) -> Result<(), Fault> {
    let is_direction_valid = (wind.direction_in_world.length_squared() - 1.0).abs() < 1e-2;
    let are_numbers_valid = (0.0..=MAX_COORDINATE_M).contains(&wind.amplitude_m)
        && wind.frequency_hz.is_finite()
        && wind.waves_per_m.is_finite();
    require(is_direction_valid && are_numbers_valid, "wind", "not finite or out of range")
}
