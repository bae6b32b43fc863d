// One ray into the lobe of each rough surface that is listed.
{% include "reflection.wgsl" %}
{% include "sequence.wgsl" %}
{% include "lobe.wgsl" %}
{% include "bounce/ray.wgsl" %}
{% include "bounce/list.wgsl" %}
{% include "bounce/glossy.wgsl" %}
{% include "bounce/lobe_rays.wgsl" %}

@group(0) var<storage, read> glossy: array<GlossySurface>;
struct GlossyList { workgroups: u32, y: u32, z: u32, count: u32 }
@group(0) var<storage, read> glossy_list: GlossyList;

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= glossy_list.count { return; }
    let surface = glossy[id.x];
    let normal = unit_from_oct16(surface.normal_oct16);
    let mirror = Mirror(surface.point_in_world, normal, surface.towards_eye, Reflector(vec3f(1.0), surface.roughness));
    var ray = lobe_ray(mirror, point_of(lobe_rays.number, seed_of(surface.point_in_world)));
    if surface.is_mirrored != 0u { ray = LobeRay(reflect(-surface.towards_eye, normal), select(0.0, 1.0, lobe_rays.number == 0u)); }
    for (var brings = ray.weight > 0.0; brings; brings = false) {
        let near_m = mirror_boxes[0].start_m / max(dot(normal, ray.direction), LEAST_RISE);
        let guess = pack4x8unorm(vec4f(surface.open, LEAST_ROUGHNESS, 0.0, 0.0));
        let throughput_rgb9e5 = rgb9e5_from_linear(surface.throughput_linear * ray.weight);
        list_ray(0u, MirroredRay(surface.point_in_world, surface.pixel, ray.direction, guess, throughput_rgb9e5, near_m, 0.0, 0.0));
    }
}
