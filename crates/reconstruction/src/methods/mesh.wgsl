// Cuts an image into quads between samples: a cell whose four corners are one surface becomes a quad.
{% include "cut.wgsl" %}

// As in cell.wgsl.
@group(0) var cell_codes: texture_2d<u32>;
// For each sample.
@group(0) var<storage, read_write> inverse_depths: array<f32>;
@group(0) var<storage, read_write> extents: array<u32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= work.size_px) { return; }
    let index = id.y * work.size_px.x + id.x;
    let word = textureLoad(cell_codes, texel_at(work.first_sample + index), 0).x;
    let code = f32(word & 0x7fffu);
    inverse_depths[index] = select(0.0, (code - work.code_offset) / work.code_scale, code > 1.5);
    let whole = all(id.xy + 1u < work.size_px);
    extents[index] = select(0u, word_of(vec2u(1u)), whole && (word >> 31u) != 0u);
}
