// What every search along view rays needs: sample cameras, their depth pyramids and colours, and views.
//
// Depth is kept as 15-bit codes, linear in inverse depth: code = 2 + (1/z - least) / step, so that along
// a projected ray it is linear in screen space like everything else. 1 is background, farther than any
// sample; 0 is a hole, which certifies nothing and blocks nothing.

const HOLE: u32 = 0u;

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
    // log2 of the padded sides of level 0, and where this camera's words begin.
    log2_sides: vec2u,
    first_word: u32,
    first_texel: u32,
    width_px: u32,
    // Greatest factor by which a point's sideways motion moves it in the image, over f / w.
    stretch: f32,
    // This camera's bit in provenance.
    mask: u32,
    // Where words for tiles begin: like the pyramid's, but each with the nearest code of 2 × 2 nodes.
    first_wide_word: u32,
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
    steps: u32,
    // This view's number in the batch.
    number: u32,
}

// One dispatch a view: what is the same for a whole dispatch costs nothing a ray. Sample cameras are
// sorted by their distance from the view's eye, so that camera 0 knows most.
struct ViewWork {
    view: ViewCamera,
    volume_min_in_world: vec3f,
    background_srgb8: u32,
    volume_max_in_world: vec3f,
    padding: u32,
    cameras: array<SampleCamera, {{ cameras }}>,
}

@group(0) @binding(0) var<uniform> work: ViewWork;
@group(0) @binding(1) var<storage, read> pyramids: array<u32>;

const TILE_PX: u32 = 8u;
const FAR_AWAY: f32 = 3.0e38;

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

// Where level `level` of a pyramid begins, in words, and its index of a node. Level 0 has one word a
// cell: the codes of its two upper corners, and in the highest bit whether its corners are one surface. Higher levels: nearest code low, farthest high.
fn node_index(log2_sides: vec2u, level: u32, node: vec2u) -> u32 {
    let whole = 1u << (log2_sides.x + log2_sides.y);
    let begin = (whole - (whole >> (2u * level))) / 3u * 4u;
    return begin + (node.y << (log2_sides.x - level)) + node.x;
}

fn safe_reciprocal(v: f32) -> f32 {
    return 1.0 / select(v, 1e-20, abs(v) < 1e-20);
}
