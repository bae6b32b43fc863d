// The uniform of a view in passes over sample cameras: its camera, the volume, and the sample cameras.
{% include "table.wgsl" %}
{% include "tone.wgsl" %}
//
// Depth is kept as 15-bit codes, linear in inverse depth: code = 2 + (1/z - least) / step. So it is linear in screen
// space along a projected ray. 1 is background, farther than any sample; 0 is a hole, which certifies nothing and blocks
// nothing. The lowest byte of a pixel's provenance is its kind; a bit for each contributing camera follows. The
// highest byte says how two cameras share a colour (`split_of`) and stays on the device.

struct SampleCamera {
    // Rows that take (point_in_world, 1) to (column · w, row · w, w), w the planar depth in metres.
    homogeneous_pixel_from_world: array<vec4f, 3>,
    eye_in_world: vec3f,
    // code = code_scale / planar_depth_m + code_offset
    code_scale: f32,
    // Columns and rows less one: cells lie between texel centres.
    cells: vec2f,
    code_offset: f32,
    focal_px: f32,
    // log2 of the padded sides of level 0, and where this camera's nodes and its samples, each with the cell to its
    // lower right, begin.
    log2_sides: vec2u,
    first_node: u32,
    first_cell: u32,
    width_px: u32,
    // Greatest factor by which a point's sideways motion moves it in the image, over f / w.
    stretch: f32,
    // This camera's bit in provenance.
    mask: u32,
    // Where its coarser levels of colour begin; 0 where it has none.
    first_mip: u32,
}

struct ViewCamera {
    eye_in_world: vec3f,
    near_m: f32,
    // world direction of a pixel = column · x + row · y + corner; its parameter is planar depth in metres.
    column_in_world: vec3f,
    focal_px: f32,
    row_in_world: vec3f,
    // Where this view's pixels and tiles begin in the batch.
    first_pixel: u32,
    corner_in_world: vec3f,
    first_tile: u32,
    size_px: vec2u,
    // A piece of a view is some of its rows. This piece's number in the batch, and its rows: the first, a multiple of
    // TILE_PX, in the low half, and the one after the last in the high half.
    number: u32,
    rows: u32,
}

// One dispatch for each piece of a view: what is the same for a whole dispatch costs nothing a ray. Sample cameras are
// sorted by their distance from the view's eye, so that camera 0 knows most.
struct ViewWork {
    view: ViewCamera,
    volume_min_in_world: vec3f,
    // One over the number of positions that a pixel is the mean of.
    position_share: f32,
    volume_max_in_world: vec3f,
    padding: u32,
    // From a pixel's mean to what it shows.
    tone: Tone,
{%- if cameras > 0 %}
    cameras: array<SampleCamera, {{ cameras }}>,
{%- endif %}
}

@group(0) var<uniform> work: ViewWork;
{%- if listed is defined and listed %}
{% include "pixel_list.wgsl" %}
{%- endif %}
{%- if cameras > 0 %}
// Nodes of the pyramids: a range (nearest code low, farthest high), and the nearest code of 2 × 2 nodes.
@group(0) var nodes: texture_2d<u32>;
{%- endif %}

fn first_row() -> u32 { return work.view.rows & 0xffffu; }
fn end_row() -> u32 { return work.view.rows >> 16u; }

// The pixel of an invocation in a pass over all pixels.
fn pixel_at(id: vec3u) -> vec2u { return vec2u(id.x, id.y + first_row()); }

// Where a pixel of this view lies.
fn place_of(index: u32) -> vec2u {
    let place = index - work.view.first_pixel;
    return vec2u(place % work.view.size_px.x, place / work.view.size_px.x);
}

// Where this piece's list begins among the listed pixels of the batch.
fn first_listed() -> u32 { return work.view.first_pixel + first_row() * work.view.size_px.x; }

struct Span { near: f32, far: f32 }

// Where a ray is inside the volume that holds the scene; empty where near > far.
fn span_in_volume(eye: vec3f, direction: vec3f, near_m: f32) -> Span {
    // No component may be 0: 0 · inf is NaN.
    let d = select(direction, vec3f(1e-20), abs(direction) < vec3f(1e-20));
    let a = (work.volume_min_in_world - eye) / d;
    let b = (work.volume_max_in_world - eye) / d;
    let lower = min(a, b);
    let upper = max(a, b);
    return Span(max(max(lower.x, lower.y), max(lower.z, near_m)), min(min(upper.x, upper.y), upper.z));
}

fn homogeneous(rows: array<vec4f, 3>, v: vec4f) -> vec3f {
    return vec3f(dot(rows[0], v), dot(rows[1], v), dot(rows[2], v));
}

// The coarsest level of a pyramid.
fn top_level(log2_sides: vec2u) -> u32 {
    return min(log2_sides.x, log2_sides.y);
}

// The place of a node of level 1 or coarser; below these levels are cells.
fn node_index(log2_sides: vec2u, level: u32, node: vec2u) -> u32 {
    let finest = 1u << (log2_sides.x + log2_sides.y - 2u);
    let begin = (finest - (finest >> (2u * (level - 1u)))) / 3u * 4u;
    return begin + (node.y << (log2_sides.x - level)) + node.x;
}

// The nearest code of a node, in the lower half of its word; a hole may be as near as anything, nearer than any code.
fn nearest_code(word: u32) -> f32 {
{% if holes %}
    let code = word & 0xffffu;
    return select(f32(code), FAR_AWAY, code == 0xffffu);
{% else %}
    return f32(word & 0xffffu);
{% endif %}
}

fn safe_reciprocal(v: f32) -> f32 {
    return 1.0 / select(v, 1e-20, abs(v) < 1e-20);
}
