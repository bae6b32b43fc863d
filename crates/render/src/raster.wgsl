{% if surface_id or redundancy_test %}enable primitive_index;
{% endif %}
// Draws triangles: which surface each pixel shows. Light comes later.
{% include "packed_surface.wgsl" %}
{% if triangle_normal %}
{% include "triangle_normal.wgsl" %}
{% endif %}
{% if mapped and alpha_tested %}
{% include "hashed_alpha.wgsl" %}
{% endif %}

struct Object {
    world_from_mesh: array<vec4f, 3>,
    normal_from_mesh: array<vec4f, 3>,
    base_color_linear: vec4f,
    emissive_linear: vec3f,
    alpha_cutoff: f32,
    metallic: f32,
    roughness: f32,
    phong_reflector: u32,
    instance: u32,
    dielectric_linear: vec3f,
    normal_scale: f32,
    occlusion_strength: f32,
    // A bit for each texture that lies on the second coordinates: base colour, metallic and roughness, normals, emission,
    // occlusion.
    second_uv: u32,
    alpha_hashed: u32,
    // Metres of the world a metre of the mesh.
    scale: f32,
}
struct Surroundings {
    wind_direction: vec3f,
    wind_amplitude_m: f32,
    wind_waves_per_m: vec3f,
    wind_frequency_hz: f32,
}
struct RasterCamera {
    clip_from_world: mat4x4f,
    eye_in_world: vec3f,
    scene_time_s: f32,
    near_m: f32,
    // A pixel's side at a depth of one metre.
    footprint: f32,
}

@group(0) var<uniform> camera: RasterCamera;
@group(0) var<uniform> surroundings: Surroundings;
@group(1) var<uniform> object: Object;
@group(2) var base_color_texture: texture_2d<f32>;
@group(2) var base_color_sampler: sampler;
@group(2) var metallic_roughness_texture: texture_2d<f32>;
@group(2) var metallic_roughness_sampler: sampler;
@group(2) var normal_texture: texture_2d<f32>;
@group(2) var normal_sampler: sampler;
@group(2) var emissive_texture: texture_2d<f32>;
@group(2) var emissive_sampler: sampler;
@group(2) var occlusion_texture: texture_2d<f32>;
@group(2) var occlusion_sampler: sampler;

struct Varyings {
    // The same for all pipelines: depths of one pass are compared with those of another.
    @builtin(position) @invariant clip: vec4f,
    @location(0) normal_in_world: vec3f,
    @location(1) uv: vec2f,
    @location(2) color_linear: vec4f,
    @location(3) @interpolate(flat) first_primitive: u32,
{% if redundancy_test or appended %}    @location(4) position_in_world: vec3f,
{% endif %}
{% if mapped %}    @location(5) second_uv: vec2f,
    @location(6) tangent_in_world: vec4f,
    // In the mesh's space, in metres of the world.
    @location(7) place_m: vec3f,
{% endif %}
{% if triangle_normal %}    @location(8) from_eye_in_world: vec3f,
{% endif %}
}

fn rows_times(rows: array<vec4f, 3>, v: vec4f) -> vec3f {
    return vec3f(dot(rows[0], v), dot(rows[1], v), dot(rows[2], v));
}

// A draw's instance number tells the number of its first triangle.
@vertex
fn vertex(
    @builtin(instance_index) first_primitive: u32,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) uv: vec2f,
    @location(3) color_srgb: vec4f,
    @location(4) sway: f32,
{% if mapped %}    @location(5) second_uv: vec2f,
    @location(6) tangent: vec4f,
{% endif %}
) -> Varyings {
    var position_in_world = rows_times(object.world_from_mesh, vec4f(position, 1.0));
{% if wind %}
    let turns = surroundings.wind_frequency_hz * camera.scene_time_s + dot(surroundings.wind_waves_per_m, position_in_world);
    let swing = sin(6.2831855 * fract(turns));
    position_in_world += surroundings.wind_direction * (surroundings.wind_amplitude_m * sway * swing);
{% endif %}
    var out: Varyings;
    out.clip = camera.clip_from_world * vec4f(position_in_world, 1.0);
    out.normal_in_world = rows_times(object.normal_from_mesh, vec4f(normal, 0.0));
    out.uv = uv;
    out.color_linear = vec4f(linear_from_srgb(color_srgb.rgb), color_srgb.a);
    out.first_primitive = first_primitive;
{% if redundancy_test or appended %}    out.position_in_world = position_in_world;
{% endif %}
{% if triangle_normal %}    out.from_eye_in_world = position_in_world - camera.eye_in_world;
{% endif %}
{% if mapped %}
    // Corners have unit vectors, as those of rays do.
    out.normal_in_world = normalize(out.normal_in_world);
    out.second_uv = second_uv;
    out.tangent_in_world = vec4f(normalize(rows_times(object.world_from_mesh, vec4f(tangent.xyz, 0.0))), tangent.w);
    out.place_m = position * object.scale;
{% endif %}
    return out;
}

// The coordinates of a texture, by its bit in `second_uv`.
fn uv_of(in: Varyings, number: u32) -> vec2f {
{% if mapped %}
    return select(in.uv, in.second_uv, (object.second_uv & (1u << number)) != 0u);
{% else %}
    return in.uv;
{% endif %}
}
{% if alpha_tested %}

fn is_there(in: Varyings, alpha: f32) -> bool {
    var cutoff = object.alpha_cutoff;
{% if mapped %}
    cutoff = select(cutoff, hashed_cutoff(in.place_m, {{ "camera.footprint" if appended else "camera.near_m / in.clip.z * camera.footprint" }}), object.alpha_hashed != 0u);
{% endif %}
    return alpha >= cutoff;
}
{% endif %}

{% if redundancy_test %}
{% include "known_samples.wgsl" %}

fn candidate_at(in: Varyings, normal: vec3f, primitive: u32) -> Candidate {
    let depth_m = camera.near_m / in.clip.z;
    let sight = in.position_in_world - camera.eye_in_world;
    return Candidate(
        vec4f(in.clip.xy * depth_m, depth_m, 1.0), in.position_in_world, in.clip.z, stretched_footprint(depth_m, camera.footprint, normal, sight),
        vec2u(object.instance, in.first_primitive + primitive), vec2u(in.clip.xy),
    );
}
{% endif %}

{% if depth_only %}
{% if alpha_tested %}
@fragment
fn fragment(in: Varyings) {
    var alpha = object.base_color_linear.a * in.color_linear.a;
{% if textured %}
    alpha *= textureSample(base_color_texture, base_color_sampler, uv_of(in, 0u)).a;
{% endif %}
    if !is_there(in, alpha) { discard; }
}
{% endif %}
{% else %}
{% if appended %}
{% include "append.wgsl" %}
{%- else -%}
struct Planes {
    @location(0) surface: vec4u,
{% if surface_id %}    @location(1) surface_id: vec2u,
{% endif %}
{% if triangle_normal %}    @location({{ 2 if surface_id else 1 }}) triangle_normal: u32,
{% endif %}
}
{%- endif %}

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front_facing: bool{% if surface_id or redundancy_test %}, @builtin(primitive_index) primitive: u32{% endif %}) {{ "" if appended else "-> Planes " }}{
{%- if triangle_normal %}
    let across = cross(dpdx(in.from_eye_in_world), dpdy(in.from_eye_in_world));
{%- endif %}
{%- if appended %}
    let slope = slope_of(dpdx(in.position_in_world), dpdy(in.position_in_world));
{%- endif %}
    var base = object.base_color_linear * in.color_linear;
{% if textured %}
    base *= textureSample(base_color_texture, base_color_sampler, uv_of(in, 0u));
{% endif %}
{% if alpha_tested %}
    if !is_there(in, base.a) { discard; }
{% endif %}
    var coat = Coat(
        object.metallic, object.roughness, object.dielectric_linear, object.phong_reflector,
        {{ "true" if unlit else "false" }}, {{ "true" if specular else "false" }}, 1.0,
    );
{% if coat_textured %}
    let metallic_roughness = textureSample(metallic_roughness_texture, metallic_roughness_sampler, uv_of(in, 1u));
    coat.metallic *= metallic_roughness.b;
    coat.roughness *= metallic_roughness.g;
{% endif %}
    var emissive_linear = object.emissive_linear;
    var shown_normal = normalize(in.normal_in_world);
{% if mapped %}
    emissive_linear *= textureSample(emissive_texture, emissive_sampler, uv_of(in, 3u)).rgb;
    let occlusion = textureSample(occlusion_texture, occlusion_sampler, uv_of(in, 4u)).r;
    coat.open = 1.0 + object.occlusion_strength * (occlusion - 1.0);
    let map = textureSample(normal_texture, normal_sampler, uv_of(in, 2u)).xyz;
    shown_normal = mapped_normal(map, object.normal_scale, in.normal_in_world, in.tangent_in_world);
{% endif %}
    let facing = {% if double_sided and not appended %}select(-1.0, 1.0, front_facing){% else %}1.0{% endif %};
    let normal = normalize(in.normal_in_world) * facing;
{% if redundancy_test %}
    if is_redundant(candidate_at(in, normal, primitive)) { discard; }
{% endif %}
{%- if appended %}
    if slope.is_steep { discard; }
    append(in, packed_surface(base.rgb, emissive_linear, shown_normal, coat), shown_normal, slope, front_facing);
{%- else %}
    var out: Planes;
    out.surface = packed_surface(base.rgb, emissive_linear, shown_normal * facing, coat);
{% if surface_id %}    out.surface_id = vec2u(object.instance, in.first_primitive + primitive);
{% endif %}
{% if triangle_normal %}    out.triangle_normal = triangle_normal_oct16(across, in.from_eye_in_world);
{% endif %}
    return out;
{%- endif %}
}
{% endif %}
