// Merges quads of one extent that follow one another along a line: rows into runs, then columns of equal runs into
// rectangles. No corner of all the samples' own quads lies farther from the merged quad than the bound. One thread a
// segment of a line, one dispatch an axis.
{% include "cut.wgsl" %}

@group(0) var<storage, read> inverse_depths: array<vec4f>;
@group(0) var<storage, read_write> extents: array<u32>;
// Bits of a number that is not negative: they have its order.
struct Report { greatest_error_px: atomic<u32>, quads_before: atomic<u32> }
@group(0) var<storage, read_write> report: Report;

struct Block { origin: vec2u, size: vec2u }
// Quads along a line that become one.
struct Run { count: u32, error_px: f32 }

fn texel_on_line(line: u32, place: u32) -> vec2u {
    return select(vec2u(place, line), vec2u(line, place), work.axis == 1u);
}

fn index_of(texel: vec2u) -> u32 {
    return texel.y * work.size_px.x + texel.x;
}

// The two triangles that are drawn, at a place inside the block; linear in the image, as planes are.
fn merged_at(corners: vec4f, at: vec2f) -> f32 {
    let upper = corners.x + (corners.y - corners.x) * at.x + (corners.z - corners.x) * at.y;
    let lower = corners.w + (corners.z - corners.w) * (1.0 - at.x) + (corners.y - corners.w) * (1.0 - at.y);
    return select(lower, upper, at.x + at.y <= 1.0);
}

// How far the merged quad is off a corner, along the corner's ray, as seen from the side at the corner's distance. On the
// outline it counts twice: there a crack opens to both sides.
fn error_px(corners: vec4f, block: Block, place: vec2u, inverse_depth: f32) -> f32 {
    let merged = merged_at(corners, vec2f(place) / vec2f(block.size));
    let ray = ray_at(vec2f(block.origin + place));
    let sides = select(1.0, 2.0, any(place == vec2u(0u)) || any(place == block.size));
    return sides * work.focal_px * length(ray) * abs(merged - inverse_depth) / merged;
}

fn error_of_quad(corners: vec4f, block: Block, place: vec2u) -> f32 {
    let quad = inverse_depths[index_of(block.origin + place)];
    return max(
        max(error_px(corners, block, place, quad.x), error_px(corners, block, place + vec2u(1u, 0u), quad.y)),
        max(error_px(corners, block, place + vec2u(0u, 1u), quad.z), error_px(corners, block, place + 1u, quad.w)),
    );
}

// The greatest error of all its samples' quads, as far as the bound is kept.
fn error_of_block(block: Block) -> f32 {
    let last = block.origin + block.size - 1u;
    let corners = vec4f(
        inverse_depths[index_of(block.origin)].x, inverse_depths[index_of(vec2u(last.x, block.origin.y))].y,
        inverse_depths[index_of(vec2u(block.origin.x, last.y))].z, inverse_depths[index_of(last)].w,
    );
    var worst = 0.0;
    for (var i = 0u; i < block.size.x * block.size.y && worst <= work.bound_px; i++) {
        worst = max(worst, error_of_quad(corners, block, vec2u(i % block.size.x, i / block.size.x)));
    }
    return worst;
}

fn block_of(origin: vec2u, extent: vec2u, count: u32) -> Block {
    return Block(origin, extent * texel_on_line(1u, count));
}

// Not quad by quad: a run may end badly at one sample and well at a later one.
fn longest_run(origin: vec2u, extent: vec2u, alike: u32) -> Run {
    var run = Run(1u, 0.0);
    for (var step = work.segment / 2u; step > 0u; step /= 2u) {
        let count = run.count + step;
        for (var once = count <= alike; once; once = false) {
            let error = error_of_block(block_of(origin, extent, count));
            if error <= work.bound_px { run = Run(count, error); }
        }
    }
    return run;
}

// Where quads along the line are no longer like the one at a place.
fn end_of_alike(line: u32, place: u32, end_of_segment: u32, word: u32) -> u32 {
    var end = place + 1u;
    for (; end < end_of_segment && extents[index_of(texel_on_line(line, end))] == word; end++) {}
    return end;
}

fn merge(line: u32, place: u32, extent: vec2u, run: Run) {
    for (var i = 1u; i < run.count; i++) { extents[index_of(texel_on_line(line, place + i))] = 0u; }
    let origin = texel_on_line(line, place);
    extents[index_of(origin)] = word_of(block_of(origin, extent, run.count).size);
    atomicMax(&report.greatest_error_px, bitcast<u32>(run.error_px));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= work.size_px[1u - work.axis] { return; }
    let begin = id.y * work.segment;
    let end = min(begin + work.segment, work.size_px[work.axis]);
    var alike_until = begin;
    for (var place = begin; place < end;) {
        let origin = texel_on_line(id.x, place);
        let word = extents[index_of(origin)];
        if place == alike_until { alike_until = end_of_alike(id.x, place, end, word); }
        var run = Run(alike_until - place, 0.0);
        for (var once = word != 0u; once; once = false) {
            run = longest_run(origin, extent_of(word), run.count);
            merge(id.x, place, extent_of(word), run);
        }
        place += run.count;
    }
}
