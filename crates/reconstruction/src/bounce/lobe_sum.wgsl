// Adds the light of all rays into the lobes of listed surfaces to their pixels.
{% include "color.wgsl" %}
{% include "bounce/glossy.wgsl" %}

@group(0) var<storage, read> glossy: array<GlossySurface>;
struct GlossyList { workgroups: u32, y: u32, z: u32, count: u32 }
@group(0) var<storage, read> glossy_list: GlossyList;
// Red, green and blue of each pixel: sums of many rays are more than RGB9E5 can hold.
@group(0) var<storage, read> lobe_light: array<f32>;
@group(0) var<storage, read_write> out_color: array<u32>;

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= glossy_list.count { return; }
    let pixel = glossy[id.x].pixel;
    let light = vec3f(lobe_light[3u * pixel], lobe_light[3u * pixel + 1u], lobe_light[3u * pixel + 2u]);
    out_color[pixel] = rgb9e5_from_linear(linear_from_rgb9e5(out_color[pixel]) + light);
}
