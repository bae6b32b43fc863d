// Draws the environment map where a view shows no surface. The pass works on the filled view of any method.
{% include "color.wgsl" %}
{% include "view_work.wgsl" %}
{% include "environment.wgsl" %}

@group(0) var<storage, read_write> out_srgb8: array<u32>;
@group(0) var<storage, read> inverse_depth: array<f32>;

// Radiance where a ray meets no surface; the direction's length does not matter.
fn background_linear(direction: vec3f) -> vec3f {
    return environment_radiance(normalize(direction));
}

@compute @workgroup_size(TILE_PX, TILE_PX)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let place = pixel_at(id);
    if any(place >= work.view.size_px) { return; }
    let index = work.view.first_pixel + place.y * work.view.size_px.x + place.x;
    let center = vec2f(place) + 0.5;
    let direction = work.view.column_in_world * center.x + work.view.row_in_world * center.y + work.view.corner_in_world;
    // A loop, not a branch: the software device skips only loops that no lane needs.
    for (var open = inverse_depth[index] <= 0.0; open; open = false) {
        out_srgb8[index] = pack4x8unorm(vec4f(srgb_from_linear(background_linear(direction)), 1.0));
    }
}
