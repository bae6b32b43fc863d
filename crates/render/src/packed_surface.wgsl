// A surface in four words: albedo (albedo.wgsl), emission (RGB9E5), normal (octahedral), and reflector, 0 where there is no
// highlight.
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "albedo.wgsl" %}

// Reflectance of a dielectric at normal incidence, as glTF has it.
const DIELECTRIC: f32 = 0.04;

struct Coat { metallic: f32, roughness: f32, phong_reflector: u32, unlit: bool, specular: bool }

fn packed_surface(base_linear: vec3f, emissive_linear: vec3f, normal: vec3f, coat: Coat) -> vec4u {
    let emission = rgb9e5_from_linear(emissive_linear);
    let facing = oct16_from_unit(normal);
{% if shading == "unlit" %}
    return vec4u(packed_albedo(base_linear, true), emission, facing, 0u);
{% elif shading == "blinn_phong" %}
    return vec4u(packed_albedo(base_linear, coat.unlit), emission, facing, select(coat.phong_reflector, 0u, coat.unlit));
{% else %}
    let albedo = base_linear * select(1.0 - coat.metallic, 1.0, coat.unlit);
    let reflectance = mix(vec3f(DIELECTRIC), base_linear, coat.metallic);
    let reflector = pack4x8unorm(vec4f(srgb_from_linear(reflectance), coat.roughness));
    return vec4u(packed_albedo(albedo, coat.unlit), emission, facing, select(0u, reflector, coat.specular && !coat.unlit));
{% endif %}
}
