// The surfaces where mirrored rays end, and those that go through glass.
{% include "packed_surface.wgsl" %}
{% include "rays/traverse.wgsl" %}
{% include "reflections/bounce.wgsl" %}

@group(0) var<storage, read_write> bounces: array<Bounce>;
@group(0) var<storage, read> list: BounceList;

{% include "rise.wgsl" %}
const FARTHEST: f32 = 3.0e38;

{% include "reflections/curvature.wgsl" %}
{% if glass %}
{% include "sequence.wgsl" %}
{% include "reflections/cross_glass.wgsl" %}
{% endif %}

fn next_hit(bounce: Bounce) -> Hit {
{%- if alpha_tested and mapped %}
    cone_side_m = bounce.side_m;
    cone_spread = bounce.spread;
{%- endif %}
    return closest(ray_from(bounce.point_in_world, bounce.direction), bounce.near_m, FARTHEST);
}

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= list.count { return; }
{% if glass %}
    var bounce = bounces[id.x];
    var hit = next_hit(bounce);
    var crossed = 0u;
    for (; hit.slot != NOTHING && crossed < MOST_INTERFACES && crosses(hit, crossed, &bounce); crossed++) {
        hit = next_hit(bounce);
    }
    // What has met so many interfaces shows what lies that way far away.
    hit.slot = select(hit.slot, NOTHING, crossed == MOST_INTERFACES);
    bounces[id.x].direction = bounce.direction;
    bounces[id.x].throughput_linear = bounce.throughput_linear * select(vec3f(1.0), exp(-medium_per_m * hit.t), hit.slot != NOTHING);
{% else %}
    let bounce = bounces[id.x];
    let hit = next_hit(bounce);
{% endif %}
    for (var met = hit.slot != NOTHING; met; met = false) {
        let triangle = textureLoad(flat_triangles, texel_at(hit.slot), 0);
        let at = attributes_at(hit.crossing);
        // A cone that narrows to a focus grows behind it.
        let signed_m = bounce.side_m + bounce.spread * hit.t;
        let side_m = abs(signed_m);
        let footprints = uv_footprints(hit.crossing, hit.slot, side_m);
        let facing = select(-1.0, 1.0, hit.crossing.front);
        let offset = bounce.direction * hit.t;
        let size = abs(bounce.point_in_world) + abs(offset);
        bounces[id.x].point_in_world = bounce.point_in_world + offset;
        bounces[id.x].side_m = side_m;
        bounces[id.x].spread = select(bounce.spread, -bounce.spread, signed_m < 0.0);
        bounces[id.x].surface = packed_surface(
            base_color(triangle.z, at, footprints).rgb, emission(triangle.z, at, footprints),
            normal_at(triangle.z, at, footprints) * facing, coat(triangle.z, triangle.w, at, footprints),
        );
        bounces[id.x].bias_m = BIAS_FOOTPRINTS * side_m + BIAS_ROUNDINGS * max(max(size.x, size.y), size.z);
        bounces[id.x].curvature_per_m = curvature_of(hit.crossing, hit.slot) * facing;
        bounces[id.x].met = 1u;
    }
}
