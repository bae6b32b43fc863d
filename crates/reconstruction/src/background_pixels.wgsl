// Gives pixels without a surface the background in their own direction, as the view itself would show it.
{% include "color.wgsl" %}
{% include "background.wgsl" %}
{% include "view_work.wgsl" %}

@group(0) var<storage, read_write> srgb8: array<u32>;
@group(0) var<storage, read> provenance: array<u32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if any(pixel >= work.view.size_px) { return; }
    let index = work.view.first_pixel + pixel.y * work.view.size_px.x + pixel.x;
    if (provenance[index] & 0xffu) == PROVENANCE_HIT { return; }
    let center = vec2f(pixel) + 0.5;
    let direction = work.view.column_in_world * center.x + work.view.row_in_world * center.y + work.view.corner_in_world;
    srgb8[index] = pack4x8unorm(vec4f(srgb_from_linear(background_linear(direction)), 1.0));
}
