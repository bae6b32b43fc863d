//! What every scene must satisfy, wherever it comes from.

use glam::{Affine3A, Vec3};

use crate::error::{Fault, at_most};
use crate::{
    Instance, Light, Limits, Material, Mesh, MeshPart, Scene, SceneError, SourceCamera, Texture, Vertex, Wind,
};

/// Coordinates beyond this are refused: products of four edge lengths must stay finite in `f32`.
pub const MAX_COORDINATE_M: f32 = 1e9;

/// Smallest determinant relative to the cube of the largest column that counts as invertible.
const MIN_RELATIVE_DETERMINANT: f32 = 1e-12;

impl Scene {
    /// Checks every promise of the model: indices in range, numbers finite, sizes within `limits`.
    ///
    /// # Errors
    /// Names the first element that breaks one.
    pub fn validate(&self, limits: &Limits) -> Result<(), SceneError> {
        self.check(limits).map_err(|fault| fault.in_file(&*self.name))
    }

    pub(crate) fn check(&self, limits: &Limits) -> Result<(), Fault> {
        self.check_sizes(limits)?;
        each("mesh", &self.meshes, |mesh| check_mesh(mesh, self.materials.len()))?;
        each("instance", &self.instances, |instance| self.check_instance(instance))?;
        each("material", &self.materials, |material| check_material(material, self.textures.len()))?;
        each("texture", &self.textures, |texture| check_texture(texture, limits))?;
        each("light", &self.lights, check_light)?;
        each("camera", &self.cameras, check_camera)?;
        check_colour("ambient light", self.ambient_linear)?;
        check_colour("background", self.background_linear)?;
        self.wind.as_ref().map_or(Ok(()), check_wind)?;
        require(self.origin_in_source.is_finite(), "origin", "not finite")
    }

    fn check_sizes(&self, limits: &Limits) -> Result<(), Fault> {
        let vertices = self.meshes.iter().map(|m| m.vertices.len() as u64).sum();
        let texture_bytes = self.textures.iter().map(|t| t.srgba8.len() as u64).sum();
        at_most("instances", self.instances.len() as u64, limits.instances)?;
        at_most("meshes", self.meshes.len() as u64, limits.nodes)?;
        at_most("vertices", vertices, limits.vertices)?;
        at_most("textures, in bytes", texture_bytes, limits.texture_bytes)?;
        at_most("materials", self.materials.len() as u64, limits.attributes)?;
        at_most("lights", self.lights.len() as u64, limits.attributes)?;
        at_most("cameras", self.cameras.len() as u64, limits.attributes)?;
        at_most("triangles of all instances", self.triangle_count(), limits.triangles)?;
        let stored = self.meshes.iter().map(Mesh::triangle_count).sum();
        at_most("triangles of all meshes", stored, limits.triangles)?;
        require(!self.materials.is_empty(), "materials", "there are none")?;
        require(self.triangle_count() > 0, "scene", "it has no triangles")
    }

    fn check_instance(&self, instance: &Instance) -> Result<(), String> {
        ensure((instance.mesh as usize) < self.meshes.len(), || format!("mesh {} does not exist", instance.mesh))?;
        check_transform(&instance.world_from_mesh)
    }
}

fn each<T>(kind: &str, items: &[T], check: impl Fn(&T) -> Result<(), String>) -> Result<(), Fault> {
    let numbered = items.iter().enumerate();
    numbered
        .into_iter()
        .try_for_each(|(i, item)| check(item).map_err(|why| Fault::malformed(format!("{kind} {i}"), why)))
}

fn require(holds: bool, element: &str, reason: &str) -> Result<(), Fault> {
    if holds { Ok(()) } else { Err(Fault::malformed(element, reason)) }
}

fn ensure(holds: bool, reason: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(reason()) }
}

fn check_mesh(mesh: &Mesh, material_count: usize) -> Result<(), String> {
    let bad_vertex = mesh.vertices.iter().position(|v| !is_vertex_valid(v));
    ensure(bad_vertex.is_none(), || {
        format!("vertex {} is not finite, out of range or without a unit normal", bad_vertex.unwrap_or(0))
    })?;
    let bad_index = mesh.indices.iter().find(|&&i| i as usize >= mesh.vertices.len());
    ensure(bad_index.is_none(), || {
        format!("index {} is beyond its {} vertices", bad_index.unwrap_or(&0), mesh.vertices.len())
    })?;
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
        && (0.0..=1.0).contains(&vertex.sway)
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

fn check_material(material: &Material, texture_count: usize) -> Result<(), String> {
    let texture = material.base_color_texture;
    ensure(texture.is_none_or(|t| (t as usize) < texture_count), || format!("texture {texture:?} does not exist"))?;
    let unit = |v: f32| (0.0..=1.0).contains(&v);
    ensure(material.base_color_linear.iter().all(|c| c.is_finite() && *c >= 0.0), || "bad base colour".into())?;
    ensure(is_radiance(material.emissive_linear), || "bad emissive colour".into())?;
    ensure(unit(material.metallic) && unit(material.roughness), || "metallic or roughness out of range".into())?;
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

fn check_light(light: &Light) -> Result<(), String> {
    let (place, colour, is_place_valid) = match *light {
        Light::Directional { towards_light_in_world: d, irradiance_linear } => {
            (d, irradiance_linear, (d.length_squared() - 1.0).abs() < 1e-2)
        }
        Light::Point { position_in_world: p, intensity_linear } => {
            (p, intensity_linear, p.abs().max_element() <= MAX_COORDINATE_M)
        }
    };
    ensure(place.is_finite() && is_place_valid, || "bad position or direction".into())?;
    ensure(is_radiance(colour), || "bad intensity".into())
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

fn check_colour(element: &str, colour: Vec3) -> Result<(), Fault> {
    require(is_radiance(colour), element, "negative or not finite")
}

fn is_radiance(colour: Vec3) -> bool {
    colour.is_finite() && colour.min_element() >= 0.0
}
