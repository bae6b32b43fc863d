// A cell of a sample image: the four samples at its corners.

// A cell's corners: codes (upper left, upper right, lower left, lower right), and whether they are one surface.
{% if holes %}
// `certain`: the ways to all four are proven free; `proven`: 1 where a corner's own way is, else 0.
struct Corners { codes: vec4f, connected: bool, certain: bool, proven: vec4f }
{% else %}
struct Corners { codes: vec4f, connected: bool }
{% endif %}

// Two words for each cell: the codes of its upper and of its lower corners. The highest bit of the first says that the
// corners are one surface. The highest bit of the second says that some way to them is not proven free. Bit 15 of the
// first says so of the upper left corner.
@group(0) var cell_codes: texture_2d<u32>;

fn corners_of(cell_index: u32) -> Corners {
    let words = textureLoad(cell_codes, texel_at(cell_index), 0).xy;
    let codes = vec4u(words.x & 0x7fffu, (words.x >> 16u) & 0x7fffu, words.y & 0x7fffu, (words.y >> 16u) & 0x7fffu);
{% if holes %}
    // A sample's lowest bit says that its way is not proven free.
    let is_sample = codes > vec4u(1u);
    let proven = select(vec4f(1.0), vec4f(0.0), is_sample & ((codes & vec4u(1u)) == vec4u(1u)));
    let plain = select(codes, codes & vec4u(0x7ffeu), is_sample);
    return Corners(vec4f(plain), (words.x >> 31u) != 0u, (words.y >> 31u) == 0u, proven);
{% else %}
    return Corners(vec4f(codes), (words.x >> 31u) != 0u);
{% endif %}
}

fn bilinear(corners: vec4f, at: vec2f) -> f32 {
    let upper = corners.x + (corners.y - corners.x) * at.x;
    let lower = corners.z + (corners.w - corners.z) * at.x;
    return upper + (lower - upper) * at.y;
}

// The share of each corner at a place inside the cell, in their order.
fn bilinear_shares(at: vec2f) -> vec4f {
    return vec4f((1.0 - at.x) * (1.0 - at.y), at.x * (1.0 - at.y), (1.0 - at.x) * at.y, at.x * at.y);
}
