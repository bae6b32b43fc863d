// Merges 2 × 2 quads of one size into one, where no corner of all the samples' own quads in the block lies farther from
// the merged quad than the bound: one thread a block, one dispatch a size.
{% include "cut.wgsl" %}

@group(0) @binding(1) var<storage, read> inverse_depths: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> sides: array<u32>;
// Bits of a number that is not negative: they have its order.
struct Report { greatest_error_px: atomic<u32>, quads_before: atomic<u32> }
@group(0) @binding(3) var<storage, read_write> report: Report;

// Of the two triangles that are drawn, at a place inside the block; linear in the image, as planes are.
fn merged_at(corners: vec4f, at: vec2f) -> f32 {
    let upper = corners.x + (corners.y - corners.x) * at.x + (corners.z - corners.x) * at.y;
    let lower = corners.w + (corners.z - corners.w) * (1.0 - at.x) + (corners.y - corners.w) * (1.0 - at.y);
    return select(lower, upper, at.x + at.y <= 1.0);
}

// How far the merged quad is off a corner, along the corner's ray, as seen from the side at the corner's distance.
fn error_px(corners: vec4f, origin: vec2u, place: vec2u, inverse_depth: f32) -> f32 {
    let merged = merged_at(corners, vec2f(place) / f32(work.side));
    let ray = ray_at(vec2f(origin + place));
    return work.focal_px * length(ray) * abs(merged - inverse_depth) / merged;
}

fn error_of_quad(corners: vec4f, origin: vec2u, place: vec2u) -> f32 {
    let texel = origin + place;
    let quad = inverse_depths[texel.y * work.size_px.x + texel.x];
    return max(
        max(error_px(corners, origin, place, quad.x), error_px(corners, origin, place + vec2u(1u, 0u), quad.y)),
        max(error_px(corners, origin, place + vec2u(0u, 1u), quad.z), error_px(corners, origin, place + 1u, quad.w)),
    );
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let origin = id.xy * work.side;
    if any(origin + work.side > work.size_px) { return; }
    let half = work.side / 2u;
    let width = work.size_px.x;
    let first = origin.y * width + origin.x;
    let children = vec4u(first, first + half, first + half * width, first + half * width + half);
    let found = vec4u(sides[children.x], sides[children.y], sides[children.z], sides[children.w]);
    if any(found != vec4u(half)) { return; }
    let last = work.side - 1u;
    let corners = vec4f(
        inverse_depths[first].x, inverse_depths[first + last].y,
        inverse_depths[first + last * width].z, inverse_depths[first + last * width + last].w,
    );
    var worst = 0.0;
    for (var i = 0u; i < work.side * work.side && worst <= work.bound_px; i++) {
        worst = max(worst, error_of_quad(corners, origin, vec2u(i % work.side, i / work.side)));
    }
    if worst <= work.bound_px {
        sides[children.x] = work.side;
        sides[children.y] = 0u;
        sides[children.z] = 0u;
        sides[children.w] = 0u;
        atomicMax(&report.greatest_error_px, bitcast<u32>(worst));
    }
}
