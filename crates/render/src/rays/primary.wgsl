// The surface that each pixel shows, by one ray each: the same that raster.wgsl draws.
{% include "camera.wgsl" %}
{% include "packed_surface.wgsl" %}
{% if triangle_normal %}
{% include "triangle_normal.wgsl" %}
{% endif %}
{% include "rays/traverse.wgsl" %}

@group(0) var surfaces: texture_storage_2d<rgba32uint, write>;
// Near plane over planar depth, as a depth buffer has it; 0 where nothing is met.
@group(0) var reversed_depth: texture_storage_2d<r32float, write>;
{% if surface_id %}
@group(0) var surface_ids: texture_storage_2d<rg32uint, write>;
{% endif %}
{% if triangle_normal %}
@group(0) var triangle_normals: texture_storage_2d<r32uint, write>;
{% endif %}
{% if redundancy_test %}
// The reversed depth of the nearest surface, redundant or not.
@group(0) var front_depth: texture_storage_2d<r32float, write>;
{% endif %}

const FARTHEST: f32 = 3.0e38;
{% if redundancy_test %}
{% include "known_samples.wgsl" %}

fn candidate_at(hit: Hit, pixel: vec2u, direction: vec3f) -> Candidate {
    let facing = select(-1.0, 1.0, hit.crossing.front);
    let normal = normalize(attributes_at(hit.crossing).normal + vec3f(0.0, 1e-20, 0.0)) * facing;
    let offset = direction * hit.t;
    let pixel_center = (vec2f(pixel) + 0.5) * hit.t;
    return Candidate(
        vec4f(pixel_center, hit.t, 1.0), camera.eye_in_world + offset, camera.near_m / hit.t,
        stretched_footprint(hit.t, camera.footprint, normal, offset),
        textureLoad(flat_triangles, texel_at(hit.slot), 0).xy, pixel,
    );
}
{% endif %}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id);
    if is_beyond(pixel) { return; }
    let direction = direction_of(pixel);
    let ray = ray_from({{ "origin_of(pixel)" if single_pole else "camera.eye_in_world" }}, direction);
{% if redundancy_test %}
    var hit = Hit(FARTHEST, NOTHING, Crossing(0.0, 0.0, 0.0, false, false, vec3u(0u)));
    var near = camera.near_m;
    var searching = true;
    var front = 0.0;
    for (var layer = 0u; searching && layer < MOST_LAYERS; layer++) {
        hit = closest(ray, near, FARTHEST);
        near = hit.t;
        searching = false;
        for (var met = hit.slot != NOTHING; met; met = false) {
            front = max(front, camera.near_m / hit.t);
            searching = is_redundant(candidate_at(hit, pixel, direction));
        }
    }
    hit.slot = select(hit.slot, NOTHING, searching);
    textureStore(front_depth, pixel, vec4f(front));
{% else %}
    let hit = closest(ray, camera.near_m, {{ "farthest_of(pixel)" if single_pole else "FARTHEST" }});
{% endif %}
    let met = hit.slot != NOTHING;
    var surface = vec4u(0u);
    var ids = vec2u(NOTHING);
{% if triangle_normal %}    var triangle_normal = 0u;
{% endif %}
    for (var found = met; found; found = false) {
        let triangle = textureLoad(flat_triangles, texel_at(hit.slot), 0);
        let at = attributes_at(hit.crossing);
        let footprints = uv_footprints(hit.crossing, hit.slot, hit.t * camera.footprint);
        let facing = select(-1.0, 1.0, hit.crossing.front);
        surface = packed_surface(
            base_color(triangle.z, at, footprints).rgb, emission(triangle.z, at, footprints),
            normal_at(triangle.z, at, footprints) * facing, coat(triangle.z, triangle.w, at, footprints),
        );
{%- if marks_glass %}
        surface.z &= ~SEEN_THROUGH;
        for (var is_glass = (triangle.w & GLASS) != 0u; is_glass; is_glass = false) {
            surface = seen_through(surface, glass_of(triangle, at, footprints).transmission);
        }
{%- endif %}
        ids = triangle.xy;
{% if triangle_normal %}
        let corner = bitcast<vec3f>(corner_texel(hit.slot * 3u).xyz);
        let first_edge = bitcast<vec3f>(corner_texel(hit.slot * 3u + 1u).xyz) - corner;
        let second_edge = bitcast<vec3f>(corner_texel(hit.slot * 3u + 2u).xyz) - corner;
        triangle_normal = triangle_normal_oct16(cross(first_edge, second_edge), direction);
{% endif %}
    }
    textureStore(surfaces, pixel, surface);
    textureStore(reversed_depth, pixel, vec4f(select(0.0, camera.near_m / hit.t, met)));
{% if surface_id %}    textureStore(surface_ids, pixel, vec4u(ids, 0u, 0u));
{% endif %}
{% if triangle_normal %}    textureStore(triangle_normals, pixel, vec4u(triangle_normal));
{% endif %}
}
