// A sample image that is cut into quads. Corners of quads lie on fixed rays of the image: their inverse depths say all of
// where they are.
{% include "table.wgsl" %}

struct CutWork {
    // world direction of a pixel = column · x + row · y + corner; its parameter is planar depth in metres.
    column_in_world: vec3f,
    focal_px: f32,
    row_in_world: vec3f,
    // code = code_scale / planar_depth_m + code_offset
    code_scale: f32,
    corner_in_world: vec3f,
    code_offset: f32,
    size_px: vec2u,
    // Where this image's samples begin among those of the set, and its corners in `planes`.
    first_sample: u32,
    first_corner: u32,
    // For merging: 0 across, 1 down, and the greatest error in pixels.
    axis: u32,
    bound_px: f32,
    // Chunks of CHUNK samples.
    chunks: u32,
    // For merging: the length of the pieces that lines are cut into, in texels.
    segment: u32,
}

@group(0) var<uniform> work: CutWork;

// Columns and rows of a quad in texels: its word among the extents of an image's quads, 0 where none begins.
fn extent_of(word: u32) -> vec2u { return vec2u(word & 0xffffu, word >> 16u); }
fn word_of(extent: vec2u) -> u32 { return extent.x | (extent.y << 16u); }

fn ray_at(position_px: vec2f) -> vec3f {
    return work.column_in_world * position_px.x + work.row_in_world * position_px.y + work.corner_in_world;
}
