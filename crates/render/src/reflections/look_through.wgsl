// The rays of an eye through the glass that a picture shows.
{% include "camera.wgsl" %}
{% include "color.wgsl" %}
{% include "normal.wgsl" %}
{% include "light.wgsl" %}
{% include "sequence.wgsl" %}
{% include "surfaces.wgsl" %}
{% include "highlight.wgsl" %}
{% include "reflections/bounce.wgsl" %}
{% include "reflections/bounce_off.wgsl" %}

@group(0) var<uniform> illumination: Illumination;
{% include "rise.wgsl" %}
{% include "spot.wgsl" %}

// The ray looks for glass from so much before it on: depths of one surface, in a picture and along a ray, differ by less.
const DEPTH_SLACK: f32 = 1e-3;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    let depth = reversed_depth_at(pixel);
    let surface = surface_at(pixel);
    for (var through = depth > 0.0 && (surface.z & SEEN_THROUGH) != 0u; through; through = false) {
        let direction = direction_of(pixel);
        let way = length(direction);
        var ray: Bounce;
        ray.point_in_world = camera.eye_in_world;
        ray.place = camera.first_word / {{ plane_count }}u + place_of(pixel);
        ray.direction = direction / way;
        ray.seed = hashed(spot_of(pixel, depth, surface).seed + 0x1b873593u);
        ray.throughput_linear = vec3f(1.0);
        // A pixel's side grows with planar depth, which is shorter than the way.
        ray.spread = camera.footprint / way;
        ray.near_m = way * camera.near_m / depth * (1.0 - DEPTH_SLACK);
        ray.unmirrored = 1u;
        list_bounce(ray);
    }
}
