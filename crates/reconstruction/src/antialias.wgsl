// The colour that a pixel shows: the mean over its positions in linear light, as sRGB.
{% include "color.wgsl" %}
{% include "view_work.wgsl" %}
{% if environment_map %}
{% include "environment.wgsl" %}
{% endif %}
{% include "background.wgsl" %}

// Linear, as RGB9E5, of one position; sRGB once the view is finished.
@group(0) var<storage, read_write> color: array<u32>;
@group(0) var<storage, read> inverse_depth: array<f32>;
{% if sums != "None" %}
// Red, green and blue of each pixel: linear light, over the positions so far.
@group(0) var<storage, read_write> sums: array<f32>;
{% endif %}

// Nothing nearer than infinity is the background, whether proven or assumed.
fn shown_linear(index: u32, place: vec2u) -> vec3f {
    var linear = linear_from_rgb9e5(color[index]);
    // A loop, not a branch: the software device skips only loops that no lane needs.
    for (var open = inverse_depth[index] <= 0.0; open; open = false) {
        let center = vec2f(place) + 0.5;
        linear = background_linear(
            work.view.column_in_world * center.x + work.view.row_in_world * center.y + work.view.corner_in_world,
        );
    }
    return linear;
}

@compute @workgroup_size({{ "LIST_WORKGROUP" if listed else "TILE_PX, TILE_PX" }})
fn main(@builtin(global_invocation_id) id: vec3u) {
{% include "at_pixel.wgsl" %}
{% if sums == "None" %}
    color[index] = pack4x8unorm(vec4f(srgb_from_linear(shown_from_mean(shown_linear(index, place), work.tone)), 1.0));
{% elif sums == "Read" %}
    let mean = vec3f(sums[3u * index], sums[3u * index + 1u], sums[3u * index + 2u]) * work.position_share;
    color[index] = pack4x8unorm(vec4f(srgb_from_linear(shown_from_mean(mean, work.tone)), 1.0));
{% else %}
    let shown = shown_linear(index, place);
{% for channel in ["r", "g", "b"] %}
    sums[3u * index + {{ loop.index0 }}u] {{ "=" if sums == "Begun" else "+=" }} shown.{{ channel }};
{% endfor %}
{% endif %}
}
