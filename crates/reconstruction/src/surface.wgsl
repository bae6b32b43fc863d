// The surface that one camera's samples describe around a position, and what it says of a point there.

@group(0) @binding(2) var<storage, read> tile_start_m: array<f32>;
@group(0) @binding(3) var<storage, read> colors_rgb9e5: array<u32>;
@group(0) @binding(4) var<storage, read_write> out_srgb8: array<u32>;
@group(0) @binding(5) var<storage, read_write> out_inverse_depth: array<f32>;
@group(0) @binding(6) var<storage, read_write> out_provenance: array<u32>;
// Pixels that a later pass takes up: for each view its pixels' places, and indirect dispatch arguments.
@group(0) @binding(7) var<storage, read_write> later_pixels: array<u32>;
struct Later { workgroups: atomic<u32>, y: u32, z: u32, count: atomic<u32> }
@group(0) @binding(8) var<storage, read_write> later: array<Later>;
{% if count_fetches %}
@group(0) @binding(9) var<storage, read_write> out_fetches: array<u32>;
var<private> fetches: u32 = 0u;
{% endif %}

const LIST_WORKGROUP: u32 = 64u;

// Leaves a pixel to the next pass.
fn leave_for_later(index: u32) {
    let place = atomicAdd(&later[work.view.number].count, 1u);
    later_pixels[work.view.first_pixel + place] = index;
    if place % LIST_WORKGROUP == 0u { atomicAdd(&later[work.view.number].workgroups, 1u); }
}

const PROVENANCE_EMPTY: u32 = 0u;
const PROVENANCE_HIT: u32 = 1u;
const PROVENANCE_FILLED: u32 = 2u;

// Corners of a cell farther apart than this many footprints are not one surface.
const CONNECTED_FOOTPRINTS: f32 = {{ connected_footprints }};

// Depth is known to half a code; a ray that reached a plane's very depth is still before it.
const HALF_CODE: f32 = 0.5;

// The codes of a cell's corners: upper left, upper right, lower left, lower right.
fn corner_codes(word_index: u32, row_words: u32) -> vec4u {
{% if count_fetches %}    fetches += 2u;
{% endif %}
    let upper = pyramids[word_index];
    let lower = pyramids[word_index + row_words];
    return vec4u(upper & 0xffffu, upper >> 16u, lower & 0xffffu, lower >> 16u);
}

fn bilinear(corners: vec4f, at: vec2f) -> f32 {
    let upper = corners.x + (corners.y - corners.x) * at.x;
    let lower = corners.z + (corners.w - corners.z) * at.x;
    return upper + (lower - upper) * at.y;
}

fn nearest_corner(corners: vec4f, at: vec2f) -> f32 {
    let upper = select(corners.x, corners.y, at.x > 0.5);
    let lower = select(corners.z, corners.w, at.x > 0.5);
    return select(upper, lower, at.y > 0.5);
}

struct Pixel { index: u32, tile: u32, direction: vec3f }

fn pixel_of(id: vec2u) -> Pixel {
    let tiles_across = (work.view.size_px.x + TILE_PX - 1u) / TILE_PX;
    let center = vec2f(id) + 0.5;
    let direction = work.view.column_in_world * center.x + work.view.row_in_world * center.y + work.view.corner_in_world;
    let index = work.view.first_pixel + id.y * work.view.size_px.x + id.x;
    let tile = work.view.first_tile + (id.y / TILE_PX) * tiles_across + id.x / TILE_PX;
    return Pixel(index, tile, direction);
}

fn write_pixel(index: u32, color_srgb8: u32, inverse_depth_per_m: f32, provenance: u32) {
    out_srgb8[index] = color_srgb8;
    out_inverse_depth[index] = inverse_depth_per_m;
    out_provenance[index] = provenance;
{% if count_fetches %}    out_fetches[index] += fetches;
{% endif %}
}

fn color_texel(index: u32) -> vec3f {
{% if count_fetches %}    fetches += 1u;
{% endif %}
    return linear_from_rgb9e5(colors_rgb9e5[index]);
}

// What a camera makes of a point: how much it counts, its colour, and whether it sees past the point.
struct Sight { weight: f32, color_linear: vec3f, sees_past: bool }

{% for k in range(cameras) %}
fn sight_{{ k }}(p: vec3f, point_in_world: vec3f, view_direction: vec3f, slack: f32) -> Sight {
    let cells = work.cameras[{{ k }}].cells;
    let inverse_w = 1.0 / p.z;
    let uv = p.xy * inverse_w - 0.5;
    let inside = p.z > 0.0 && all(uv >= vec2f(0.0)) && all(uv < cells);
    let clamped = clamp(uv, vec2f(0.0), cells - 0.01);
    let cell = vec2u(clamped);
    let at = clamped - floor(clamped);
    let row_words = 1u << work.cameras[{{ k }}].log2_sides.x;
    let corners = vec4f(corner_codes(work.cameras[{{ k }}].first_word + cell.y * row_words + cell.x, row_words));
    let code_above = work.cameras[{{ k }}].code_scale * inverse_w;
    let code = code_above + work.cameras[{{ k }}].code_offset;
    let reach = slack * code_above / work.cameras[{{ k }}].focal_px;
    let gaps = code - corners;
    // Of the four texels around, those on the point's own surface.
    let share = vec4f((1.0 - at.x) * (1.0 - at.y), at.x * (1.0 - at.y), (1.0 - at.x) * at.y, at.x * at.y);
    let same = select(vec4f(0.0), share, (abs(gaps) < vec4f(reach)) & (corners > vec4f(1.5)));
    let total = dot(same, vec4f(1.0));
    let width = work.cameras[{{ k }}].width_px;
    let texel = work.cameras[{{ k }}].first_texel + cell.y * width + cell.x;
    let color = same.x * color_texel(texel) + same.y * color_texel(texel + 1u)
        + same.z * color_texel(texel + width) + same.w * color_texel(texel + width + 1u);
    // Angle between the two lines of sight, footprint and distance to the border.
    let sight = point_in_world - work.cameras[{{ k }}].eye_in_world;
    let inverse_distance = inverseSqrt(dot(sight, sight));
    let off = sight * inverse_distance - view_direction;
    let border = min(min(min(uv.x, cells.x - uv.x), min(uv.y, cells.y - uv.y)) * 0.125, 1.0) + 1e-3;
    let footprint = work.cameras[{{ k }}].focal_px * inverse_distance;
    let weight = border * footprint * footprint / (dot(off, off) + {{ angle_floor }});
    let seen = inside && total > 0.05;
    // Only the same share of each colour was added: the weight carries the rest of the division.
    let past = inside && all(gaps > vec4f(reach)) && all(corners > vec4f(0.5));
    return Sight(select(0.0, weight, seen), color / max(total, 0.05), past);
}
{% endfor %}

struct Blend { color_linear: vec3f, camera_mask: u32, seen_past: bool }

// The mean of all cameras that see the point, whatever their order.
fn blended(point_in_world: vec3f, direction: vec3f, slack: f32) -> Blend {
    let view_direction = normalize(direction);
    let point = vec4f(point_in_world, 1.0);
    var sum = vec3f(0.0);
    var weights = 0.0;
    var mask = 0u;
    var past = false;
{% for k in range(cameras) %}
    let p{{ k }} = homogeneous(work.cameras[{{ k }}].homogeneous_pixel_from_world, point);
    let sight{{ k }} = sight_{{ k }}(p{{ k }}, point_in_world, view_direction, slack);
    sum += sight{{ k }}.color_linear * sight{{ k }}.weight;
    weights += sight{{ k }}.weight;
    mask |= select(0u, work.cameras[{{ k }}].mask, sight{{ k }}.weight > 0.0);
    past = past || sight{{ k }}.sees_past;
{% endfor %}
    return Blend(sum / max(weights, 1e-30), mask, past);
}

fn srgb8_from_linear(linear: vec3f) -> u32 {
    return pack4x8unorm(vec4f(srgb_from_linear(linear), 1.0));
}
