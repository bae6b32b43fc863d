// One ray, a pyramid for each camera, one parameter t. A camera that shows everything in the ray's node to
// be farther away proves the way to the node's edge empty, and t moves there. Where all cameras show
// everything nearer, nothing is known, and t moves on. Else a finer level decides; at the finest the ray
// meets the patches between samples.
{% include "color.wgsl" %}
{% include "sample_set.wgsl" %}
{% include "cell.wgsl" %}
{% include "surface.wgsl" %}

// A ray that is not done by then wanders behind what every camera sees, and whatever it still met would
// more likely be wrong than right (docs/methods/joint_carve.md): it stays unknown.
{% if holes %}
// Texels that prove nothing are crossed one by one.
const MAX_MOVES: u32 = {{ holes_moves }}u;
{% else %}
const MAX_MOVES: u32 = 24u;
{% endif %}
const START_LEVEL: u32 = {{ start_level }}u;
// 0 unless the search is to be cut short.
const STOP_LEVEL: u32 = {{ stop_level }}u;
const THICKNESS_FOOTPRINTS: f32 = {{ thickness_footprints }};
// Past a node's edge, in pixels.
const NUDGE_PX: f32 = 1e-3;

// What a camera knows of the ray from t on.
struct Verdict {
    // The way is free up to here (t where nothing is proven).
    free_until: f32,
    // Where the ray leaves the node; far away for a camera that does not see the point.
    exit: f32,
    // Positive inside the surface; in footprints, so that cameras compare. Far away where not inside
    // or where only the back is met.
    penetration: f32,
    // Finer levels could say more.
    undecided: bool,
    // At the finest level: the share of the texels around the ray that lie on one surface with it, less the
    // share that show what is beyond it.
    vote: f32,
}

const UNSEEN: Verdict = Verdict(-1.0, FAR_AWAY, FAR_AWAY, false, 0.0);

fn exit_of(a: vec3f, b: vec3f, p: vec3f, low: vec2f, high: vec2f) -> f32 {
    let turn = b.xy * p.z - b.z * p.xy;
    let edge = select(low - NUDGE_PX, high + NUDGE_PX, turn > vec2f(0.0)) + 0.5;
    let slope = b.xy - edge * b.z;
    let leave = (edge * a.z - a.xy) / select(slope, vec2f(1e-20), abs(slope) < vec2f(1e-20));
    return min(select(FAR_AWAY, leave.x, abs(turn.x) > 1e-12), select(FAR_AWAY, leave.y, abs(turn.y) > 1e-12));
}

fn verdict(camera: SampleCamera, a: vec3f, b: vec3f, t: f32, far: f32, level: u32) -> Verdict {
    let p = a + b * t;
    let inverse_w = 1.0 / p.z;
    let uv = p.xy * inverse_w - 0.5;
    let cells = camera.cells;
    if p.z <= 0.0 || any(uv < vec2f(0.0)) || any(uv >= cells) { return UNSEEN; }
    let log2_sides = camera.log2_sides;
    // A small image has fewer levels.
    let pyramid_level = min(level, top_level(log2_sides));
    let node = vec2u(uv) >> vec2u(pyramid_level);
    let low = vec2f(node << vec2u(pyramid_level));
    let high = min(low + f32(1u << pyramid_level), cells);
    // A ray through the camera's own eye stays in one place and leaves no node.
    var exit = clamp(exit_of(a, b, p, low, high), t, far);
    let scale = camera.code_scale;
    let offset = camera.code_offset;
    let code = scale * inverse_w + offset;
    let exit_w = a.z + b.z * exit;
    let exit_code = select(scale / exit_w + offset, 1e9, exit_w <= 0.0);
    if level > 0u {
{% if count_fetches %}        fetches += 1u;
{% endif %}
        let index = camera.first_node + node_index(log2_sides, pyramid_level, node);
        let range = textureLoad(nodes, texel_of(index), 0).x;
        let nearest = nearest_code(range);
        let farthest = f32(range >> 16u);
        if min(code, exit_code) > nearest { return Verdict(exit, exit, FAR_AWAY, false, 0.0); }
        // Free up to the depth of the nearest thing in the node.
        let surface_t = (scale / (nearest - offset) - a.z) * safe_reciprocal(b.z);
        let partial = select(t, clamp(surface_t, t, exit), code > nearest && nearest > 1.0);
        let slack = THICKNESS_FOOTPRINTS * (max(code, exit_code) - offset) / camera.focal_px;
        let behind = max(code, exit_code) + slack < farthest;
        // A search that stops here takes the nearest thing in the node for the surface.
        let penetration = select(FAR_AWAY, 0.0, level == STOP_LEVEL && !behind);
        return Verdict(partial, exit, penetration, !behind, 1.0);
    }
    let corners = corners_of(camera.first_cell + node.y * camera.width_px + node.x);
{% if holes %}
    // Between unconnected samples of which some are uncertain each stands for its own quarter of the cell.
    let patches = !corners.certain && !corners.connected;
    let quarter = floor((uv - low) * 2.0);
    let right = quarter.x > 0.5;
    let lower = quarter.y > 0.5;
    let own_code = select(select(corners.codes.x, corners.codes.y, right), select(corners.codes.z, corners.codes.w, right), lower);
    let codes = select(corners.codes, vec4f(own_code), patches);
    let quarter_exit = exit_of(a, b, p, low + 0.5 * quarter, min(low + 0.5 * quarter + 0.5, cells));
    exit = select(exit, clamp(quarter_exit, t, far), patches);
    let w_at_exit = a.z + b.z * exit;
    let code_at_exit = select(scale / w_at_exit + offset, 1e9, w_at_exit <= 0.0);
    if own_code < 0.5 && patches { return Verdict(t, exit, FAR_AWAY, false, 0.0); }
{% else %}
    let codes = corners.codes;
    let w_at_exit = exit_w;
    let code_at_exit = exit_code;
    let lowest = min(min(corners.codes.x, corners.codes.y), min(corners.codes.z, corners.codes.w));
    if lowest < 0.5 { return Verdict(t, exit, FAR_AWAY, false, 0.0); }
{% endif %}
    let footprint = (code - offset) / camera.focal_px;
    let at = uv - low;
    let exit_at = clamp((a.xy + b.xy * exit) / w_at_exit - 0.5 - low, vec2f(0.0), vec2f(1.0));
    // A connected cell is its bilinear surface; else each sample is a surface of its own.
    let samples = select(codes, vec4f(bilinear(corners.codes, at)), corners.connected);
    let samples_at_exit = select(codes, vec4f(bilinear(corners.codes, exit_at)), corners.connected);
    let gaps = vec4f(HALF_CODE + code) - samples;
    let gaps_at_exit = vec4f(HALF_CODE + code_at_exit) - samples_at_exit;
    let ahead = gaps > vec4f(0.0);
    // Of the surfaces still ahead the nearest is met first.
    let next_gap = min(min(select(FAR_AWAY, gaps.x, ahead.x), select(FAR_AWAY, gaps.y, ahead.y)), min(select(FAR_AWAY, gaps.z, ahead.z), select(FAR_AWAY, gaps.w, ahead.w)));
    let next_gap_at_exit = next_gap + min(min(select(FAR_AWAY, gaps_at_exit.x - gaps.x, ahead.x), select(FAR_AWAY, gaps_at_exit.y - gaps.y, ahead.y)), min(select(FAR_AWAY, gaps_at_exit.z - gaps.z, ahead.z), select(FAR_AWAY, gaps_at_exit.w - gaps.w, ahead.w)));
    let meets = any(ahead) && next_gap_at_exit <= 0.0;
    let crossing = select(exit, t + (exit - t) * next_gap / max(next_gap - next_gap_at_exit, 1e-9), meets);
{% if holes %}
    // Nothing is proven up to the sample, but the ray may meet it.
    if all(ahead) && !corners.certain { return Verdict(t, crossing, FAR_AWAY, false, 0.0); }
{% endif %}
    if all(ahead) { return Verdict(crossing, select(exit, crossing + (exit - t) * 1e-6, meets), select(FAR_AWAY, 0.0, meets), false, 0.0); }
    let share = bilinear_shares(at);
    let reach = vec4f(THICKNESS_FOOTPRINTS * footprint);
    let same = dot(share, select(vec4f(0.0), vec4f(1.0), (abs(gaps) < reach) & (codes > vec4f(1.5))));
    let beyond = {% if holes %}select(0.0, 1.0, corners.certain) * {% endif %}dot(share, select(vec4f(0.0), vec4f(1.0), gaps > reach));
    // Inside and on the way out of a connected cell: the back of the surface, which no camera saw.
    let leaving = corners.connected && gaps_at_exit.x > gaps.x;
    let depths = select(-gaps, vec4f(FAR_AWAY), ahead);
    let shallowest = min(min(depths.x, depths.y), min(depths.z, depths.w));
    return Verdict(t, crossing, select(shallowest / footprint, FAR_AWAY, leaving), false, same - beyond);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= earlier[work.view.number].count { return; }
    let index = earlier_pixels[work.view.first_pixel + id.x];
    let place = index - work.view.first_pixel;
    let pixel = pixel_of(vec2u(place % work.view.size_px.x, place / work.view.size_px.x));
    let span = span_in_volume(work.view.eye_in_world, pixel.direction, work.view.near_m);
{% for k in range(cameras) %}
    // Loaded once: to the software device a word of a uniform is a load for each thread.
    let camera{{ k }} = work.cameras[{{ k }}];
    let a{{ k }} = homogeneous(camera{{ k }}.homogeneous_pixel_from_world, vec4f(work.view.eye_in_world, 1.0));
    let b{{ k }} = homogeneous(camera{{ k }}.homogeneous_pixel_from_world, vec4f(pixel.direction, 0.0));
{% endfor %}
    // The pass before left how far it got.
    var t = out_inverse_depth[index];
    var level = START_LEVEL;
    var hit = false;
    var known = true;
    for (var i = 0u; i < MAX_MOVES && t < span.far; i++) {
        var free_until = t;
        var exit = FAR_AWAY;
        var penetration = FAR_AWAY;
        var undecided = false;
        var free = false;
        var vote = 0.0;
{% for k in range(cameras) %}
        let v{{ k }} = verdict(camera{{ k }}, a{{ k }}, b{{ k }}, t, span.far, level);
        free = free || (v{{ k }}.free_until == v{{ k }}.exit && v{{ k }}.free_until > t);
        // A crossing farther on than the others' outweighs them: they are inside there.
        penetration = select(min(penetration, v{{ k }}.penetration), v{{ k }}.penetration, v{{ k }}.free_until > free_until);
        free_until = max(free_until, v{{ k }}.free_until);
        exit = min(exit, v{{ k }}.exit);
        undecided = undecided || v{{ k }}.undecided;
        vote += v{{ k }}.vote;
{% endfor %}
        let descend = !free && level > STOP_LEVEL && undecided;
        let candidate = !free && !descend && penetration < THICKNESS_FOOTPRINTS;
        // First go to the very place, then let the cameras vote there.
        let arrived = free_until <= t || STOP_LEVEL > 0u;
        hit = candidate && arrived && vote >= 0.0;
        let rejected = candidate && arrived && !hit;
        let unknown = !free && !descend && !candidate;
        known = known && !unknown;
        let beyond = max(select(exit, t + (span.far - span.near) * 0.01, exit >= FAR_AWAY), t * 1.00001);
        t = select(free_until, beyond, unknown || rejected);
        level = select(min(level + 1u, START_LEVEL), level - 1u, descend);
        level = select(level, STOP_LEVEL, candidate);
        if hit { break; }
    }
    let point_in_world = work.view.eye_in_world + pixel.direction * t;
    let blend = blended(point_in_world, pixel.direction, THICKNESS_FOOTPRINTS);
    let empty = !hit && known && t >= span.far;
    let found = hit && blend.camera_mask != 0u;
    let provenance = select(select(PROVENANCE_FILLED, PROVENANCE_EMPTY, empty), PROVENANCE_HIT | (blend.camera_mask << 8u), found);
    let color = select(work.background_srgb8, srgb8_from_linear(blend.color_linear), found);
    write_pixel(index, color, select(0.0, 1.0 / t, found), provenance);
    if provenance == PROVENANCE_FILLED { leave_for_later(index); }
}
