// Adds the light that depends on the viewer to pixels that show a surface. Their colour so far is the light that the
// surface sends to all sides alike. The pass works on the finished view of any method.
//
// The samples around the point tell what a surface reflects: those of the contributing camera that is nearest to
// the view. A filled pixel shows no surface that a camera saw, and gets no highlight.
{% include "reflection.wgsl" %}
{% include "view_work.wgsl" %}
{% include "cell.wgsl" %}

// Linear, as RGB9E5.
@group(0) var<storage, read_write> out_color: array<u32>;
@group(0) var<storage, read> inverse_depth: array<f32>;
@group(0) var<storage, read> provenance: array<u32>;
{% include "gathered.wgsl" %}

{%- if spawns %}
{% include "bounce/ray.wgsl" %}
{% include "bounce/spawn.wgsl" %}
{%- endif %}
{%- if lists_glossy %}
{% include "bounce/list_glossy.wgsl" %}
{%- endif %}

@compute @workgroup_size({{ "LIST_WORKGROUP" if listed else "TILE_PX, TILE_PX" }})
fn main(@builtin(global_invocation_id) id: vec3u) {
{% include "at_pixel.wgsl" %}
    let origin = provenance[index];
    if (origin & 0xffu) != PROVENANCE_HIT { return; }
    let center = vec2f(place) + 0.5;
    let direction = work.view.column_in_world * center.x + work.view.row_in_world * center.y + work.view.corner_in_world;
    let point_in_world = work.view.eye_in_world + direction / inverse_depth[index];
{% include "gather_at.wgsl" %}
    if around.reflecting <= 0.0 { return; }
    let towards_eye = unit_or_zero(-direction);
    var added = highlight(point_in_world, around.normal, towards_eye, around.reflector, around.visibility) * around.reflecting;
{%- if mirrors %}
    let mirror = Mirror(point_in_world, around.normal, towards_eye, unpack_reflector(around.reflector));
    let open = {{ "unpack4x8unorm(around.visibility[0]).x" if visibility_words > 0 else "1.0" }};
    let side_m = 1.0 / (inverse_depth[index] * work.view.focal_px);
{%- if spawns %}
    let curvature = select(0.0, curvature_at(camera, cell_index, point_in_world, 1.0 / (inverse_w * camera.focal_px)), corners.connected);
    // Each of several positions within a pixel has a part of its footprint.
    let width_m = side_m * sqrt(work.position_share);
    let cone = cone_off(Cone(width_m, width_m / distance(point_in_world, work.view.eye_in_world)), curvature);
    added += bounce_off(mirror, index, vec3f(around.reflecting), open, side_m, cone);
{%- endif %}
{%- if lists_glossy %}
    let rest = around.reflecting * ({{ lobe_share }});
    for (var lists = rest > 0.0; lists; lists = false) { list_glossy(mirror, index, vec3f(rest), open); }
{%- endif %}
{%- endif %}
    out_color[index] = rgb9e5_from_linear(linear_from_rgb9e5(out_color[index]) + added);
}
