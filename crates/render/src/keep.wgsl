// What an image has come to hold, for tests of the images after it.
{% include "camera.wgsl" %}
{% include "normal.wgsl" %}
{% include "footprint.wgsl" %}

@group(0) @binding(1) var surfaces: texture_2d<u32>;
@group(0) @binding(2) var reversed_depth: {{ "texture_2d<f32>" if by_rays else "texture_depth_2d" }};
// Inverse planar depth (0 without a sample), a pixel's length on the surface, and the normal: x and y in 16 bits, z.
@group(0) @binding(3) var held: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= camera.size_px) { return; }
    let inverse_depth = textureLoad(reversed_depth, id.xy, 0){{ ".x" if by_rays else "" }} / camera.near_m;
    let normal = unit_from_oct16(textureLoad(surfaces, id.xy, 0).z);
    let footprint_m = stretched_footprint(1.0 / max(inverse_depth, 1e-30), camera.footprint, normal, direction_of(id.xy));
    let sample = vec4u(
        bitcast<u32>(inverse_depth), bitcast<u32>(footprint_m), pack2x16snorm(normal.xy), bitcast<u32>(normal.z),
    );
    textureStore(held, id.xy, sample);
}
