// Gives the pixels of a drawn view their colour: the depth says where the surface is, and all cameras vote on the point.
// Where none knows it, the drawn sample's own colour stands.
{% include "surface.wgsl" %}

// A layer for each view of the batch.
@group(0) var drawn_depth: texture_depth_2d_array;
@group(0) var drawn_sample: texture_2d_array<u32>;

fn shows_background(camera: SampleCamera, point_in_world: vec3f) -> bool {
    let p = homogeneous(camera.homogeneous_pixel_from_world, vec4f(point_in_world, 1.0));
    let uv = p.xy / p.z;
    let texel = vec2u(clamp(uv, vec2f(0.0), camera.cells));
    let inside = p.z > 0.0 && all(uv >= vec2f(0.0)) && all(uv < camera.cells + 1.0);
    let words = textureLoad(cell_codes, texel_at(camera.first_cell + texel.y * camera.width_px + texel.x), 0);
    // Not where the ray passed what other images hold: bit 15 says so.
    return inside && (words.x & 0xffffu) == BACKGROUND_CODE;
}

// The bit of a sample's camera.
fn mask_of(sample: u32) -> u32 {
    var mask = 0u;
{% for k in range(cameras) %}
    {
        let first = work.cameras[{{ k }}].first_cell;
        let count = work.cameras[{{ k }}].width_px * (u32(work.cameras[{{ k }}].cells.y) + 1u);
        mask = select(mask, work.cameras[{{ k }}].mask, sample >= first && sample - first < count);
    }
{% endfor %}
    return mask;
}

@compute @workgroup_size(TILE_PX, TILE_PX)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let place = pixel_at(id);
    if any(place >= work.view.size_px) { return; }
    let pixel = pixel_of(place);
    let layer = work.view.first_pixel / (work.view.size_px.x * work.view.size_px.y);
    let depth = textureLoad(drawn_depth, place, layer, 0);
    let sample = textureLoad(drawn_sample, place, layer, 0).x;
    let drawn = depth > 0.0;
    let span = span_in_volume(work.view.eye_in_world, pixel.direction, work.view.near_m);
    // Reversed depth: near over planar depth.
    let t = select(span.far, work.view.near_m / depth, drawn);
    let point_in_world = work.view.eye_in_world + pixel.direction * t;
    let blend = blend_two_best(point_in_world, pixel.direction);
    let own = linear_from_rgb9e5(textureLoad(cell_colors, texel_at(sample), 0).x);
    let known = blend.origin != 0u;
    let origin = select(origin_of(mask_of(sample), 0u), blend.origin, known);
    // Some camera sees the background where the ray leaves the volume.
    var empty = span.near > span.far;
{% for k in range(cameras) %}
    empty = empty || shows_background(work.cameras[{{ k }}], point_in_world);
{% endfor %}
    write_found(pixel.index, drawn, t, select(own, blend.color_linear, known), origin, empty);
}
