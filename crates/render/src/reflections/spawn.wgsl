// Rays off the mirrors that a picture shows.
{% include "camera.wgsl" %}
{% include "packed_surface.wgsl" %}
{% include "light.wgsl" %}
{% include "sequence.wgsl" %}
{% include "surfaces.wgsl" %}
{% include "highlight.wgsl" %}
{% include "rays/traverse.wgsl" %}
{% include "reflections/bounce.wgsl" %}
{% include "reflections/bounce_off.wgsl" %}

@group(0) var<uniform> illumination: Illumination;
{% include "rise.wgsl" %}
{% include "spot.wgsl" %}
{% include "reflections/curvature.wgsl" %}

// Depths of one surface, drawn or found by a ray, differ by less than this share.
const DEPTH_SLACK: f32 = 1e-3;

// Of the triangle that a pixel shows. The neighbours' normals would do, but a tile of a picture does not have them all.
fn curvature_at(direction: vec3f, planar_depth_m: f32) -> f32 {
{% if alpha_tested and mapped %}
    cone_side_m = 0.0;
    cone_spread = camera.footprint;
{% endif %}
    let ray = ray_from(camera.eye_in_world, direction);
    let hit = closest(ray, planar_depth_m * (1.0 - DEPTH_SLACK), planar_depth_m * (1.0 + DEPTH_SLACK));
    var curvature_per_m = 0.0;
    for (var found = hit.slot != NOTHING; found; found = false) {
        curvature_per_m = curvature_of(hit.crossing, hit.slot) * select(-1.0, 1.0, hit.crossing.front);
    }
    return curvature_per_m;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    let place = camera.first_word / {{ plane_count }}u + place_of(pixel);
    let depth = reversed_depth_at(pixel);
    let surface = surface_at(pixel);
    let reflector = unpack_reflector(surface.w);
    for (var glossy = depth > 0.0 && surface.w != 0u && mirror_share(reflector.roughness) > 0.0; glossy; glossy = false) {
        let spot = spot_of(pixel, depth, surface);
        let direction = direction_of(pixel);
        let planar_depth_m = camera.near_m / depth;
        var arriving: Bounce;
        arriving.place = place;
        arriving.seed = spot.seed;
        arriving.throughput_linear = vec3f(1.0);
        arriving.side_m = planar_depth_m * camera.footprint;
        arriving.near_m = arriving.side_m;
        arriving.bias_m = spot.bias_m;
        // A pixel's side grows with planar depth, which is shorter than the way.
        arriving.spread = camera.footprint / length(direction);
        arriving.curvature_per_m = curvature_at(direction, planar_depth_m);
        bounce_off(Mirror(spot.point, spot.normal, -normalize(direction), reflector), arriving);
    }
}
