// The depths of an image's samples, for redundancy tests of the images after it.
{% include "camera.wgsl" %}
{% include "surfaces.wgsl" %}

// Inverse planar depth, 0 without a sample.
@group(0) var held: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    textureStore(held, pixel, vec4u(bitcast<u32>(reversed_depth_at(pixel) / camera.near_m)));
}
