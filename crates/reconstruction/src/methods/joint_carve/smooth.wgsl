// The light of all positions within the pixels around which the first position found one smooth surface, or only background.
// No ray is followed there: the surface goes on between neighbours, and the same cameras show it. The sums of other pixels
// begin with the first position; they are left to the marches of each further one.
{% include "surface.wgsl" %}
{% if environment_map %}
{% include "environment.wgsl" %}
{% endif %}
{% include "background.wgsl" %}

@group(0) var<storage, read> tile_start_m: array<f32>;
// Linear light, over the positions so far.
@group(0) var<storage, read_write> sums: array<f32>;

// The first position's surface at a pixel: inverse depths, and how the depth changes from column to column and row to row.
struct Smooth { inverse_depth: f32, slope: vec2f, is_surface: bool, is_background: bool }

fn is_whole_hit(origin: u32) -> bool { return (origin & 0xffu) == PROVENANCE_HIT && (origin >> SPLIT_SHIFT) != 0u; }

fn smooth_at(pixel: Pixel, place: vec2u, origin: u32) -> Smooth {
    let index = pixel.index;
    let is_inner = all(place > vec2u(0u)) && all(place + 1u < work.view.size_px);
    let across = select(0u, 1u, is_inner);
    let down = select(0u, work.view.size_px.x, is_inner);
    let center = out_inverse_depth[index];
    let before = vec2f(out_inverse_depth[index - across], out_inverse_depth[index - down]);
    let after = vec2f(out_inverse_depth[index + across], out_inverse_depth[index + down]);
    // Inverse depth is linear on the image of a plane. Depth is known to a code.
    let tolerance = max(SMOOTH_FOOTPRINTS * center / work.view.focal_px, 1.0 / abs(work.cameras[0].code_scale));
    let is_flat = all(abs(before + after - 2.0 * center) <= vec2f(tolerance));
    // Between two pixels that cameras show whole, the same cameras show the surface, too.
    let is_whole = is_whole_hit(origin) && is_whole_hit(out_provenance[index - across]) && is_whole_hit(out_provenance[index + across])
        && is_whole_hit(out_provenance[index - down]) && is_whole_hit(out_provenance[index + down]);
    // Something thin may stand between the pixel's positions where its tile is not proven empty nearly up to the surface.
    let start_m = tile_start_m[pixel.tile];
    let is_open = center * start_m >= OPEN_SHARE;
    let is_clear = start_m >= span_in_volume(work.view.eye_in_world, pixel.direction, work.view.near_m).far;
    let is_empty = (origin & 0xffu) == PROVENANCE_EMPTY && all(before <= vec2f(0.0)) && all(after <= vec2f(0.0));
    return Smooth(center, 0.5 * (after - before), is_inner && is_whole && is_flat && is_open, is_inner && is_empty && is_clear);
}

// The cameras of a hit, by their places among the view's, and the share of the first.
struct Sources { first: u32, second: u32, share: f32 }

fn sources_of(origin: u32) -> Sources {
    let mask = (origin >> 8u) & 0xffffu;
    let lowest = mask & (~mask + 1u);
    var sources = Sources(0u, 0u, f32((origin >> SPLIT_SHIFT) - 1u) / 254.0);
{% for k in range(cameras) %}
    sources.first = select(sources.first, {{ k }}u, work.cameras[{{ k }}].mask == lowest);
    sources.second = select(sources.second, {{ k }}u, (work.cameras[{{ k }}].mask & mask & ~lowest) != 0u);
{% endfor %}
    if mask == lowest { sources.second = sources.first; }
    return sources;
}

fn color_in(camera: u32, point_in_world: vec3f) -> vec3f {
    let p = homogeneous(work.cameras[camera].homogeneous_pixel_from_world, vec4f(point_in_world, 1.0));
    let uv = clamp(p.xy / p.z - 0.5, vec2f(0.0), work.cameras[camera].cells - CELL_MARGIN_PX);
    let cell = vec2u(uv);
    let cell_index = work.cameras[camera].first_cell + cell.y * work.cameras[camera].width_px + cell.x;
    return mixed_color(cell_index, bilinear_shares(uv - floor(uv)));
}

fn direction_at(pixel: Pixel, offset_px: vec2f) -> vec3f {
    return pixel.direction + work.view.column_in_world * offset_px.x + work.view.row_in_world * offset_px.y;
}

// The surface's colour at a place that is `offset_px` from the first position.
fn surface_linear(pixel: Pixel, found: Smooth, sources: Sources, offset_px: vec2f) -> vec3f {
    let inverse_depth = max(found.inverse_depth + dot(found.slope, offset_px), 0.1 * found.inverse_depth);
    let point_in_world = work.view.eye_in_world + direction_at(pixel, offset_px) / inverse_depth;
    return mix(color_in(sources.second, point_in_world), color_in(sources.first, point_in_world), sources.share);
}

@compute @workgroup_size(TILE_PX, TILE_PX)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let place = pixel_at(id);
    if any(place >= work.view.size_px) { return; }
    let pixel = pixel_of(place);
    let origin = out_provenance[pixel.index];
    let found = smooth_at(pixel, place, origin);
    var is_shared = found.is_surface;
    var sum = linear_from_rgb9e5(out_color[pixel.index]);
    // Loops, not branches: the software device skips only loops that no lane needs.
    for (var open = found.inverse_depth <= 0.0; open; open = false) { sum = background_linear(pixel.direction); }
    for (var open = found.is_surface; open; open = false) {
        let sources = sources_of(origin);
{% if highlights %}
        // A highlight may be smaller than a pixel: a bright one is found at each position.
        let added = sum - surface_linear(pixel, found, sources, vec2f(0.0));
        is_shared = all(abs(added) <= vec3f(FAINT_HIGHLIGHT));
        for (var faint = is_shared; faint; faint = false) {
            sum += added * {{ offsets | length }}.0;
{% for offset in offsets %}
            sum += surface_linear(pixel, found, sources, vec2f({{ offset[0] }}, {{ offset[1] }}));
{% endfor %}
        }
{% else %}
{% for offset in offsets %}
        sum += surface_linear(pixel, found, sources, vec2f({{ offset[0] }}, {{ offset[1] }}));
{% endfor %}
{% endif %}
    }
    for (var open = found.is_background; open; open = false) {
{% for offset in offsets %}
        sum += background_linear(direction_at(pixel, vec2f({{ offset[0] }}, {{ offset[1] }})));
{% endfor %}
    }
{% for channel in ["r", "g", "b"] %}
    sums[3u * pixel.index + {{ loop.index0 }}u] = sum.{{ channel }};
{% endfor %}
    if !is_shared && !found.is_background { leave_undecided(pixel.index); }
}
