// Lists the quads of an image in the order of their samples, as two triangles each.
{% include "cut.wgsl" %}

@group(0) var<storage, read> extents: array<u32>;
// By now the places where the quads of each chunk begin.
@group(0) var<storage, read> counts: array<u32>;
@group(0) var<storage, read_write> indices: array<u32>;

// Vertices: upper left, upper right, lower left, lower right.
fn corners_of(index: u32, extent: vec2u) -> vec4u {
{% if at_texel_corners %}
    // A merged quad borrows its corners from the samples at its corners.
    let last = extent - 1u;
    let below = index + last.y * work.size_px.x;
    return 4u * vec4u(index, index + last.x, below, below + last.x) + vec4u(0u, 1u, 2u, 3u);
{% else %}
    let below = index + work.size_px.x;
    return vec4u(index, index + 1u, below, below + 1u);
{% endif %}
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= work.chunks { return; }
    let end = min((id.x + 1u) * CHUNK, work.size_px.x * work.size_px.y);
    var place = counts[id.x] * INDICES_A_QUAD;
    for (var i = id.x * CHUNK; i < end; i++) {
        let word = extents[i];
        if word == 0u { continue; }
        let corners = corners_of(i, extent_of(word));
        indices[place] = corners.x;
        indices[place + 1u] = corners.y;
        indices[place + 2u] = corners.z;
        indices[place + 3u] = corners.w;
        indices[place + 4u] = corners.z;
        indices[place + 5u] = corners.y;
        place += INDICES_A_QUAD;
    }
}
