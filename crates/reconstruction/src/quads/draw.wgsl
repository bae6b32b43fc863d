// Draws the quads of one image into one view: depth, and the sample of each pixel.
//
// A vertex is an inverse depth on a known ray of the image, eye + ray / d. Times d, which changes no place on the
// screen, its clip position is linear in d, column and row. That is no more work than a matrix for four bytes a vertex,
// and quads that share a corner get the very same position.

struct QuadWork {
    clip_from_inverse_depth: vec4f,
    clip_from_column: vec4f,
    clip_from_row: vec4f,
    clip_from_corner: vec4f,
    width_px: u32,
    // Where this image's samples begin among those of the set.
    first_sample: u32,
    padding: vec2u,
}

@group(0) var<uniform> work: QuadWork;

struct Vertex {
    @builtin(position) position: vec4f,
{% if not depth_only %}    @location(0) @interpolate(flat) sample: u32,
{% endif %}}

@vertex
fn vertex(@builtin(vertex_index) number: u32, @location(0) inverse_depth: f32) -> Vertex {
{% if at_texel_corners %}
    let sample = number / 4u;
    let offset = vec2f(vec2u(number & 1u, (number >> 1u) & 1u));
{% else %}
    let sample = number;
    let offset = vec2f(0.5);
{% endif %}
    let at = vec2f(vec2u(sample % work.width_px, sample / work.width_px)) + offset;
    let position = work.clip_from_inverse_depth * inverse_depth
        + work.clip_from_column * at.x + work.clip_from_row * at.y + work.clip_from_corner;
    return Vertex(position{{ "" if depth_only else ", work.first_sample + sample" }});
}

{% if not depth_only %}
@fragment
fn fragment(vertex: Vertex) -> @location(0) u32 {
    return vertex.sample;
}
{% endif %}
