{% set bounced = false -%}
// The first passes of the joint carve: march in the image of one sample camera alone, then ask all cameras
// about the point found. Most pixels end with the nearest camera and most others with the second nearest;
// what is left goes to joint_carve.wgsl.
//
// In the camera's image the ray is a straight line. Columns, rows and the depth code are linear along it in one parameter
// s, so that a step needs no division.
{% include "surface.wgsl" %}

const CAMERA: u32 = {{ march_camera }}u;

{% include "joint_carve/march_image.wgsl" %}
{% if march_camera == 0 %}
@group(0) var<storage, read> tile_start_m: array<f32>;
{% endif %}

@compute @workgroup_size({{ "LIST_WORKGROUP" if listed else "TILE_PX, TILE_PX" }})
fn main(@builtin(global_invocation_id) id: vec3u) {
{% include "at_pixel.wgsl" %}
    let pixel = pixel_of(place);
    let span = span_in_volume(work.view.eye_in_world, pixel.direction, work.view.near_m);
    // The marches after the first go on where the one before ended.
    let begin = {{ "max(span.near, tile_start_m[pixel.tile])" if march_camera == 0 else "out_inverse_depth[pixel.index]" }};
    let a = homogeneous(work.cameras[CAMERA].homogeneous_pixel_from_world, vec4f(work.view.eye_in_world, 1.0));
    let b = homogeneous(work.cameras[CAMERA].homogeneous_pixel_from_world, vec4f(pixel.direction, 0.0));
    let found = march(a, b, begin, max(span.far, begin));
    let blend = blend_two_best(work.view.eye_in_world + pixel.direction * found.t, pixel.direction);
    let hit = found.crossed && blend.occupied;
    // Proven empty up to where the volume ends. A pixel that is left undecided keeps how far it got where
    // its inverse depth will be.
    let empty = begin >= span.far;
    let color = select(0u, rgb9e5_from_linear(blend.color_linear), hit && !empty);
    let provenance = select(PROVENANCE_HIT | blend.origin, PROVENANCE_EMPTY, empty);
    let depth = select(select(found.t, 1.0 / found.t, hit), 0.0, empty);
    write_pixel(pixel.index, color, depth, provenance);
    if !hit && !empty { leave_undecided(pixel.index); }
}
