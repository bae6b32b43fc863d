// Rays into the lobes of what a picture shows: one of each pixel that reflects.
{% include "camera.wgsl" %}
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "light.wgsl" %}
{% include "sequence.wgsl" %}
{% include "surfaces.wgsl" %}
{% include "highlight.wgsl" %}
{% include "lobe.wgsl" %}
{% include "reflections/bounce.wgsl" %}
{% include "reflections/bounce_off.wgsl" %}

@group(0) var<uniform> illumination: Illumination;
@group(0) var<uniform> lobe: Lobe;
// Of all rays of each pixel together.
@group(0) var<storage, read_write> weights: array<f32>;

{% include "rise.wgsl" %}
{% include "spot.wgsl" %}

// Of the rays of a pixel's sequence: the first at this position, this one, and how many the position has. `whole` is 1 where
// rays off mirrors do not show a part of the light.
struct Lobe { first_ray: u32, ray: u32, ray_count: u32, whole: u32 }

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    let place = camera.first_word / {{ plane_count }}u + place_of(pixel);
    let depth = reversed_depth_at(pixel);
    let surface = surface_at(pixel);
    let reflector = unpack_reflector(surface.w);
    let share = 1.0 - select(mirror_share(reflector.roughness), 0.0, lobe.whole != 0u);
    for (var glossy = depth > 0.0 && surface.w != 0u && share > 0.0; glossy; glossy = false) {
        let spot = spot_of(pixel, depth, surface);
        let direction = direction_of(pixel);
        let mirror = Mirror(spot.point, spot.normal, -normalize(direction), reflector);
        let seed = hashed(spot.seed + 0x2545f491u);
        var ray = lobe_ray(mirror, point_of(lobe.ray, seed));
{% if first %}
        var sum = 0.0;
        for (var i = 0u; i < lobe.ray_count; i++) { sum += lobe_ray(mirror, point_of(lobe.first_ray + i, seed)).weight; }
        weights[place] = sum;
        // All rays go below the surface: the mirrored one takes their place.
        let mirrored = LobeRay(reflect(direction, spot.normal) / length(direction), 1.0);
        if sum <= 0.0 { ray = mirrored; }
        sum = select(sum, 1.0, sum <= 0.0);
{% else %}
        let sum = max(weights[place], 1e-20);
{% endif %}
        let side_m = camera.near_m / depth * camera.footprint;
        list_bounce(Bounce(
            spot.origin, place, ray.direction, hashed(seed ^ hashed(lobe.ray)),
            environment_reflectance(mirror) * (share * ray.weight / sum), side_m, vec4u(0u), spot.bias_m,
            camera.footprint / length(direction), 0.0, 0.0, 0u, side_m, 0u,
        ));
    }
}
