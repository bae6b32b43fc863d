// What an image has come to hold, for tests of the images after it.
{% include "camera.wgsl" %}

@group(0) @binding(1) var surfaces: texture_2d<u32>;
@group(0) @binding(2) var reversed_depth: {{ "texture_2d<f32>" if by_rays else "texture_depth_2d" }};
@group(0) @binding(3) var surface_ids: texture_2d<u32>;
@group(0) @binding(4) var held: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= camera.size_px) { return; }
    let depth = textureLoad(reversed_depth, id.xy, 0){{ ".x" if by_rays else "" }};
    let normal = textureLoad(surfaces, id.xy, 0).z;
    textureStore(held, id.xy, vec4u(bitcast<u32>(depth / camera.near_m), normal, textureLoad(surface_ids, id.xy, 0).xy));
}
