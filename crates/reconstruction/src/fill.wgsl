// Gives pixels that no camera knows the colour of the farther side of their gap: what is disoccluded lies
// behind what occluded it. They stay marked as filled.
{% include "color.wgsl" %}
{% include "pixel_list.wgsl" %}
{% include "view_work.wgsl" %}

// Linear, as RGB9E5.
@group(0) var<storage, read_write> color: array<u32>;
@group(0) var<storage, read_write> inverse_depth: array<f32>;
@group(0) var<storage, read> provenance: array<u32>;

struct Neighbour { inverse_depth: f32, color_linear: vec3f, weight: f32 }

// The first known pixel in one direction.
fn known_towards(origin: vec2i, towards: vec2i, first: u32) -> Neighbour {
    for (var i = 1; i <= REACH_PX; i++) {
        let at = origin + towards * i;
        if any(at < vec2i(0)) || any(at >= vec2i(work.view.size_px)) { break; }
        let index = first + u32(at.y) * work.view.size_px.x + u32(at.x);
        if (provenance[index] & 0xffu) != PROVENANCE_FILLED {
            return Neighbour(inverse_depth[index], linear_from_rgb9e5(color[index]), 1.0 / (f32(i) * length(vec2f(towards))));
        }
    }
    return Neighbour(0.0, vec3f(0.0), 0.0);
}

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= lists[work.view.number].count { return; }
    let first = work.view.first_pixel;
    let index = listed_pixels[first_listed() + id.x];
    let origin = vec2i(place_of(index));
    var farthest = 3.0e38;
{% for d in DIRECTIONS %}
    let n{{ loop.index0 }} = known_towards(origin, vec2i({{ d[0] }}, {{ d[1] }}), first);
    farthest = select(farthest, min(farthest, n{{ loop.index0 }}.inverse_depth), n{{ loop.index0 }}.weight > 0.0);
{% endfor %}
    if farthest >= 3.0e38 { return; }
    var sum = vec3f(0.0);
    var weights = 0.0;
    var depths = 0.0;
{% for d in DIRECTIONS %}
    let w{{ loop.index0 }} = select(0.0, n{{ loop.index0 }}.weight, n{{ loop.index0 }}.inverse_depth * SAME_SIDE <= farthest);
    sum += n{{ loop.index0 }}.color_linear * w{{ loop.index0 }};
    depths += n{{ loop.index0 }}.inverse_depth * w{{ loop.index0 }};
    weights += w{{ loop.index0 }};
{% endfor %}
    color[index] = rgb9e5_from_linear(sum / weights);
    inverse_depth[index] = depths / weights;
}
