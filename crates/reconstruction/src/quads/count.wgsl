// Counts the quads of each chunk of samples, so that they can be listed in their order.
{% include "cut.wgsl" %}

@group(0) var<storage, read> extents: array<u32>;
@group(0) var<storage, read_write> counts: array<u32>;
struct Report { greatest_error_px: u32, quads_before: atomic<u32> }
@group(0) var<storage, read_write> report: Report;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= work.chunks { return; }
    let end = min((id.x + 1u) * CHUNK, work.size_px.x * work.size_px.y);
    var count = 0u;
    var before = 0u;
    for (var i = id.x * CHUNK; i < end; i++) {
        let extent = extent_of(extents[i]);
        count += min(extent.x, 1u);
        before += extent.x * extent.y;
    }
    counts[id.x] = count;
    atomicAdd(&report.quads_before, before);
}
