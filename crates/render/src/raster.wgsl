{% if surface_id %}enable primitive_index;
{% endif %}
// Draws triangles: as a finished view (colour only) or as the planes of a depth image.
{% include "color.wgsl" %}
{% include "normal.wgsl" %}

struct Object {
    world_from_mesh: array<vec4f, 3>,
    normal_from_mesh: array<vec4f, 3>,
    base_color_linear: vec4f,
    emissive_linear: vec3f,
    alpha_cutoff: f32,
    phong_specular: f32,
    phong_exponent: f32,
    instance: u32,
    padding: u32,
}
// Directional where towards_or_position.w is 0, else a point light.
struct Light { towards_or_position: vec4f, intensity_linear: vec4f }
struct Surroundings {
    ambient_linear: vec3f,
    padding: u32,
    wind_direction: vec3f,
    wind_amplitude_m: f32,
    wind_waves_per_m: vec3f,
    wind_frequency_hz: f32,
{% if lights > 0 %}    lights: array<Light, {{ lights }}>,
{% endif %}
}
struct RasterCamera { clip_from_world: mat4x4f, eye_in_world: vec3f, scene_time_s: f32 }

@group(0) @binding(0) var<uniform> camera: RasterCamera;
@group(0) @binding(1) var<uniform> surroundings: Surroundings;
@group(1) @binding(0) var<uniform> object: Object;
@group(2) @binding(0) var base_color_texture: texture_2d<f32>;
@group(2) @binding(1) var base_color_sampler: sampler;

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) position_in_world: vec3f,
    @location(1) normal_in_world: vec3f,
    @location(2) uv: vec2f,
    @location(3) color_linear: vec4f,
    @location(4) @interpolate(flat) first_primitive: u32,
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
) -> Varyings {
    var position_in_world = rows_times(object.world_from_mesh, vec4f(position, 1.0));
{% if wind %}
    let turns = surroundings.wind_frequency_hz * camera.scene_time_s + dot(surroundings.wind_waves_per_m, position_in_world);
    let swing = sin(6.2831855 * fract(turns));
    position_in_world += surroundings.wind_direction * (surroundings.wind_amplitude_m * sway * swing);
{% endif %}
    var out: Varyings;
    out.clip = camera.clip_from_world * vec4f(position_in_world, 1.0);
    out.position_in_world = position_in_world;
    out.normal_in_world = rows_times(object.normal_from_mesh, vec4f(normal, 0.0));
    out.uv = uv;
    out.color_linear = vec4f(linear_from_srgb(color_srgb.rgb), color_srgb.a);
    out.first_primitive = first_primitive;
    return out;
}

struct Surface { color_linear: vec3f, normal_in_world: vec3f }

fn surface(in: Varyings, front_facing: bool) -> Surface {
    var base = object.base_color_linear * in.color_linear;
{% if textured %}
    base *= textureSample(base_color_texture, base_color_sampler, in.uv);
{% endif %}
{% if alpha_tested %}
    if base.a < object.alpha_cutoff { discard; }
{% endif %}
    let n = normalize(in.normal_in_world){% if double_sided %} * select(-1.0, 1.0, front_facing){% endif %};
{% if lit %}
    let to_eye = normalize(camera.eye_in_world - in.position_in_world);
    var diffuse = surroundings.ambient_linear;
    var specular = vec3f(0.0);
{% for i in range(lights) %}
    {
        let light = surroundings.lights[{{ i }}];
        let offset = light.towards_or_position.xyz - in.position_in_world * light.towards_or_position.w;
        let distance_squared = dot(offset, offset);
        let towards = offset * inverseSqrt(distance_squared);
        let falloff = select(1.0, 1.0 / distance_squared, light.towards_or_position.w > 0.0);
        let irradiance = light.intensity_linear.rgb * (falloff * max(dot(n, towards), 0.0));
        diffuse += irradiance;
{% if specular %}
        let half_way = normalize(towards + to_eye);
        specular += irradiance * pow(max(dot(n, half_way), 0.0), object.phong_exponent);
{% endif %}
    }
{% endfor %}
    return Surface(base.rgb * diffuse + specular * object.phong_specular + object.emissive_linear, n);
{% else %}
    return Surface(base.rgb + object.emissive_linear, n);
{% endif %}
}

{% if samples %}
struct Planes {
    @location(0) color_rgb9e5: u32,
{% if normal %}    @location({{ normal_location }}) normal_oct16: u32,
{% endif %}{% if surface_id %}    @location({{ id_location }}) surface_id: vec2u,
{% endif %}
}

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front_facing: bool{% if surface_id %}, @builtin(primitive_index) primitive: u32{% endif %}) -> Planes {
    let s = surface(in, front_facing);
    var out: Planes;
    out.color_rgb9e5 = rgb9e5_from_linear(s.color_linear);
{% if normal %}    out.normal_oct16 = oct16_from_unit(s.normal_in_world);
{% endif %}{% if surface_id %}    out.surface_id = vec2u(object.instance, in.first_primitive + primitive);
{% endif %}
    return out;
}
{% else %}
@fragment
fn fragment(in: Varyings, @builtin(front_facing) front_facing: bool) -> @location(0) vec4f {
    return vec4f(surface(in, front_facing).color_linear, 1.0);
}
{% endif %}
