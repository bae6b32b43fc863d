// Lists the rough surfaces that pixels show.
{% include "sequence.wgsl" %}
{% include "lobe.wgsl" %}
{% include "bounce/glossy.wgsl" %}
{% include "bounce/lobe_rays.wgsl" %}

@group(0) var<storage, read_write> glossy_surfaces: array<GlossySurface>;
struct GlossyList { workgroups: atomic<u32>, y: u32, z: u32, count: atomic<u32> }
@group(0) var<storage, read_write> glossy_list: GlossyList;
@group(0) var<storage, read_write> lobe_light: array<f32>;

// Lists a surface from whose lobe a pixel shows the share `shown`. All of its rays together weigh 1.
fn list_glossy(mirror: Mirror, pixel: u32, shown: vec3f, open: f32) {
    let seed = seed_of(mirror.point_in_world);
    // As the rays see it.
    let normal_oct16 = oct16_from_unit(mirror.normal);
    let listed = Mirror(mirror.point_in_world, unit_from_oct16(normal_oct16), mirror.towards_eye, mirror.reflector);
    var sum = 0.0;
    for (var i = 0u; i < lobe_rays.count; i++) { sum += lobe_ray(listed, point_of(i, seed)).weight; }
    let all_below = sum <= 0.0;
    let entry = atomicAdd(&glossy_list.count, 1u);
    if entry % LIST_WORKGROUP == 0u { atomicAdd(&glossy_list.workgroups, 1u); }
    let throughput = shown * environment_reflectance(mirror) / select(sum, 1.0, all_below);
    for (var channel = 0u; channel < 3u; channel++) { lobe_light[3u * pixel + channel] = 0.0; }
    glossy_surfaces[entry] = GlossySurface(mirror.point_in_world, pixel, mirror.towards_eye, normal_oct16, throughput, mirror.reflector.roughness, open, select(0u, 1u, all_below), vec2u(0u));
}
