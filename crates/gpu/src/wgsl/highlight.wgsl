// Light that depends on the viewer; the twin of depth-image's highlight.rs. The includer declares
// `illumination` and includes color.wgsl and light.wgsl.

// The words of all visibility planes of a texel; one that counts for nothing where there are none.
alias VisibilityWords = array<u32, {{ [visibility_words, 1] | max }}>;

struct Reflector { reflectance_linear: vec3f, roughness: f32 }

// A point that reflects towards an eye.
struct Mirror { point_in_world: vec3f, normal: vec3f, towards_eye: vec3f, reflector: Reflector }

// Smoother than this counts as this: the peak of a highlight stays finite.
const LEAST_ROUGHNESS: f32 = 0.045;
const LEAST_COSINE: f32 = 1e-4;
{%- if mirrors is defined and mirrors %}
// Up to this roughness a ray brings all that a surface mirrors; from the other on, nothing.
const ROUGHEST_MIRROR: f32 = 0.1;
const ROUGHEST_MIXED: f32 = 0.2;
{%- endif %}

fn unpack_reflector(word: u32) -> Reflector {
    let bytes = unpack4x8unorm(word);
    return Reflector(linear_from_srgb(bytes.rgb), bytes.a);
}

{% if highlight == 'ggx' %}
fn ggx_alpha(roughness: f32) -> f32 {
    let perceptual = max(roughness, LEAST_ROUGHNESS);
    return perceptual * perceptual;
}

// Trowbridge-Reitz, times π. From the sine, which is exact where the cosine is 1 but for its last bits. Nothing
// where there is no half-way.
fn ggx_distribution(normal: vec3f, half_way: vec3f, alpha: f32) -> f32 {
    let cosine = max(dot(normal, half_way), 0.0);
    let squared = alpha * alpha;
    let across = cross(normal, half_way);
    let spread = max(dot(across, across) + cosine * cosine * squared, squared);
    return dot(half_way, half_way) * squared / (spread * spread);
}

// Height-correlated Smith masking and shadowing, over 4 · n·l · n·v.
fn ggx_visibility(n_l: f32, n_v: f32, alpha: f32) -> f32 {
    let squared = alpha * alpha;
    let from_eye = n_l * sqrt(n_v * n_v * (1.0 - squared) + squared);
    let from_light = n_v * sqrt(n_l * n_l * (1.0 - squared) + squared);
    return 0.5 / max(from_eye + from_light, 1e-12);
}

fn schlick(reflectance_linear: vec3f, cosine: f32) -> vec3f {
    let rest = clamp(1.0 - cosine, 0.0, 1.0);
    let squared = rest * rest;
    return reflectance_linear + (1.0 - reflectance_linear) * (squared * squared * rest);
}

// The highlight of one light, unoccluded.
fn highlight_from_light(light: Light, mirror: Mirror) -> vec3f {
    let incident = incident_from(light, mirror.point_in_world, vec2f(0.5));
    let half_way = unit_or_zero(incident.towards + mirror.towards_eye);
    let n_l = max(dot(mirror.normal, incident.towards), 0.0);
    let n_v = max(dot(mirror.normal, mirror.towards_eye), LEAST_COSINE);
    // A light with an extent is as good as a rougher surface (Karis 2013).
    let alpha = min(ggx_alpha(mirror.reflector.roughness) + 0.5 * apparent_radius(light, incident), 1.0);
    let lobe = ggx_distribution(mirror.normal, half_way, alpha) * ggx_visibility(n_l, n_v, alpha);
    let fresnel = schlick(mirror.reflector.reflectance_linear, max(dot(mirror.towards_eye, half_way), 0.0));
    return incident.irradiance_linear * fresnel * (lobe * n_l);
}
{%- if mirrors is defined and mirrors %}

// The surface's part of the split sum, by Karis' fit: the share of the light of the mirror direction that is reflected.
fn environment_reflectance(mirror: Mirror) -> vec3f {
{%- else %}

// The highlight of the environment, unoccluded: split sum, with Karis' fit for the surface's part.
fn highlight_from_environment(mirror: Mirror) -> vec3f {
{%- endif %}
    let n_v = clamp(dot(mirror.normal, mirror.towards_eye), 0.0, 1.0);
    let roughness = max(mirror.reflector.roughness, LEAST_ROUGHNESS);
    let r = roughness * vec4f(-1.0, -0.0275, -0.572, 0.022) + vec4f(1.0, 0.0425, 1.04, -0.04);
    let grazing = min(r.x * r.x, exp2(-9.28 * n_v)) * r.x + r.y;
    let brdf = mirror.reflector.reflectance_linear * (r.z - 1.04 * grazing) + (r.w + 1.04 * grazing);
{%- if mirrors is defined and mirrors %}
    return brdf;
}

// The share of the mirror direction's light that a ray brings: all of it for surfaces that are smooth, none for
// rough ones, which mirror the environment alone.
fn mirror_share(roughness: f32) -> f32 {
    return clamp((ROUGHEST_MIXED - roughness) / (ROUGHEST_MIXED - ROUGHEST_MIRROR), 0.0, 1.0);
}

// The highlight of the environment, unoccluded, as far as no ray brings it.
fn highlight_from_environment(mirror: Mirror) -> vec3f {
{%- if glossy is defined and glossy %}
    return vec3f(0.0);
{%- else %}
    let roughness = max(mirror.reflector.roughness, LEAST_ROUGHNESS);
    let arriving = environment_mirrored(reflect(-mirror.towards_eye, mirror.normal), roughness);
    return arriving * environment_reflectance(mirror) * (1.0 - mirror_share(mirror.reflector.roughness));
{%- endif %}
}
{%- else %}
    return environment_mirrored(reflect(-mirror.towards_eye, mirror.normal), roughness) * brdf;
}
{%- endif %}
{% else %}
// The exponent whose lobe is as wide as a roughness' (Walter et al. 2007).
fn phong_exponent(roughness: f32) -> f32 {
    let squared = roughness * roughness;
    return clamp(2.0 / max(squared * squared, 1e-6) - 2.0, 1.0, 1024.0);
}

// The highlight of one light, unoccluded.
fn highlight_from_light(light: Light, mirror: Mirror) -> vec3f {
    let incident = incident_from(light, mirror.point_in_world, vec2f(0.5));
    let half_way = unit_or_zero(incident.towards + mirror.towards_eye);
    let n_l = max(dot(mirror.normal, incident.towards), 0.0);
    let lobe = pow(max(dot(mirror.normal, half_way), 0.0), phong_exponent(mirror.reflector.roughness));
    return incident.irradiance_linear * mirror.reflector.reflectance_linear * (lobe * n_l);
}

// A mirror image of the environment is not part of this lighting.
fn highlight_from_environment(mirror: Mirror) -> vec3f {
    return vec3f(0.0);
}
{% endif %}

// All highlights of a surface for one eye; none where the reflector is 0. Byte 0 of the visibility is the
// environment's share, byte 1 + i the i-th light's.
fn highlight(
    point_in_world: vec3f,
    normal: vec3f,
    towards_eye: vec3f,
    reflector_word: u32,
    visibility: VisibilityWords,
) -> vec3f {
    let mirror = Mirror(point_in_world, normal, towards_eye, unpack_reflector(reflector_word));
    var sum = highlight_from_environment(mirror){% if visibility_words > 0 %} * unpack4x8unorm(visibility[0]).x{% endif %};
{% if light_slots <= 8 %}
    // Unrolled, which is a third faster than a loop; a slot without a light is dark.
{% for i in range(light_slots) %}
    sum += highlight_from_light(illumination.lights[{{ i }}], mirror){% if visibility_words > 0 %} * unpack4x8unorm(visibility[{{ (i + 1) // 4 }}])[{{ (i + 1) % 4 }}]{% endif %};
{% endfor %}
{% elif visibility_words == 0 %}
    for (var i = 0u; i < illumination.light_count; i++) {
        sum += highlight_from_light(illumination.lights[i], mirror);
    }
{% else %}
    // A loop a word: words have constant places.
{% for word in range(visibility_words) %}
    for (var i = {{ [4 * word - 1, 0] | max }}u; i < min(illumination.light_count, {{ 4 * word + 3 }}u); i++) {
        let share = f32((visibility[{{ word }}] >> (8u * ((i + 1u) % 4u))) & 0xffu) / 255.0;
        sum += highlight_from_light(illumination.lights[i], mirror) * share;
    }
{% endfor %}
{% endif %}
    return select(sum, vec3f(0.0), reflector_word == 0u);
}
