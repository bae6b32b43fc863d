// The first passes of the joint carve: march in the image of one sample camera alone, then ask all cameras
// about the point found. Most pixels end with the nearest camera and most others with the second nearest;
// what is left goes to joint_carve.wgsl.
//
// In the camera's image the ray is a straight line along which columns, rows and the depth code are linear
// in one parameter s, so that a step needs no division.
{% include "color.wgsl" %}
{% include "sample_set.wgsl" %}
{% include "cell.wgsl" %}
{% include "surface.wgsl" %}

const MAX_COARSE: u32 = 64u;
const MAX_FINE: u32 = 12u;
const START_LEVEL: u32 = {{ start_level }}u;
const THICKNESS_FOOTPRINTS: f32 = {{ thickness_footprints }};
const NUDGE_PX: f32 = 1e-3;

// How far the way is free, and whether it ends at a surface.
struct March { t: f32, crossed: bool }

fn march(a: vec3f, b: vec3f, near: f32, far: f32) -> March {
    let scale = work.cameras[{{ march_camera }}].code_scale;
    let offset = work.cameras[{{ march_camera }}].code_offset;
    let cells = work.cameras[{{ march_camera }}].cells;
    let log2_sides = work.cameras[{{ march_camera }}].log2_sides;
    let first_node = work.cameras[{{ march_camera }}].first_node;
    let first_cell = work.cameras[{{ march_camera }}].first_cell;
    let width_px = work.cameras[{{ march_camera }}].width_px;
    // A small image has fewer levels.
    let start_level = min(START_LEVEL, top_level(log2_sides));
    let p0 = a + b * near;
    // The line ends before the plane through the camera's eye.
    let end = select(far, min(far, (0.01 * p0.z - a.z) * safe_reciprocal(b.z)), b.z < 0.0);
    let p1 = a + b * end;
    let origin = vec3f(p0.xy / p0.z - 0.5, scale / p0.z + offset);
    let to = vec3f(p1.xy / p1.z - 0.5, scale / p1.z + offset);
    let line = to - origin;
    let inverse = 1.0 / select(line.xy, vec2f(1e-9), abs(line.xy) < vec2f(1e-9));
    let forwards = vec2f(inverse > vec2f(0.0));
    let border = (select(vec2f(0.0), cells, inverse > vec2f(0.0)) - origin.xy) * inverse;
    let s_end = min(min(border.x, border.y), 1.0);
    let visible = p0.z > 0.0 && all(origin.xy >= vec2f(0.0)) && all(origin.xy < cells);
    let nudge = (forwards * 2.0 - 1.0) * NUDGE_PX;
    var s = select(s_end, 0.0, visible);
    var level = start_level;
    var crossed = false;
    var blocked = false;
    for (var i = 0u; i < MAX_COARSE && s < s_end && !blocked; i++) {
        let at = origin + line * s;
        let node = vec2u(clamp(at.xy, vec2f(0.0), cells)) >> vec2u(level);
        let size = f32(1u << level);
        let leave = ((vec2f(node) + forwards) * size + nudge - origin.xy) * inverse;
        let exit = clamp(min(leave.x, leave.y), s, s_end);
        let nearest = nearest_code(textureLoad(nodes, texel_of(first_node + node_index(log2_sides, level, node)), 0).x);
{% if count_fetches %}        fetches += 1u;
{% endif %}
        let free = min(at.z, origin.z + line.z * exit) > nearest;
        let surface = (nearest - origin.z) * safe_reciprocal(line.z);
        let partial = select(s, clamp(surface, s, exit), at.z > nearest && line.z < 0.0);
        blocked = !free && level == 1u;
        s = select(partial, exit, free);
        level = select(max(level, 2u) - 1u, min(level + 1u, start_level), free);
    }
    for (var i = 0u; i < MAX_FINE && blocked && s < s_end; i++) {
        let at = origin + line * s;
        let cell = floor(clamp(at.xy, vec2f(0.0), cells - 0.01));
        let leave = (cell + forwards + nudge - origin.xy) * inverse;
        let exit = clamp(min(leave.x, leave.y), s, s_end);
        let beyond = origin + line * exit;
        let node = vec2u(cell);
        let corners = corners_of(first_cell + node.y * width_px + node.x);
        let hole = {% if holes %}!corners.certain{% else %}min(min(corners.codes.x, corners.codes.y), min(corners.codes.z, corners.codes.w)) < 0.5{% endif %};
        let inside = at.xy - cell;
        let inside_beyond = clamp(beyond.xy - cell, vec2f(0.0), vec2f(1.0));
        let here = HALF_CODE + at.z - surface_code(corners, inside);
        let there = HALF_CODE + beyond.z - surface_code(corners, inside_beyond);
        let through = here > 0.0 && there > 0.0 && !hole;
        crossed = here > 0.0 && there <= 0.0 && !hole;
        let crossing = s + (exit - s) * here / max(here - there, 1e-9);
        s = select(select(s, crossing, crossed), exit, through);
        blocked = through;
    }
    // Back to the ray's own parameter: 1/w is linear in s.
    let share = s * p0.z / ((1.0 - s) * p1.z + s * p0.z);
    return March(select(near, near + (end - near) * share, visible), crossed);
}

{% if march_camera == 0 %}
@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= work.view.size_px) { return; }
    let pixel = pixel_of(id.xy);
    let span = span_in_volume(work.view.eye_in_world, pixel.direction, work.view.near_m);
    let begin = max(span.near, tile_start_m[pixel.tile]);
{% else %}
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= earlier[work.view.number].count { return; }
    let place = earlier_pixels[work.view.first_pixel + id.x] - work.view.first_pixel;
    let pixel = pixel_of(vec2u(place % work.view.size_px.x, place / work.view.size_px.x));
    let span = span_in_volume(work.view.eye_in_world, pixel.direction, work.view.near_m);
    // The pass before left how far it got.
    let begin = out_inverse_depth[pixel.index];
{% endif %}
    let a = homogeneous(work.cameras[{{ march_camera }}].homogeneous_pixel_from_world, vec4f(work.view.eye_in_world, 1.0));
    let b = homogeneous(work.cameras[{{ march_camera }}].homogeneous_pixel_from_world, vec4f(pixel.direction, 0.0));
    let found = march(a, b, begin, max(span.far, begin));
    let point_in_world = work.view.eye_in_world + pixel.direction * found.t;
    let blend = blended(point_in_world, pixel.direction, THICKNESS_FOOTPRINTS);
    let hit = found.crossed && blend.occupied;
    // Proven empty up to where the volume ends. A pixel that is left for later keeps how far it got where
    // its inverse depth will be.
    let empty = begin >= span.far;
    let color = select(work.background_srgb8, srgb8_from_linear(blend.color_linear), hit && !empty);
    let provenance = select(PROVENANCE_HIT | (blend.camera_mask << 8u), PROVENANCE_EMPTY, empty);
    let depth = select(select(found.t, 1.0 / found.t, hit), 0.0, empty);
    write_pixel(pixel.index, color, depth, provenance);
    if !hit && !empty { leave_for_later(pixel.index); }
}
