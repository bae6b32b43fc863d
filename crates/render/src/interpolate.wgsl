// Light is smoother than geometry: pixels between those of a coarser grid take its light where all four around
// them lie on their surface and agree; the others are listed, to be lit by rays of their own.
{% include "camera.wgsl" %}
{% include "normal.wgsl" %}
{% include "surfaces.wgsl" %}

@group(0) var<storage, read_write> sums: array<f32>;
{% include "pixel_list.wgsl" %}
{% include "sums.wgsl" %}

const STEP: u32 = {{ step_px }}u;
// Cosine between normals of one surface.
const SAME_NORMAL: f32 = 0.9;
// Distance from the pixel's own plane, in footprints.
const SAME_PLANE: f32 = 2.0;
// Differences of light below this share of a white surface's are not seen.
const LEAST_LIGHT: f32 = 0.02;

fn is_same_surface(point: vec3f, normal: vec3f, footprint_m: f32, other: vec2u) -> bool {
    let depth = reversed_depth_at(other);
    let z = camera.near_m / max(depth, 1e-30);
    let offset = {{ "origin_of(other)" if single_pole else "camera.eye_in_world" }} + direction_of(other) * z - point;
    let other_normal = unit_from_oct16(surface_at(other).z);
    let near_plane = abs(dot(normal, offset)) < SAME_PLANE * footprint_m * f32(2u * STEP);
    return depth > 0.0 && dot(normal, other_normal) > SAME_NORMAL && near_plane;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = pixel_at(id, STEP);
    if is_beyond(pixel) { return; }
    let at = pixel / STEP;
    let place = place_of(pixel);
    let depth = reversed_depth_at(pixel);
    if all((at & vec2u(1u)) == vec2u(0u)) || depth <= 0.0 { return; }
    let z = camera.near_m / depth;
    let point = {{ "origin_of(pixel)" if single_pole else "camera.eye_in_world" }} + direction_of(pixel) * z;
    let normal = unit_from_oct16(surface_at(pixel).z);
    let low = (at & vec2u(0xfffffffeu)) * STEP;
    let high = min(low + 2u * STEP, camera.size_px - 1u);
    var agree = all(low + 2u * STEP < camera.size_px);
    var least = vec3f(3.0e38);
    var greatest = vec3f(0.0);
{% for corner in range(4) %}
    let corner{{ corner }} = vec2u({{ "high.x" if corner % 2 == 1 else "low.x" }}, {{ "high.y" if corner // 2 == 1 else "low.y" }});
    agree = agree && is_same_surface(point, normal, z * camera.footprint, corner{{ corner }});
    let place{{ corner }} = place_of(corner{{ corner }});
    let light{{ corner }} = light_at(place{{ corner }}, 1.0);
    least = min(least, light{{ corner }});
    greatest = max(greatest, light{{ corner }});
{% endfor %}
    agree = agree && all(greatest - least <= camera.tolerance * max(greatest, vec3f(LEAST_LIGHT)));
    if !agree {
        list_pixel(place);
        return;
    }
    let share = vec2f(pixel - low) / f32(2u * STEP);
    for (var plane = 0u; plane < {{ sum_planes }}u; plane++) {
        let upper = mix(sum_at(plane, place0), sum_at(plane, place1), share.x);
        let lower = mix(sum_at(plane, place2), sum_at(plane, place3), share.x);
        sums[camera.first_sum + plane * camera.pixel_count + place] = mix(upper, lower, share.y);
    }
}
