{% set eye = "ray.origin_in_world" if bounced else "work.view.eye_in_world" -%}
{% set direction = "ray.direction" if bounced else "pixel.direction" -%}
{% set near = "ray.near_m" if bounced else "work.view.near_m" -%}
{% set own = "let ray = rays[index];" if bounced else "let pixel = pixel_of(place_of(index));" -%}
// One ray, a pyramid for each camera, one parameter t. A camera that shows everything in the ray's node to
// be farther away proves the way to the node's edge empty, and t moves there. Where all cameras show
// everything nearer, nothing is known, and t moves on. Else a finer level decides; at the finest the ray
// meets the patches between samples.
{% include "surface.wgsl" %}
{% include "pixel_list.wgsl" %}
{%- if bounced %}
{% include "bounce/ray.wgsl" %}
@group(0) var<storage, read> rays: array<MirroredRay>;
{%- endif %}

// 0 unless the search is to be cut short.
const STOP_LEVEL: u32 = {{ stop_level }}u;
const MOVES_TO_HIT: u32 = {{ "MAX_MOVES" if bounced or holes else "MAX_MOVES_TO_HIT" }};
const FIRST_LEVEL: u32 = max({{ "BOUNCE_LEVEL" if bounced else "START_LEVEL" }}, STOP_LEVEL);

// A camera's knowledge of the ray from t on.
struct Evaluation {
    // The way is free up to here (t where nothing is proven).
    free_until: f32,
    // Where the ray leaves the node; far away for a camera that does not see the point.
    exit: f32,
    // Positive inside the surface; in footprints, so that cameras compare. Far away where not inside
    // or where only the back is met.
    penetration: f32,
    // Finer levels could say more.
    undecided: bool,
    // The share of the texels around the ray on one surface with it, less the share that show what is beyond it.
    vote: f32,
}

const UNSEEN: Evaluation = Evaluation(-1.0, FAR_AWAY, FAR_AWAY, false, 0.0);

// The ray in a camera's image, a + b · t, at a place that the camera sees.
struct ImageRay { a: vec3f, b: vec3f, t: f32, far: f32, uv: vec2f, code: f32 }

// The code at a parameter farther on, whose planar depth is w.
fn code_beyond(camera: SampleCamera, w: f32) -> f32 {
    return select(camera.code_scale / w + camera.code_offset, 1e9, w <= 0.0);
}

// Where the ray leaves a rectangle of the image.
fn exit_of(ray: ImageRay, low: vec2f, high: vec2f) -> f32 {
    let p = ray.a + ray.b * ray.t;
    let turn = ray.b.xy * p.z - ray.b.z * p.xy;
    let edge = select(low - NUDGE_PX, high + NUDGE_PX, turn > vec2f(0.0)) + 0.5;
    let slope = ray.b.xy - edge * ray.b.z;
    let leave = (edge * ray.a.z - ray.a.xy) / select(slope, vec2f(1e-20), abs(slope) < vec2f(1e-20));
    // A ray whose vanishing point lies in the rectangle does not leave it, and neither does one through the camera's own eye,
    // which stays in one place.
    let leaves = (abs(turn) > vec2f(1e-12)) & (slope * turn > vec2f(0.0));
    let exit = min(select(FAR_AWAY, leave.x, leaves.x), select(FAR_AWAY, leave.y, leaves.y));
    return clamp(exit, ray.t, ray.far);
}

fn evaluate_camera(camera: SampleCamera, a: vec3f, b: vec3f, t: f32, far: f32, level: u32) -> Evaluation {
    let p = a + b * t;
    let inverse_w = 1.0 / p.z;
    let uv = p.xy * inverse_w - 0.5;
    if p.z <= 0.0 || any(uv < vec2f(0.0)) || any(uv >= camera.cells) { return UNSEEN; }
    // A small image has fewer levels.
    let pyramid_level = min(level, top_level(camera.log2_sides));
    let node = vec2u(uv) >> vec2u(pyramid_level);
    let low = vec2f(node << vec2u(pyramid_level));
    let high = min(low + f32(1u << pyramid_level), camera.cells);
    let ray = ImageRay(a, b, t, far, uv, camera.code_scale * inverse_w + camera.code_offset);
    let exit = exit_of(ray, low, high);
    if level > 0u { return evaluate_node(camera, ray, exit, node, pyramid_level, level == STOP_LEVEL); }
    return evaluate_cell(camera, ray, exit, node, low);
}

// By the range of depths in a node of level 1 or coarser.
fn evaluate_node(camera: SampleCamera, ray: ImageRay, exit: f32, node: vec2u, level: u32, stops: bool) -> Evaluation {
    let exit_code = code_beyond(camera, ray.a.z + ray.b.z * exit);
    let index = camera.first_node + node_index(camera.log2_sides, level, node);
    let range = textureLoad(nodes, texel_at(index), 0).x;
    let nearest = nearest_code(range);
    let farthest = f32(range >> 16u);
    if min(ray.code, exit_code) > nearest || nearest < FIRST_SAMPLE { return Evaluation(exit, exit, FAR_AWAY, false, 0.0); }
    // Free up to the depth of the nearest thing in the node.
    let surface_t = (camera.code_scale / (nearest - camera.code_offset) - ray.a.z) * safe_reciprocal(ray.b.z);
    let partial = select(ray.t, clamp(surface_t, ray.t, exit), ray.code > nearest && nearest > 1.0);
    let slack = THICKNESS_FOOTPRINTS * (max(ray.code, exit_code) - camera.code_offset) / camera.focal_px;
    let behind = max(ray.code, exit_code) + slack < farthest && farthest > FIRST_SAMPLE;
    // A search that stops here takes the nearest thing in the node for the surface.
    let penetration = select(FAR_AWAY, 0.0, stops && !behind);
    return Evaluation(partial, exit, penetration, !behind, 1.0);
}

// The part of a cell that the ray is in: where the ray leaves it, and the codes of its corners.
struct CellPart { exit: f32, codes: vec4f, proves_nothing: bool }

fn part_of_cell(camera: SampleCamera, ray: ImageRay, exit: f32, corners: Corners, low: vec2f) -> CellPart {
{% if holes %}
    // Between unconnected samples of which some are uncertain each stands for its own quarter of the cell.
    let patches = !corners.certain && !corners.connected;
    let quarter = floor((ray.uv - low) * 2.0);
    let right = quarter.x > 0.5;
    let lower = quarter.y > 0.5;
    let own_code = select(select(corners.codes.x, corners.codes.y, right), select(corners.codes.z, corners.codes.w, right), lower);
    let codes = select(corners.codes, vec4f(own_code), patches);
    let quarter_exit = exit_of(ray, low + 0.5 * quarter, min(low + 0.5 * quarter + 0.5, camera.cells));
    return CellPart(select(exit, quarter_exit, patches), codes, own_code < 0.5 && patches);
{% else %}
    let lowest = min(min(corners.codes.x, corners.codes.y), min(corners.codes.z, corners.codes.w));
    return CellPart(exit, corners.codes, lowest < 0.5);
{% endif %}
}

// By the patch or the four samples of one cell.
fn evaluate_cell(camera: SampleCamera, ray: ImageRay, cell_exit: f32, cell: vec2u, low: vec2f) -> Evaluation {
    let corners = corners_of(camera.first_cell + cell.y * camera.width_px + cell.x);
    let part = part_of_cell(camera, ray, cell_exit, corners, low);
    let exit = part.exit;
    if part.proves_nothing { return Evaluation(ray.t, exit, FAR_AWAY, false, 0.0); }
    let exit_w = ray.a.z + ray.b.z * exit;
    let at = ray.uv - low;
    let exit_at = clamp((ray.a.xy + ray.b.xy * exit) / exit_w - 0.5 - low, vec2f(0.0), vec2f(1.0));
    // A connected cell is its bilinear surface; else each sample is a surface of its own.
    // Before the background all is free, however far beyond the samples of its image.
    let own = select(part.codes, vec4f(-FAR_AWAY), part.codes < vec4f(FIRST_SAMPLE));
    let samples = select(own, vec4f(bilinear(corners.codes, at)), corners.connected);
    let samples_at_exit = select(own, vec4f(bilinear(corners.codes, exit_at)), corners.connected);
    let gaps = vec4f(HALF_CODE + ray.code) - samples;
    let gaps_at_exit = vec4f(HALF_CODE + code_beyond(camera, exit_w)) - samples_at_exit;
    let ahead = gaps > vec4f(0.0);
    // The nearest of the surfaces still ahead is met first.
    let next_gap = least_of(gaps, ahead);
    let next_gap_at_exit = next_gap + least_of(gaps_at_exit - gaps, ahead);
    let meets = any(ahead) && next_gap_at_exit <= 0.0;
    // Codes are linear in the image, not in t: a ray away from the camera stays in a cell for long.
    let share = clamp(next_gap / max(next_gap - next_gap_at_exit, 1e-9), 0.0, 1.0);
    let weights = vec2f((1.0 - share) / (ray.a.z + ray.b.z * ray.t), share / max(exit_w, 1e-20));
    let crossing = select(exit, dot(weights, vec2f(ray.t, exit)) / (weights.x + weights.y), meets);
{% if holes %}
    // Nothing is proven up to the sample, but the ray may meet it.
    if all(ahead) && !corners.certain { return Evaluation(ray.t, crossing, FAR_AWAY, false, 0.0); }
{% endif %}
    if all(ahead) {
        let past = select(exit, crossing + (exit - ray.t) * 1e-6, meets);
        return Evaluation(crossing, past, select(FAR_AWAY, 0.0, meets), false, 0.0);
    }
    let footprint = (ray.code - camera.code_offset) / camera.focal_px;
    // Inside and on the way out of a connected cell: the back of the surface, which no camera saw.
    let leaving = corners.connected && gaps_at_exit.x > gaps.x;
    let shallowest = least_of(-gaps, !ahead);
    let penetration = select(shallowest / footprint, FAR_AWAY, leaving);
    return Evaluation(ray.t, crossing, penetration, false, vote_of_cell(corners, part.codes, gaps, footprint, at));
}

fn least_of(values: vec4f, counted: vec4<bool>) -> f32 {
    let v = select(vec4f(FAR_AWAY), values, counted);
    return min(min(v.x, v.y), min(v.z, v.w));
}

// The share of a cell's texels that lie on one surface with the ray, less the share that show what is beyond it.
fn vote_of_cell(corners: Corners, codes: vec4f, gaps: vec4f, footprint: f32, at: vec2f) -> f32 {
    let share = bilinear_shares(at);
    let reach = vec4f(THICKNESS_FOOTPRINTS * footprint);
    let same = dot(share, select(vec4f(0.0), vec4f(1.0), (abs(gaps) < reach) & (codes > vec4f(FIRST_SAMPLE))));
    let beyond = {% if holes %}select(0.0, 1.0, corners.certain) * {% endif %}dot(share, select(vec4f(0.0), vec4f(1.0), gaps > reach));
    return same - beyond;
}

@compute @workgroup_size(LIST_WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= lists[work.view.number].count { return; }
    let index = listed_pixels[first_listed() + id.x];
    {{ own }}
    let span = span_in_volume({{ eye }}, {{ direction }}, {{ near }});
{% for k in range(cameras) %}
    // Loaded once: to the software device a word of a uniform is a load for each thread.
    let camera{{ k }} = work.cameras[{{ k }}];
    let a{{ k }} = homogeneous(camera{{ k }}.homogeneous_pixel_from_world, vec4f({{ eye }}, 1.0));
    let b{{ k }} = homogeneous(camera{{ k }}.homogeneous_pixel_from_world, vec4f({{ direction }}, 0.0));
{% endfor %}
    // The pass before left how far it got.
    var t = out_inverse_depth[index];
{%- if bounced %}
    // A ray that begins on a surface which its images show does not meet it: the way must have been free.
    var freed = t > span.near;
{%- endif %}
    var level = FIRST_LEVEL;
    var hit = false;
    var known = true;
    for (var i = 0u; i < MAX_MOVES && t < span.far && (known || i < MOVES_TO_HIT); i++) {
        var free_until = t;
        var exit = FAR_AWAY;
        var penetration = FAR_AWAY;
        var undecided = false;
        var free = false;
        var vote = 0.0;
{% for k in range(cameras) %}
        let v{{ k }} = evaluate_camera(camera{{ k }}, a{{ k }}, b{{ k }}, t, span.far, level);
        free = free || (v{{ k }}.free_until == v{{ k }}.exit && v{{ k }}.free_until > t);
        // A crossing farther on than the others' outweighs them: they are inside there.
        penetration = select(min(penetration, v{{ k }}.penetration), v{{ k }}.penetration, v{{ k }}.free_until > free_until);
        free_until = max(free_until, v{{ k }}.free_until);
        exit = min(exit, v{{ k }}.exit);
        undecided = undecided || v{{ k }}.undecided;
        vote += v{{ k }}.vote;
{% endfor %}{{ "\n        freed = freed || free_until > t;" if bounced }}
        let descend = !free && level > STOP_LEVEL && undecided;
        let candidate = !free && !descend && penetration < THICKNESS_FOOTPRINTS && i < MOVES_TO_HIT;
        // First go to the very place, then let the cameras vote there.
        let arrived = free_until <= t || STOP_LEVEL > 0u;
        hit = candidate && arrived && vote >= 0.0{{ " && freed" if bounced }};
        let rejected = candidate && arrived && !hit;
        let unknown = !free && !descend && !candidate;
        known = known && !unknown;
        let beyond = max(select(exit, t + (span.far - span.near) * BLIND_MOVE, exit >= FAR_AWAY), t * LEAST_MOVE);
        t = select(free_until, beyond, unknown || rejected);
        level = select(min(level + 1u, FIRST_LEVEL), level - 1u, descend);
        level = select(level, STOP_LEVEL, candidate);
        if hit { break; }
    }
    // As all cameras together show the point found. Empty where the whole way is proven free.
    let blend = blend_two_best({{ eye }} + {{ direction }} * t, {{ direction }});
    let empty = !hit && known && t >= span.far;
    write_found(index, hit && blend.origin != 0u, t, blend.color_linear, blend.origin, empty);
}
