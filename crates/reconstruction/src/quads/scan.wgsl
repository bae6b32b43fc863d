// Turns counts of chunks into places where their quads begin, and says how much there is to draw. One workgroup.
{% include "cut.wgsl" %}

@group(0) var<storage, read_write> counts: array<u32>;
// Arguments of an indexed indirect draw.
struct Draw { index_count: u32, instance_count: u32, first_index: u32, base_vertex: u32, first_instance: u32 }
@group(0) var<storage, read_write> draw: Draw;

const LANES: u32 = 64u;

var<workgroup> sums: array<u32, LANES>;

@compute @workgroup_size(LANES)
fn main(@builtin(local_invocation_id) id: vec3u) {
    let span = (work.chunks + LANES - 1u) / LANES;
    let begin = id.x * span;
    let end = min(begin + span, work.chunks);
    var sum = 0u;
    for (var i = begin; i < end; i++) { sum += counts[i]; }
    sums[id.x] = sum;
    workgroupBarrier();
    var place = 0u;
    for (var lane = 0u; lane < id.x; lane++) { place += sums[lane]; }
    for (var i = begin; i < end; i++) {
        let count = counts[i];
        counts[i] = place;
        place += count;
    }
    if id.x == LANES - 1u { draw = Draw(place * INDICES_A_QUAD, 1u, 0u, 0u, 0u); }
}
