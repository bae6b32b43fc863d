// A surface in four words: albedo (albedo.wgsl), emission (RGB9E5) or the open share of the environment, normal
// (octahedral), and reflector, 0 where there is no highlight.
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "albedo.wgsl" %}

struct Coat {
    metallic: f32,
    roughness: f32,
    // At normal incidence.
    dielectric_linear: vec3f,
    phong_reflector: u32,
    unlit: bool,
    specular: bool,
    // The share of the environment's light that arrives.
    open: f32,
}

fn packed_surface(base_linear: vec3f, emissive_linear: vec3f, normal: vec3f, coat: Coat) -> vec4u {
    // What glows is not occluded: there is one word for both.
    let occluded = coat.open < 1.0 && all(emissive_linear <= vec3f(0.0)) && !coat.unlit;
    let emission = select(rgb9e5_from_linear(emissive_linear), bitcast<u32>(coat.open), occluded);
    let occlusion = select(0u, OCCLUDED, occluded);
    let facing = oct16_from_unit(normal);
{% if shading == "unlit" %}
    return vec4u(packed_albedo(base_linear, true) | occlusion, emission, facing, 0u);
{% elif shading == "blinn_phong" %}
    return vec4u(packed_albedo(base_linear, coat.unlit) | occlusion, emission, facing, select(coat.phong_reflector, 0u, coat.unlit));
{% else %}
    let albedo = base_linear * select(1.0 - coat.metallic, 1.0, coat.unlit);
    let reflectance = mix(coat.dielectric_linear, base_linear, coat.metallic);
    let reflector = pack4x8unorm(vec4f(srgb_from_linear(reflectance), coat.roughness));
    return vec4u(packed_albedo(albedo, coat.unlit) | occlusion, emission, facing, select(0u, reflector, coat.specular && !coat.unlit));
{% endif %}
}

// The normal of a normal map's texel, from the surface's normal, its tangent and the sign of its bitangent (glTF 2.0,
// 3.9.3; MikkTSpace). All of them are as they are between the corners.
fn mapped_normal(texel: vec3f, scale: f32, normal: vec3f, tangent: vec4f) -> vec3f {
    let local = (texel * 2.0 - 1.0) * vec3f(scale, scale, 1.0);
    let bitangent = cross(normal, tangent.xyz) * tangent.w;
    return normalize(tangent.xyz * local.x + bitangent * local.y + normal * local.z + normal * 1e-6);
}
{% if marks_glass is defined and marks_glass %}

// A surface that sends on a share of the light in place of scattering it.
fn seen_through(surface: vec4u, transmission: f32) -> vec4u {
    let scattered_linear = albedo_linear(surface.x) * (1.0 - transmission);
    return vec4u(packed_albedo(scattered_linear, false) | (surface.x & OCCLUDED), surface.y, surface.z | SEEN_THROUGH, surface.w);
}
{% endif %}
