// Adds the light from the ends of followed rays to their pixels, and lists the rays off mirrors among those ends.
{% include "camera.wgsl" %}
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "albedo.wgsl" %}
{% if environment_map %}
{% include "table.wgsl" %}
{% endif %}
{% include "light.wgsl" %}
{% include "sequence.wgsl" %}
{% include "highlight.wgsl" %}
{% include "reflections/ends.wgsl" %}
{% if glass %}
{% include "background.wgsl" %}
{% endif %}
{% if mirrors %}
{% include "reflections/bounce_off.wgsl" %}
{% endif %}

@group(0) var<uniform> illumination: Illumination;
// Red, green and blue of each pixel: linear light that mirrored rays bring.
@group(0) var<storage, read_write> reflected: array<f32>;

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let place = id.x;
    if place >= list.count { return; }
    let bounce = bounces[place];
    let surface = bounce.surface;
    let met = bounce.met != 0u;
{% include "shaded.wgsl" %}
    for (var glossy = met && surface.w != 0u; glossy; glossy = false) {
        let normal = unit_from_oct16(surface.z);
        var visibility: VisibilityWords;
{% for word in range(visibility_words) %}        visibility[{{ word }}] = visibility_word({{ word }}u, place, open);
{% endfor %}
        linear += highlight(bounce.point_in_world, normal, -bounce.direction, surface.w, visibility);
{% if mirrors %}
        bounce_off(Mirror(bounce.point_in_world, normal, -bounce.direction, unpack_reflector(surface.w)), bounce);
{% endif %}
    }
    // A ray that leaves the scene brings what the mirror shows of the environment without rays.
    for (var missed = !met; missed; missed = false) {
        linear = environment_mirrored(bounce.direction, max(bounce.roughness, LEAST_ROUGHNESS));
{%- if glass %}
        // One that only went through glass brings what the eye would see there.
        if bounce.unmirrored != 0u { linear = background_linear(bounce.direction); }
{%- endif %}
    }
    linear *= bounce.throughput_linear;
    for (var channel = 0u; channel < 3u; channel++) { reflected[3u * bounce.place + channel] += linear[channel]; }
}
