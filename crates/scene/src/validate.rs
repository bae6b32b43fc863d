//! Validation of scenes from any source.

use std::collections::HashSet;

use depth_image::LightError;
use glam::{Affine3A, Quat, Vec3};

use crate::{
    Animation, Channel, Fault, Influence, Light, Limits, MAX_COORDINATE_M, MAX_IOR, Material, Mesh, MeshPart,
    MovingInstance, Node, NodeTransform, Property, Scene, SceneError, SourceCamera, Texture, TextureUse,
    TransformParts, Vertex, VertexDetail, Volume, Wind, at_most,
};

/// Smallest determinant relative to the cube of the largest column that counts as invertible.
const MIN_RELATIVE_DETERMINANT: f32 = 1e-12;
/// The error of a unit length or of a sum of weights that rounding explains.
const ROUNDING: f32 = 1e-2;

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
        each("instance", &self.instances, |instance| {
            ensure((instance.mesh as usize) < self.meshes.len(), || format!("mesh {} does not exist", instance.mesh))?;
            check_transform(&instance.world_from_mesh)
        })?;
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

    /// Checks every guarantee of the animation, and that all moments stay within [`MAX_COORDINATE_M`].
    fn check_animation(&self, limits: &Limits) -> Result<(), Fault> {
        let Some(animation) = &self.animation else { return Ok(()) };
        check_animation_sizes(animation, limits)?;
        let mut nodes = (0u32..).zip(&animation.nodes);
        let are_in_order = nodes.all(|(number, node)| node.parent.is_none_or(|parent| parent < number));
        require(are_in_order, "animation, nodes", "a parent is not before its child")?;
        each("animation, node", &animation.nodes, check_node)?;
        each("clip", &animation.clips, |clip| {
            let mut channels = clip.channels.iter().enumerate();
            channels.try_for_each(|(number, channel)| {
                check_channel(channel, &animation.nodes).map_err(|why| format!("channel {number}: {why}"))
            })
        })?;
        let is_there = animation.playing.is_none_or(|playing| (playing as usize) < animation.clips.len());
        require(is_there, "animation, playing", "the clip does not exist")?;
        require(animation.world_from_source.is_finite(), "animation, world_from_source", "not finite")?;
        let instances: HashSet<u32> = animation.moving.iter().map(|moving| moving.instance).collect();
        require(instances.len() == animation.moving.len(), "animation, moving", "an instance moves twice")?;
        each("moving instance", &animation.moving, |moving| self.check_moving(moving, animation.nodes.len()))?;
        let meshes = animation.moving.iter().filter_map(|moving| self.mesh_of(moving));
        let moved = meshes.map(|mesh| mesh.vertices.len() as u64).sum();
        at_most("animation, vertices of all moving instances", moved, limits.vertices)?;
        // Moments between the sampled ones are bounded by `MovingInstance::posed`. The box without points is nowhere.
        each("moving instance", &self.swept(animation), |b| {
            ensure(b.is_empty() || is_near(b.min) && is_near(b.max), || "it moves beyond 1e9 m".into())
        })
    }

    fn check_moving(&self, moving: &MovingInstance, nodes: usize) -> Result<(), String> {
        let is_there = (moving.instance as usize) < self.instances.len();
        ensure(is_there, || format!("instance {} does not exist", moving.instance))?;
        ensure(!moving.joints.is_empty(), || "it follows no joint".into())?;
        for (number, joint) in moving.joints.iter().enumerate() {
            ensure((joint.node as usize) < nodes, || format!("joint {number}: node {} does not exist", joint.node))?;
            ensure(joint.joint_from_mesh.is_finite(), || format!("joint {number}: its bind matrix is not finite"))?;
        }
        if moving.influences.is_empty() {
            return Ok(());
        }
        let vertices = self.mesh_of(moving).map_or(0, |mesh| mesh.vertices.len());
        let influences = moving.influences.len();
        ensure(vertices == influences, || format!("it has joints of {influences} vertices, its mesh {vertices}"))?;
        let bad = moving.influences.iter().position(|influence| !is_influence_valid(influence, moving.joints.len()));
        bad.map_or(Ok(()), |bad| Err(format!("vertex {bad}: its joints are out of range, or their weights")))
    }
}

fn each<T>(kind: &str, items: &[T], check: impl Fn(&T) -> Result<(), String>) -> Result<(), Fault> {
    let mut numbered = items.iter().enumerate();
    numbered.try_for_each(|(i, item)| check(item).map_err(|why| Fault::malformed(format!("{kind} {i}"), why)))
}

fn require(holds: bool, element: &str, reason: &str) -> Result<(), Fault> {
    if holds { Ok(()) } else { Err(Fault::malformed(element, reason)) }
}

fn ensure(holds: bool, reason: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(reason()) }
}

fn check_mesh(mesh: &Mesh, material_count: usize) -> Result<(), String> {
    if let Some(bad) = mesh.vertices.iter().position(|v| !is_vertex_valid(v)) {
        return Err(format!("vertex {bad} is not finite, out of range or without a unit normal"));
    }
    let vertices = mesh.vertices.len();
    let details = mesh.details.len();
    ensure(details == 0 || details == vertices, || format!("{details} vertex details for {vertices} vertices"))?;
    if let Some(bad) = mesh.details.iter().position(|d| !is_detail_valid(d)) {
        return Err(format!("the detail of vertex {bad} is not finite or without a unit tangent"));
    }
    if let Some(bad) = mesh.indices.iter().find(|&&i| i as usize >= vertices) {
        return Err(format!("index {bad} is beyond its {vertices} vertices"));
    }
    check_parts(&mesh.parts, mesh.indices.len(), material_count)
}

fn check_parts(parts: &[MeshPart], index_count: usize, material_count: usize) -> Result<(), String> {
    let mut covered = 0u64;
    for (i, part) in parts.iter().enumerate() {
        ensure(part.index_count.is_multiple_of(3), || format!("part {i} does not hold whole triangles"))?;
        ensure(u64::from(part.first_index) == covered, || format!("part {i} does not follow the one before"))?;
        let material = part.material;
        ensure((material as usize) < material_count, || format!("part {i}: material {material} does not exist"))?;
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
    let largest = (0..3).fold(0f32, |most, column| most.max(world_from_mesh.matrix3.col(column).length()));
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
    ensure(phong.iter().all(|v| v.is_finite() && *v >= 0.0), || "bad Phong terms or alpha cutoff".into())?;
    check_transmission(material)
}

fn check_transmission(material: &Material) -> Result<(), String> {
    ensure(is_share(material.transmission), || "transmission is not from 0 to 1".into())?;
    ensure((1.0..=MAX_IOR).contains(&material.ior), || format!("ior {} is not from 1 to {MAX_IOR}", material.ior))?;
    let Some(Volume { attenuation_color_linear, attenuation_distance_m }) = material.volume else { return Ok(()) };
    let is_color = attenuation_color_linear.to_array().into_iter().all(is_share);
    ensure(is_color, || "attenuation colour is not from 0 to 1".into())?;
    // Infinity passes, NaN does not.
    ensure(attenuation_distance_m > 0.0, || format!("attenuation distance {attenuation_distance_m} is not above 0"))
}

fn check_texture(texture: &Texture, limits: &Limits) -> Result<(), String> {
    let side = texture.width_px.max(texture.height_px);
    ensure(texture.width_px.min(texture.height_px) > 0, || "it has no texels".into())?;
    ensure(side <= limits.texture_side_px, || format!("side {side} px is over {}", limits.texture_side_px))?;
    let expected = u64::from(texture.width_px) * u64::from(texture.height_px) * 4;
    let bytes = texture.srgba8.len() as u64;
    ensure(bytes == expected, || format!("{bytes} bytes where its size needs {expected}"))
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
fn is_near(v: Vec3) -> bool {
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

fn check_animation_sizes(animation: &Animation, limits: &Limits) -> Result<(), Fault> {
    let joints = animation.moving.iter().map(|moving| moving.joints.len() as u64).sum();
    let influences = animation.moving.iter().map(|moving| moving.influences.len() as u64).sum();
    let channels: u64 = animation.clips.iter().map(|clip| clip.channels.len() as u64).sum();
    let keys = animation.clips.iter().flat_map(|clip| &clip.channels).map(|channel| channel.times_s.len() as u64);
    at_most("animation, nodes", animation.nodes.len() as u64, limits.nodes)?;
    at_most("animation, joints", joints, limits.nodes)?;
    at_most("animation, vertices with joints", influences, limits.vertices)?;
    at_most("animation, clips", animation.clips.len() as u64, limits.attributes)?;
    at_most("animation, channels", channels, limits.json_objects)?;
    at_most("animation, keys", keys.sum(), limits.keys)
}

fn check_node(node: &Node) -> Result<(), String> {
    let is_rest_valid = match node.rest {
        NodeTransform::Fixed(transform) => transform.is_finite(),
        NodeTransform::Parts(TransformParts { translation, rotation, scale }) => {
            translation.is_finite() && scale.is_finite() && is_unit(rotation)
        }
    };
    ensure(is_rest_valid, || "its transform is not finite, or its rotation no unit quaternion".into())
}

/// The reason for which a channel cannot be played.
fn check_channel(channel: &Channel, nodes: &[Node]) -> Result<(), String> {
    let node = nodes.get(channel.node as usize);
    let has_parts = node.is_some_and(|node| matches!(node.rest, NodeTransform::Parts(_)));
    ensure(has_parts, || format!("node {} does not exist, or is fixed", channel.node))?;
    check_times(&channel.times_s)?;
    let stride = channel.interpolation.values_a_key();
    let count = channel.values.len();
    let expected = channel.times_s.len() * stride;
    ensure(count == expected, || format!("{count} values where its keys need {expected}"))?;
    for (number, value) in channel.values.iter().enumerate() {
        ensure(value.is_finite(), || format!("value {number} is not finite"))?;
    }
    // Slopes of a spline have any length.
    for (number, value) in channel.values.iter().enumerate().skip(stride / 2).step_by(stride) {
        let is_valid = channel.property != Property::Rotation || is_unit(Quat::from_vec4(*value));
        ensure(is_valid, || format!("value {number} is no unit quaternion"))?;
    }
    Ok(())
}

/// The reason for which times are no keys.
pub(crate) fn check_times(times_s: &[f32]) -> Result<(), String> {
    ensure(!times_s.is_empty(), || "it has no keys".into())?;
    for (number, time) in times_s.iter().enumerate() {
        ensure(time.is_finite() && *time >= 0.0, || format!("time {number} is negative or not finite"))?;
    }
    for (number, pair) in times_s.windows(2).enumerate() {
        ensure(pair[0] <= pair[1], || format!("time {} is before the one before it", number + 1))?;
    }
    Ok(())
}

fn is_unit(rotation: Quat) -> bool {
    (rotation.length_squared() - 1.0).abs() < ROUNDING
}

fn is_influence_valid(influence: &Influence, joints: usize) -> bool {
    influence.weights.iter().all(|weight| (0.0..=1.0 + ROUNDING).contains(weight))
        && (influence.weights.iter().sum::<f32>() - 1.0).abs() < ROUNDING
        && influence.joints.iter().all(|&joint| usize::from(joint) < joints)
}
