// Finds how far all rays of a tile run through space that some camera has seen empty, or that none sees at all.
//
// A disc around the tile's middle ray bounds the points of all its rays at one parameter t. The tile moves on while some camera
// shows everything in the footprint of the disc's way to be farther away. It also moves on while all cameras that see a
// part of the way do.
{% include "view_work.wgsl" %}

@group(0) var<storage, read_write> tile_start_m: array<f32>;

// Each ray's point is proven empty by this camera.
const PROVEN: u32 = 1u;
// No point that this camera sees may be occupied; it need not see them all.
const UNOPPOSED: u32 = 2u;

// The flags of a camera for the disc's way from t to t_end.
fn evaluate_camera(camera: SampleCamera, a: vec3f, b: vec3f, t: f32, t_end: f32, slope: f32) -> u32 {
    let p = a + b * t;
    let q = a + b * t_end;
    let radii_m = slope * vec2f(t, t_end);
    let depths_m = vec2f(p.z, q.z);
    let closest_m = depths_m - radii_m;
    let behind = all(depths_m + radii_m <= vec2f(0.0));
    let radii_px = camera.stretch * radii_m / max(closest_m, vec2f(1e-20));
    let from_px = p.xy / p.z - 0.5;
    let to_px = q.xy / q.z - 0.5;
    let low = min(from_px - radii_px.x, to_px - radii_px.y);
    let high = max(from_px + radii_px.x, to_px + radii_px.y);
    let cells = camera.cells;
    let unseen = behind || (all(closest_m > vec2f(0.0)) && (any(high < vec2f(0.0)) || any(low > cells)));
    let whole = all(low >= vec2f(0.0)) && all(high <= cells);
    let first = clamp(low, vec2f(0.0), cells);
    let extent = clamp(high, vec2f(0.0), cells) - first;
    let log2_sides = camera.log2_sides;
    let wanted = u32(max(ceil(log2(max(extent.x, extent.y) + 1e-3)), 1.0));
    let level = min(wanted, top_level(log2_sides));
    // The coarsest nodes of a strip are shorter than it.
    let is_covered = wanted <= level;
    let node = camera.first_node + node_index(log2_sides, level, vec2u(first) >> vec2u(level));
    let nearest = nearest_code(textureLoad(nodes, texel_at(node), 0).y);
    let farthest_codes = camera.code_scale / max(depths_m + radii_m, vec2f(1e-20)) + camera.code_offset;
    let is_before = min(farthest_codes.x, farthest_codes.y) > nearest || nearest < FIRST_SAMPLE;
    let empty = is_covered && all(closest_m > vec2f(0.0)) && is_before;
    return select(select(0u, select(UNOPPOSED, PROVEN | UNOPPOSED, whole), empty), UNOPPOSED, unseen);
}

@compute @workgroup_size(TILE_PX, TILE_PX)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let tiles = (work.view.size_px + TILE_PX - 1u) / TILE_PX;
    let tile = vec2u(id.x, id.y + first_row() / TILE_PX);
    if tile.x >= tiles.x || tile.y * TILE_PX >= end_row() { return; }
    let middle = (vec2f(tile) + 0.5) * f32(TILE_PX);
    let direction = work.view.column_in_world * middle.x + work.view.row_in_world * middle.y + work.view.corner_in_world;
    // Half a tile's diagonal at depth 1, and a little for rounding.
    let slope = (HALF_DIAGONAL * f32(TILE_PX)) / work.view.focal_px;
    // The middle ray may miss the volume where others of the tile enter it: start at the eye's near plane.
    let far = length(max(abs(work.volume_min_in_world - work.view.eye_in_world), abs(work.volume_max_in_world - work.view.eye_in_world)));
{% for k in range(cameras) %}
    let camera{{ k }} = work.cameras[{{ k }}];
    let a{{ k }} = homogeneous(camera{{ k }}.homogeneous_pixel_from_world, vec4f(work.view.eye_in_world, 1.0));
    let b{{ k }} = homogeneous(camera{{ k }}.homogeneous_pixel_from_world, vec4f(direction, 0.0));
{% endfor %}
    var t = entry(tile);
    var stride = GREATEST_TILE_MOVE;
    for (var i = 0u; i < MAX_TILE_MOVES && t < far && stride > LEAST_TILE_MOVE; i++) {
        let t_end = t * stride;
        var any_proof = 0u;
        var all_agree = UNOPPOSED;
{% for k in range(cameras) %}
        let o{{ k }} = evaluate_camera(camera{{ k }}, a{{ k }}, b{{ k }}, t, t_end, slope);
        any_proof |= o{{ k }};
        all_agree &= o{{ k }};
{% endfor %}
        let free = (any_proof & PROVEN) != 0u || all_agree != 0u;
        t = select(t, t_end, free);
        stride = select(0.5 + 0.5 * stride, min(1.0 + (stride - 1.0) * 1.5, GREATEST_TILE_MOVE), free);
    }
    tile_start_m[work.view.first_tile + tile.y * tiles.x + tile.x] = t;
}

// The least parameter at which a corner ray of the tile enters the volume. A corner ray that misses it counts with the
// near plane: rays between the corners may enter.
fn entry(tile: vec2u) -> f32 {
    var least = FAR_AWAY;
    for (var corner = 0u; corner < 4u; corner++) {
        let pixel = vec2f((tile + vec2u(corner & 1u, corner >> 1u)) * TILE_PX);
        let direction = work.view.column_in_world * pixel.x + work.view.row_in_world * pixel.y + work.view.corner_in_world;
        let span = span_in_volume(work.view.eye_in_world, direction, work.view.near_m);
        least = min(least, select(work.view.near_m, span.near, span.near <= span.far));
    }
    return least;
}
