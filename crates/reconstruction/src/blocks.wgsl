// Pixels whose rays are searched in a block of a scene: those that cross its box and have met nothing in blocks before it. After the last
// block those that some block has left unknown, for the images of the view cell; where all blocks are proven empty there is nothing.
{% include "color.wgsl" %}
{% include "view_work.wgsl" %}
{% include "found.wgsl" %}

// Whether some block has left a pixel unknown.
@group(0) var<storage, read_write> unknown_in_blocks: array<u32>;

@compute @workgroup_size(TILE_PX, TILE_PX)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let place = pixel_at(id);
    if any(place >= work.view.size_px) { return; }
    let pixel = pixel_of(place);
{%- if rays == "OfFirstBlock" %}
    write_pixel(pixel.index, 0u, 0.0, PROVENANCE_EMPTY);
    unknown_in_blocks[pixel.index] = 0u;
{%- else %}
    let kind = out_provenance[pixel.index] & 0xffu;
    if kind == PROVENANCE_HIT { return; }
    let is_unknown = unknown_in_blocks[pixel.index] != 0u || kind == PROVENANCE_FILLED;
    unknown_in_blocks[pixel.index] = select(0u, 1u, is_unknown);
{%- endif %}
{%- if rays == "LeftUnknown" %}
    if is_unknown { leave_undecided(pixel.index); }
{%- else %}
    let span = span_in_volume(work.view.eye_in_world, pixel.direction, work.view.near_m);
    if span.near <= span.far { leave_undecided(pixel.index); }
{%- endif %}
}
