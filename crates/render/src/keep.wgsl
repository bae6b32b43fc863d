// The samples that an image holds, for redundancy tests of the images after it.
{% include "camera.wgsl" %}
{% include "normal.wgsl" %}
{% include "footprint.wgsl" %}
{% include "surfaces.wgsl" %}

// Inverse planar depth (0 without a sample), a pixel's length on the surface, and the normal: x and y in 16 bits, z.
@group(0) var held: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    let inverse_depth = reversed_depth_at(pixel) / camera.near_m;
    let normal = unit_from_oct16(surface_at(pixel).z);
    let footprint_m = stretched_footprint(1.0 / max(inverse_depth, 1e-30), camera.footprint, normal, direction_of(pixel));
    let sample = vec4u(
        bitcast<u32>(inverse_depth), bitcast<u32>(footprint_m), pack2x16snorm(normal.xy), bitcast<u32>(normal.z),
    );
    textureStore(held, pixel, sample);
}
